use super::measure::Measure;
use super::series::present;
use crate::moments::{mean, sample_sd};

/// The minimum share of a segment that its intervals must cover.
const LEAST_SHARE: f64 = 0.5;

/// Variability between segments of equal length, and within them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segments {
    /// The number of segments.
    pub n: usize,
    /// Standard deviation (n − 1) of the segments' mean intervals [ms].
    pub sdann_ms: f64,
    /// Mean of the segments' standard deviations (n − 1) [ms].
    pub sdnni_ms: f64,
}

/// SDANN and SDNNI of intervals [ms] that end at `ends_secs` [s, ascending], in segments of
/// `segment_secs` [s] that begin at 0.
///
/// Task Force (1996), doi:10.1161/01.CIR.93.5.1043: segments of 300 s in 24 hours; NeuroKit2 also has 60
/// and 120 s. An interval belongs to the segment in which it ends; a segment counts if intervals cover half
/// of it. NeuroKit2 leaves out the last interval of each segment and requires three. `None` with fewer than
/// two segments.
///
/// ```
/// use teampulse_signal::hrv::segments;
/// // A minute at 60 beats a minute, and one at 75.
/// let slow = (1..60).map(|k| (f64::from(k), 1000.0));
/// let fast = (0..75).map(|k| (60.0 + 0.8 * f64::from(k), 800.0));
/// let (ends_secs, intervals_ms): (Vec<f64>, Vec<f64>) = slow.chain(fast).unzip();
/// let segments = segments(&ends_secs, &intervals_ms, 60.0).expect("there are two");
/// assert_eq!(segments.sdnni_ms, 0.0);
/// assert_eq!(segments.sdann_ms, 20_000f64.sqrt());
/// ```
pub fn segments(ends_secs: &[f64], intervals_ms: &[f64], segment_secs: f64) -> Option<Segments> {
    let timed = ends_secs.iter().zip(intervals_ms).filter(|(end, _)| end.is_finite());
    let placed: Vec<(f64, f64)> =
        timed.map(|(end, interval)| ((end / segment_secs).floor(), *interval)).collect();
    let (mut means, mut deviations) = (Vec::new(), Vec::new());
    for segment in placed.chunk_by(|a, b| a.0.total_cmp(&b.0).is_eq()) {
        let nn = present(&segment.iter().map(|each| each.1).collect::<Vec<_>>());
        if nn.len() > 1 && nn.iter().sum::<f64>() >= LEAST_SHARE * 1000.0 * segment_secs {
            means.push(mean(&nn));
            deviations.push(sample_sd(&nn));
        }
    }
    let (n, sdann_ms, sdnni_ms) = (means.len(), sample_sd(&means), mean(&deviations));
    (sdann_ms.is_finite() && sdnni_ms.is_finite()).then_some(Segments { n, sdann_ms, sdnni_ms })
}

/// SDANN and SDNNI by name, in segments of 1, 2 and 5 minutes; NaN with fewer than two segments.
pub(super) fn measures(ends_secs: &[f64], intervals_ms: &[f64]) -> Vec<Measure> {
    let of = |segment_secs: f64| {
        let segments = segments(ends_secs, intervals_ms, segment_secs);
        segments.map_or((f64::NAN, f64::NAN), |each| (each.sdann_ms, each.sdnni_ms))
    };
    let [one, two, five] = [of(60.0), of(120.0), of(300.0)];
    Measure::all([
        ("HRV_SDANN1", "ms", one.0),
        ("HRV_SDNNI1", "ms", one.1),
        ("HRV_SDANN2", "ms", two.0),
        ("HRV_SDNNI2", "ms", two.1),
        ("HRV_SDANN5", "ms", five.0),
        ("HRV_SDNNI5", "ms", five.1),
    ])
}
