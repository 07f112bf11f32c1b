use super::fuzzy::fuzzy_entropy;
use super::measure::Measure;
use super::multiscale::multiscale_index;
use super::series::present;
use crate::moments::sample_sd;

/// The tolerance in standard deviations (n − 1), by convention.
const TOLERANCE_SD: f64 = 0.2;
/// The most intervals compared: the time is quadratic.
const MOST: usize = 100_000;

/// The unpredictability of intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entropies {
    /// Sample entropy; NaN where no three beats match.
    pub sample: f64,
    /// Approximate entropy.
    pub approximate: f64,
    /// Fuzzy entropy; NaN above 20 000 intervals.
    pub fuzzy: f64,
    /// Index of multiscale entropy; NaN with fewer than 24 intervals.
    pub multiscale: f64,
}

/// Sample, approximate, fuzzy and multiscale entropy of intervals [ms], with m = 2 and r = 0.2 SD (n − 1).
///
/// Window: 5 minutes (200 beats at least). Missing intervals are removed. `None` with fewer than four
/// intervals, more than 100 000, or without spread.
pub fn entropies(intervals_ms: &[f64]) -> Option<Entropies> {
    let tolerance_ms = TOLERANCE_SD * sample_sd(&present(intervals_ms));
    Some(Entropies {
        sample: sample_entropy(intervals_ms, tolerance_ms).unwrap_or(f64::NAN),
        approximate: approximate_entropy(intervals_ms, tolerance_ms)?,
        fuzzy: fuzzy_entropy(intervals_ms, tolerance_ms).unwrap_or(f64::NAN),
        multiscale: multiscale_index(intervals_ms, tolerance_ms).unwrap_or(f64::NAN),
    })
}

/// Sample entropy: −ln of the probability that matching pairs still match with the next beat, m = 2.
///
/// A match means that no two intervals differ by more than `tolerance_ms`. Richman & Moorman (2000),
/// doi:10.1152/ajpheart.2000.278.6.H2039; as NeuroKit2's `entropy_sample`. `None` as for [`entropies`], and
/// without matching triples.
pub fn sample_entropy(intervals_ms: &[f64], tolerance_ms: f64) -> Option<f64> {
    let nn = checked(intervals_ms, tolerance_ms)?;
    let (mut pairs, mut triples) = (0u64, 0u64);
    each_alike(&nn, tolerance_ms, |a, b| {
        // The last pair has no beat after it, and does not count.
        if let (Some(after_a), Some(after_b)) = (nn.get(a + 2), nn.get(b + 2)) {
            pairs += 1;
            triples += u64::from((after_a - after_b).abs() <= tolerance_ms);
        }
    });
    (triples > 0).then(|| (pairs as f64 / triples as f64).ln())
}

/// Approximate entropy, m = 2: like [`sample_entropy`], but including self-matches.
///
/// Pincus (1991), doi:10.1073/pnas.88.6.2297; as NeuroKit2's `entropy_approximate`. Limits: biased low with
/// few beats; prefer sample entropy. `None` as for [`entropies`].
pub fn approximate_entropy(intervals_ms: &[f64], tolerance_ms: f64) -> Option<f64> {
    let nn = checked(intervals_ms, tolerance_ms)?;
    let (mut pairs, mut triples) = (vec![1.0; nn.len() - 1], vec![1.0; nn.len() - 2]);
    each_alike(&nn, tolerance_ms, |a, b| {
        pairs[a] += 1.0;
        pairs[b] += 1.0;
        if let (Some(after_a), Some(after_b)) = (nn.get(a + 2), nn.get(b + 2))
            && (after_a - after_b).abs() <= tolerance_ms
        {
            triples[a] += 1.0;
            triples[b] += 1.0;
        }
    });
    let mean_log = |counts: &[f64]| {
        let n = counts.len() as f64;
        counts.iter().map(|count: &f64| (count / n).ln()).sum::<f64>() / n
    };
    Some((mean_log(&pairs) - mean_log(&triples)).abs())
}

fn checked(intervals_ms: &[f64], tolerance_ms: f64) -> Option<Vec<f64>> {
    let nn = present(intervals_ms);
    let fits = (4..=MOST).contains(&nn.len()) && tolerance_ms > 0.0 && tolerance_ms.is_finite();
    fits.then_some(nn)
}

/// Reports the indices of all matching pairs of successive intervals.
///
/// Sorted by their first interval, only neighbours can match.
fn each_alike(nn: &[f64], tolerance_ms: f64, mut report: impl FnMut(usize, usize)) {
    let mut order: Vec<usize> = (0..nn.len() - 1).collect();
    order.sort_unstable_by(|&a, &b| nn[a].total_cmp(&nn[b]));
    for (rank, &a) in order.iter().enumerate() {
        for &b in &order[rank + 1..] {
            if nn[b] - nn[a] > tolerance_ms {
                break;
            }
            if (nn[a + 1] - nn[b + 1]).abs() <= tolerance_ms {
                report(a, b);
            }
        }
    }
}

impl Entropies {
    /// The features by name.
    pub fn measures(&self) -> Vec<Measure> {
        Measure::all([
            ("HRV_SampEn", "1", self.sample),
            ("HRV_ApEn", "1", self.approximate),
            ("HRV_FuzzyEn", "1", self.fuzzy),
            ("HRV_MSEn", "1", self.multiscale),
        ])
    }
}
