use super::distributions::{normal_quantile, normal_upper};
use super::error::{StatisticsError, checked, checked_level, finite_or};
use super::mean_interval::Interval;
use crate::moments::{mean, sample_sd};
use crate::robust::quantile_of_sorted;

/// The most resamples.
const MOST_RESAMPLES: usize = 1_000_000;

/// Settings of the bootstrap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bootstrap {
    /// The number of resamples; 2000 are few for the ends of an interval, 10 000 are enough, a million is
    /// the maximum.
    pub resamples: usize,
    /// The confidence of the intervals, 0.95 for 95 %.
    pub level: f64,
    /// The seed; the same seed draws the same resamples on every machine.
    pub seed: u64,
}

impl Default for Bootstrap {
    fn default() -> Bootstrap {
        Bootstrap { resamples: 10_000, level: 0.95, seed: 1 }
    }
}

/// A statistic with its bootstrap confidence intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BootstrapInterval {
    /// The statistic of the original values.
    pub value: f64,
    /// The standard deviation of the statistic over the resamples.
    pub standard_error: f64,
    /// The percentile interval.
    pub percentile: Interval,
    /// The interval corrected for bias and skew (`BCa`). `None` where the correction is undefined, as for equal
    /// values.
    pub bias_corrected: Option<Interval>,
}

/// Computes confidence intervals of any statistic of independent values, by resampling them with replacement.
///
/// In the unit of the statistic. Percentile and `BCa` intervals: Efron (1987), doi:10.1080/01621459.1987.10478410; as
/// with `scipy.stats.bootstrap` and the same draws. For paired values pass the differences. Draws come from
/// `SplitMix64` (Steele et al. 2014, doi:10.1145/2660193.2660195), since the draws for a seed must never change.
/// Limits: below about ten values, intervals are too narrow.
///
/// ```
/// use teampulse_signal::{robust::median, statistics::{Bootstrap, bootstrap}};
/// let values = [1.0, 4.0, 2.0, 8.0, 5.0, 7.0, 3.0, 9.0, 6.0, 10.0];
/// let of = |values: &[f64]| median(values).unwrap_or(f64::NAN);
/// let interval = bootstrap(&values, of, &Bootstrap::default())?.percentile;
/// assert!(interval.low < 5.5 && 5.5 < interval.high);
/// # Ok::<(), teampulse_signal::statistics::StatisticsError>(())
/// ```
pub fn bootstrap(
    values: &[f64],
    statistic: impl Fn(&[f64]) -> f64,
    settings: &Bootstrap,
) -> Result<BootstrapInterval, StatisticsError> {
    let level = checked_level(settings.level)?;
    checked(&[values], 1, 2)?;
    if settings.resamples < 2 {
        return Err(StatisticsError::TooFew { got: settings.resamples, need: 2 });
    }
    if settings.resamples > MOST_RESAMPLES {
        let got = settings.resamples;
        return Err(StatisticsError::TooMany { got, most: MOST_RESAMPLES });
    }
    let value = statistic(values);
    let mut drawn = draws(values, &statistic, settings);
    finite_or(&drawn, StatisticsError::OutOfRange)?;
    finite_or(&[value], StatisticsError::OutOfRange)?;
    drawn.sort_unstable_by(f64::total_cmp);
    let tail = (1.0 - level) / 2.0;
    let between = |low: f64, high: f64| Interval {
        low: quantile_of_sorted(&drawn, low),
        high: quantile_of_sorted(&drawn, high),
    };
    let shares = corrected_shares(values, &statistic, &drawn, tail);
    Ok(BootstrapInterval {
        value,
        standard_error: sample_sd(&drawn),
        percentile: between(tail, 1.0 - tail),
        bias_corrected: shares.map(|(low, high)| between(low, high)),
    })
}

fn draws(values: &[f64], statistic: &impl Fn(&[f64]) -> f64, settings: &Bootstrap) -> Vec<f64> {
    let mut random = SplitMix64(settings.seed);
    let mut sample = values.to_vec();
    let mut draw = || {
        sample.fill_with(|| values[random.below(values.len())]);
        statistic(&sample)
    };
    (0..settings.resamples).map(|_| draw()).collect()
}

/// The quantiles that `BCa` uses instead of `tail` and 1 − `tail`.
fn corrected_shares(
    values: &[f64],
    statistic: &impl Fn(&[f64]) -> f64,
    sorted_draws: &[f64],
    tail: f64,
) -> Option<(f64, f64)> {
    let value = statistic(values);
    let below = sorted_draws.partition_point(|&each| each < value);
    let not_above = sorted_draws.partition_point(|&each| each <= value);
    let share = (below + not_above) as f64 / (2.0 * sorted_draws.len() as f64);
    if share <= 0.0 || share >= 1.0 {
        return None;
    }
    let (bias, skew) = (normal_quantile(share), acceleration(values, statistic));
    let moved = |z: f64| {
        let z = bias + z;
        normal_upper(-(bias + z / (1.0 - skew * z)))
    };
    let shares = (moved(normal_quantile(tail)), moved(-normal_quantile(tail)));
    (shares.0.is_finite() && shares.1.is_finite()).then_some(shares)
}

/// The acceleration: the skew of the jackknife values.
fn acceleration(values: &[f64], statistic: &impl Fn(&[f64]) -> f64) -> f64 {
    let mut rest = values[1..].to_vec();
    let mut left_out = Vec::with_capacity(values.len());
    for (k, &value) in values.iter().enumerate() {
        left_out.push(statistic(&rest));
        if let Some(slot) = rest.get_mut(k) {
            *slot = value;
        }
    }
    let centre = mean(&left_out);
    let sum = |power| left_out.iter().map(|each| (centre - each).powi(power)).sum::<f64>();
    sum(3) / (6.0 * sum(2).powf(1.5))
}

struct SplitMix64(u64);

impl SplitMix64 {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A random integer below `count`; the bias is negligible for small ones.
    fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.next()) * count as u128) >> 64) as usize
    }
}
