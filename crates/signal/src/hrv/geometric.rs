use super::measure::Measure;
use super::series::present;

/// Width of a histogram bin [ms]: one sample at 128 Hz, as the Task Force recommends.
pub const BIN_MS: f64 = 1000.0 / 128.0;

/// The most bins of the histogram: up to 8 s.
const MOST_BINS: usize = 1024;

/// Geometric features.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometric {
    /// Triangular index: the number of intervals over the number in the fullest bin.
    pub triangular_index: f64,
    /// Base of the triangle that fits the histogram best (TINN) [ms]; NaN if there is none.
    pub tinn_ms: f64,
}

/// Geometric features of intervals [ms], from their histogram in bins of [`BIN_MS`].
///
/// The apex of the triangle is the fullest bin (the first of equals); its ends N and M are the bins that
/// minimise the squared error over all bins. Task Force (1996), doi:10.1161/01.CIR.93.5.1043. Window: at
/// least 20 minutes, 24 hours for comparison. `None` without an interval from 0 to 8 s. Limits: with few
/// intervals, the fullest bin is a matter of chance. NeuroKit2's TINN stops its search after the first N,
/// so it differs (0 where there is a triangle).
pub fn geometric(intervals_ms: &[f64]) -> Option<Geometric> {
    let bin = |each: f64| (each / BIN_MS).floor() as usize;
    let inside = |&each: &f64| each > 0.0 && each < BIN_MS * MOST_BINS as f64;
    let bins: Vec<usize> = present(intervals_ms).into_iter().filter(inside).map(bin).collect();
    let (lowest, highest) = (*bins.iter().min()?, *bins.iter().max()?);
    // One empty bin on each side, where the triangle may end.
    let mut counts = vec![0.0; highest - lowest + 3];
    for bin in &bins {
        counts[bin - lowest + 1] += 1.0;
    }
    let fullest = counts.iter().copied().fold(0.0, f64::max);
    let peak = counts.iter().position(|&count| count >= fullest)?;
    Some(Geometric {
        triangular_index: bins.len() as f64 / fullest,
        tinn_ms: base(&counts, peak) as f64 * BIN_MS,
    })
}

/// Bins from N to M. Both sides of the triangle are fitted separately, as neither affects the other's
/// error.
fn base(counts: &[f64], peak: usize) -> usize {
    let left: Vec<f64> = counts[..=peak].iter().rev().copied().collect();
    reach(&left) + reach(&counts[peak..])
}

/// The distance from the peak (the first bin) at which a line down to zero fits best.
fn reach(counts: &[f64]) -> usize {
    let missed = |end: usize| {
        let height = |k: usize| counts[0] * (1.0 - k as f64 / end as f64).max(0.0);
        counts.iter().enumerate().map(|(k, count)| (count - height(k)).powi(2)).sum::<f64>()
    };
    (1..counts.len()).min_by(|&a, &b| missed(a).total_cmp(&missed(b))).unwrap_or(0)
}

impl Geometric {
    /// The features by name.
    pub fn measures(&self) -> Vec<Measure> {
        Measure::all([("HRV_HTI", "1", self.triangular_index), ("HRV_TINN", "ms", self.tinn_ms)])
    }
}
