//! Respiratory rate variability.

use super::Breath;
use crate::hrv::{poincare, time_domain};

/// Variability of the intervals between breaths, with the names of NeuroKit2's `rsp_rrv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variability {
    /// Root mean square of successive differences [ms].
    pub rmssd_ms: f64,
    /// Mean interval [ms].
    pub mean_bb_ms: f64,
    /// Standard deviation of intervals (n − 1) [ms].
    pub sdbb_ms: f64,
    /// Standard deviation of successive differences (n − 1) [ms].
    pub sdsd_ms: f64,
    /// SDBB over mean interval.
    pub cvbb: f64,
    /// RMSSD over mean interval.
    pub cvsd: f64,
    /// Median interval [ms].
    pub median_bb_ms: f64,
    /// Median absolute deviation times 1.4826 [ms].
    pub mad_bb_ms: f64,
    /// `mad_bb_ms` over the median interval.
    pub mcvbb: f64,
    /// Standard deviation across the line of identity of the Poincaré plot [ms]: breath-to-breath
    /// variability.
    pub sd1_ms: f64,
    /// Standard deviation along the line of identity [ms]: slower variability.
    pub sd2_ms: f64,
    /// SD2 over SD1.
    pub sd2_sd1: f64,
}

/// Computes the variability of ascending breaths of a signal at `rate_hz`, from trough to trough.
///
/// The formulas of [`hrv`](crate::hrv), with breaths in place of beats, after Soni and Muniyandi (2019),
/// Int J Yoga 12:45. Window: 5 minutes by convention; a minute has too few breaths for more than a rough
/// value. `None` with fewer than three breaths. No difference is taken across a gap between breaths.
/// Limits: a missed breath doubles an interval.
pub fn variability(breaths: &[Breath], rate_hz: f64) -> Option<Variability> {
    let intervals_ms = intervals_ms(breaths, rate_hz);
    let (time, ellipse) = (time_domain(&intervals_ms)?, poincare(&intervals_ms)?);
    Some(Variability {
        rmssd_ms: time.rmssd_ms,
        mean_bb_ms: time.mean_nn_ms,
        sdbb_ms: time.sdnn_ms,
        sdsd_ms: time.sdsd_ms,
        cvbb: time.cvnn,
        cvsd: time.cvsd,
        median_bb_ms: time.median_nn_ms,
        mad_bb_ms: time.mad_nn_ms,
        mcvbb: time.mcv_nn,
        sd1_ms: ellipse.sd1_ms,
        sd2_ms: ellipse.sd2_ms,
        sd2_sd1: ellipse.csi,
    })
}

/// Durations, with NaN between breaths that are not successive.
fn intervals_ms(breaths: &[Breath], rate_hz: f64) -> Vec<f64> {
    let mut intervals_ms = Vec::with_capacity(breaths.len());
    let mut end = None;
    for breath in breaths {
        if end.is_some_and(|end: f64| (breath.begin - end).abs() > 1e-6) {
            intervals_ms.push(f64::NAN);
        }
        intervals_ms.push(breath.duration() / rate_hz * 1000.0);
        end = Some(breath.end);
    }
    intervals_ms
}

#[cfg(test)]
mod tests {
    use super::*;

    fn breaths(durations_secs: &[f64]) -> Vec<Breath> {
        let mut end = 0.0;
        let next = |secs: &f64| {
            let begin = end;
            end += secs * 10.0;
            Breath { begin, peak: begin + 1.0, end, amplitude: 1.0 }
        };
        durations_secs.iter().map(next).collect()
    }

    #[test]
    fn intervals_are_those_of_the_formulas() {
        let found = variability(&breaths(&[4.0, 5.0, 3.0, 4.0]), 10.0).unwrap();
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert!(near(found.mean_bb_ms, 4000.0) && near(found.median_bb_ms, 4000.0));
        assert!(near(found.sdbb_ms, (2e6f64 / 3.0).sqrt()) && near(found.rmssd_ms, 2e6f64.sqrt()));
    }

    #[test]
    fn no_difference_is_taken_across_a_gap() {
        let mut all = breaths(&[4.0, 4.5, 4.0, 9.0, 8.0, 8.5, 8.0]);
        all.remove(3);
        // 0.5 s four times; 4 s from one side of the gap to the other.
        let found = variability(&all, 10.0).unwrap();
        assert!((found.rmssd_ms - 500.0).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn two_breaths_are_too_few() {
        assert_eq!(variability(&breaths(&[4.0, 5.0]), 10.0), None);
        assert_eq!(variability(&breaths(&[4.0, 5.0, 6.0]), f64::NAN), None);
    }
}
