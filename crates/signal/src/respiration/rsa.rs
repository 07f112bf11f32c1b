//! Respiratory sinus arrhythmia: the acceleration of the heart with inhalation and its deceleration with
//! exhalation.

use super::Breath;
use super::pattern::{mean, sample_sd};

/// An interval between heartbeats.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RrInterval {
    /// The time of the beat that ends the interval [s].
    pub end_secs: f64,
    /// The length of the interval [ms]; NaN unless it lies between normal neighbouring beats.
    pub rr_ms: f64,
}

impl RrInterval {
    /// The intervals between successive beats [s].
    pub fn between(beats_secs: &[f64]) -> Vec<RrInterval> {
        let interval =
            |pair: &[f64]| RrInterval { end_secs: pair[1], rr_ms: (pair[1] - pair[0]) * 1000.0 };
        beats_secs.windows(2).map(interval).collect()
    }

    fn begin_secs(&self) -> f64 {
        self.end_secs - self.rr_ms / 1000.0
    }
}

/// Respiratory sinus arrhythmia from peak to trough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeakToTrough {
    /// Mean over breaths [ms]: `RSA_P2T_Mean`.
    pub mean_ms: f64,
    /// The natural logarithm of the mean [ln ms]: `RSA_P2T_Mean_log`; NaN for 0.
    pub mean_log: f64,
    /// Standard deviation over breaths (n − 1) [ms]: `RSA_P2T_SD`; NaN for one.
    pub sd_ms: f64,
    /// The number of breaths in which the arrhythmia was measured.
    pub breaths: usize,
    /// The number of these breaths in which it was negative, and counts as zero.
    pub without: usize,
    /// The number of breaths in which one phase has no interval: `RSA_P2T_NoRSA`.
    pub unreported: usize,
}

/// How far an interval may extend beyond its phase of the breath [s].
const BEYOND_SECS: f64 = 0.75;

/// Computes the peak-to-trough respiratory sinus arrhythmia from ascending intervals between beats and the breaths of a
/// signal at `rate_hz` that begins at 0 s.
///
/// *What*: for each breath, the longest interval of exhalation minus the shortest of inhalation, over
/// intervals that begin within the phase and end at most 0.75 s after it; negative values count as zero
/// (Grossman et al. 1990, doi:10.1111/j.1469-8986.1990.tb03198.x). *Unit*: ms. *Window*: about ten breaths.
/// *Limits*: grows with slower and deeper breaths: compare at similar breathing; one ectopic beat
/// invalidates its breath, so leave ectopic beats out (NaN). As NeuroKit2's `hrv_rsa`; for a comparison
/// with spectral methods see Lewis et al. (2012), doi:10.1016/j.biopsycho.2011.11.009.
///
/// `None` if it could not be measured in any breath.
pub fn peak_to_trough(
    breaths: &[Breath],
    rate_hz: f64,
    intervals: &[RrInterval],
) -> Option<PeakToTrough> {
    let differences = breaths.iter().map(|breath| difference_ms(breath, rate_hz, intervals));
    let reported: Vec<f64> = differences.flatten().collect();
    let heights: Vec<f64> = reported.iter().map(|each| each.max(0.0)).collect();
    let mean_ms = mean(&heights);
    mean_ms.is_finite().then(|| PeakToTrough {
        mean_ms,
        mean_log: if mean_ms > 0.0 { mean_ms.ln() } else { f64::NAN },
        sd_ms: sample_sd(&heights),
        breaths: reported.len(),
        without: reported.iter().filter(|each| **each < 0.0).count(),
        unreported: breaths.len() - reported.len(),
    })
}

fn difference_ms(breath: &Breath, rate_hz: f64, intervals: &[RrInterval]) -> Option<f64> {
    let [begin, peak, end] = [breath.begin, breath.peak, breath.end].map(|each| each / rate_hz);
    let within = |begin: f64, end: f64| {
        let after = intervals.partition_point(|each| each.end_secs < begin);
        let near =
            intervals[after..].iter().take_while(move |each| each.end_secs < end + BEYOND_SECS);
        let inside = near.filter(move |each| each.begin_secs() >= begin - 1e-9);
        inside.map(|each| each.rr_ms).filter(|rr_ms| rr_ms.is_finite())
    };
    let shortest = within(begin, peak).reduce(f64::min)?;
    let longest = within(peak, end).reduce(f64::max)?;
    Some(longest - shortest)
}
