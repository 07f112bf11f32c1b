use super::distributions::normal_upper;
use super::error::{StatisticsError, checked, finite_or};

/// The most values for which the approximation is valid.
const MOST: usize = 5000;

/// The result of Shapiro and Wilk's test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapiroWilk {
    /// The W statistic [0..1].
    pub w: f64,
    /// The p-value [0..1].
    pub p: f64,
}

/// Tests whether values are normal: Shapiro and Wilk's W with Royston's approximation of its p.
///
/// Shapiro & Wilk (1965), doi:10.2307/2333709; Royston (1995, algorithm AS R94), doi:10.2307/2986146;
/// as `scipy.stats.shapiro`. From 3 to 5000 values. Limits: it has little power with few values, and finds
/// every trifle with thousands.
pub fn shapiro_wilk(values: &[f64]) -> Result<ShapiroWilk, StatisticsError> {
    checked(&[values], 1, 3)?;
    if values.len() > MOST {
        return Err(StatisticsError::TooMany { got: values.len(), most: MOST });
    }
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let (centre, range) = (sorted[sorted.len() / 2], sorted[sorted.len() - 1] - sorted[0]);
    if range <= 0.0 {
        return Err(StatisticsError::NoSpread);
    }
    finite_or(&[range], StatisticsError::OutOfRange)?;
    let scaled: Vec<f64> = sorted.iter().map(|each| (each - centre) / range).collect();
    finite_or(&scaled, StatisticsError::OutOfRange)?;
    let shortfall = shortfall(&scaled, &weights(values.len()));
    Ok(ShapiroWilk { w: 1.0 - shortfall, p: p_of(shortfall, values.len() as f64) })
}

/// The weights of the upper half of the sorted values, from the greatest inwards; those of the lower half
/// have the opposite sign.
fn weights(n: usize) -> Vec<f64> {
    const GREATEST: [f64; 6] = [0.0, 0.221_157, -0.147_981, -2.071_19, 4.434_685, -2.706_056];
    const SECOND: [f64; 6] = [0.0, 0.042_981, -0.293_762, -1.752_461, 5.682_633, -3.582_633];
    if n == 3 {
        return vec![std::f64::consts::FRAC_1_SQRT_2];
    }
    let score = |k: usize| normal_score((k as f64 + 0.625) / (n as f64 + 0.25));
    let scores: Vec<f64> = (0..n / 2).map(score).collect();
    let squares = 2.0 * scores.iter().map(|each| each * each).sum::<f64>();
    let root_n = 1.0 / (n as f64).sqrt();
    let given = if n > 5 { 2 } else { 1 };
    let mut weights: Vec<f64> = [GREATEST, SECOND][..given]
        .iter()
        .zip(&scores)
        .map(|(series, score)| polynomial(series, root_n) - score / squares.sqrt())
        .collect();
    let twice_squares = |of: &[f64]| 2.0 * of.iter().map(|each| each * each).sum::<f64>();
    let left = (squares - twice_squares(&scores[..given])) / (1.0 - twice_squares(&weights));
    weights.extend(scores[given..].iter().map(|score| -score / left.sqrt()));
    weights
}

/// 1 − W, without cancellation.
fn shortfall(scaled: &[f64], weights: &[f64]) -> f64 {
    let n = scaled.len();
    let mean = scaled.iter().sum::<f64>() / n as f64;
    let weight = |k: usize| match k.cmp(&(n - 1 - k)) {
        std::cmp::Ordering::Less => -weights[k],
        std::cmp::Ordering::Equal => 0.0,
        std::cmp::Ordering::Greater => weights[n - 1 - k],
    };
    let (mut of_weights, mut of_values, mut of_both) = (0.0, 0.0, 0.0);
    for (k, value) in scaled.iter().enumerate() {
        let (a, x) = (weight(k), value - mean);
        of_weights += a * a;
        of_values += x * x;
        of_both += a * x;
    }
    let root = f64::sqrt(of_weights * of_values);
    (root - of_both) * (root + of_both) / (of_weights * of_values)
}

fn p_of(shortfall: f64, n: f64) -> f64 {
    if n <= 3.0 {
        let p = 6.0 / std::f64::consts::PI
            * ((1.0 - shortfall).sqrt().asin() - std::f64::consts::FRAC_PI_3);
        return p.clamp(0.0, 1.0);
    }
    let (log, log_n) = (shortfall.ln(), n.ln());
    if n > 11.0 {
        let centre = polynomial(&[-1.5861, -0.310_82, -0.083_751, 0.003_891_5], log_n);
        let spread = polynomial(&[-0.4803, -0.082_676, 0.003_030_2], log_n).exp();
        return normal_upper((log - centre) / spread);
    }
    let bound = polynomial(&[-2.273, 0.459], n);
    if log >= bound {
        return 0.0;
    }
    let centre = polynomial(&[0.544, -0.399_78, 0.025_054, -6.714e-4], n);
    let spread = polynomial(&[1.3822, -0.778_57, 0.062_767, -0.002_032_2], n).exp();
    normal_upper((-(bound - log).ln() - centre) / spread)
}

/// Normal quantile as in AS R94 and SciPy, to nine digits. Beasley & Springer (1977), Applied Statistics 26,
/// 118: algorithm AS 111.
fn normal_score(p: f64) -> f64 {
    let off = p - 0.5;
    if off.abs() <= 0.42 {
        let square = off * off;
        let over = [2.506_628_238_84, -18.615_000_625_29, 41.391_197_735_34, -25.441_060_496_37];
        let under =
            [1.0, -8.473_510_930_90, 23.083_367_437_43, -21.062_241_018_26, 3.130_829_098_33];
        return off * polynomial(&over, square) / polynomial(&under, square);
    }
    let root = (-p.min(1.0 - p).ln()).sqrt();
    let over = [-2.787_189_311_38, -2.297_964_791_34, 4.850_141_271_35, 2.321_212_768_58];
    let under = [1.0, 3.543_889_247_62, 1.637_067_818_97];
    off.signum() * polynomial(&over, root) / polynomial(&under, root)
}

fn polynomial(series: &[f64], x: f64) -> f64 {
    series.iter().rev().fold(0.0, |sum, each| sum * x + each)
}
