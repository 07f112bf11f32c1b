//! A measure in the baseline, and the difference of another value from it.

use teampulse_core::data::Reason;
use teampulse_signal::descriptive::describe;
use teampulse_signal::estimate::Estimate;
use teampulse_signal::robust::SIGMA_FROM_MAD;
use teampulse_signal::statistics::effective_count;

use crate::value::{Value, defined};

/// The minimum number of windows for a spread.
const LEAST_WINDOWS: usize = 3;
/// The windows of a baseline must span nearly two of their lengths: otherwise no two of them are independent.
const LEAST_LENGTHS: f64 = 0.9;

/// The number of windows that must fit side by side into the usable part of a baseline: with fewer
/// their spread is too small, and z against it far too large. A twentieth may be missing, as windows end at whole
/// seconds and some are lost to artefacts.
const WINDOWS_FOR_Z: f64 = 5.0;
const LEAST_FOR_Z: f64 = 0.95 * WINDOWS_FOR_Z;

/// The variances of a median and of 1.4826 median absolute deviations relative to those of a mean and a standard
/// deviation, for normal values: π/2, and 1/0.37 (Rousseeuw & Croux 1993).
const MEDIAN_OVER_MEAN: f64 = std::f64::consts::FRAC_PI_2;
const MAD_OVER_SD: f64 = 1.0 / 0.37;

/// A measure in one window within the baseline.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    /// When the window ends [ns].
    pub(super) end_ns: i64,
    /// The measure, in its unit.
    pub(super) value: f64,
    /// The share of the window with data [0..1].
    pub(super) coverage: f32,
    /// The quality of the data [0..1].
    pub(super) quality: f32,
}

/// A measure in the windows of the baseline, in its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Baseline {
    pub(super) mean: f64,
    /// Standard deviation (n − 1).
    pub(super) sd: f64,
    pub(super) median: f64,
    /// 1.4826 median absolute deviations.
    pub(super) deviation: f64,
    /// The number of windows.
    pub(super) count: usize,
    /// The equivalent number of independent windows: at most as many as would fit side by side, at least 2.
    pub(super) worth: f64,
    /// The time of the baseline that the windows cover [s].
    pub(super) known_secs: f64,
    /// The length of a window [s].
    pub(super) length_secs: f64,
    /// Mean quality of the windows [0..1].
    pub(super) quality: f64,
}

/// The difference of a value from the baseline: in its unit, and in two kinds of standard
/// deviations [1].
pub(super) type Difference = [Value; 3];

impl Baseline {
    /// The baseline from windows of a length [s], in the order of time; `None` for too few.
    pub(super) fn of(held: &[Held], length_secs: f64) -> Option<Baseline> {
        let lengths = secs(held.last()?.end_ns, held.first()?.end_ns) / length_secs;
        if held.len() < LEAST_WINDOWS || lengths.is_nan() || lengths < LEAST_LENGTHS {
            return None;
        }
        let values: Vec<f64> = held.iter().map(|each| each.value).collect();
        let summary = describe(&vec![0.0; values.len()], &values)?;
        let qualities = held.iter().map(|each| f64::from(each.quality));
        Some(Baseline {
            mean: summary.mean,
            sd: summary.sd?,
            median: summary.median,
            deviation: SIGMA_FROM_MAD * summary.mad,
            count: held.len(),
            // Windows that are all equal have no correlation; they count as the least number.
            worth: effective_count(&values).unwrap_or(2.0).min(lengths + 1.0).max(2.0),
            known_secs: known_secs(held, length_secs),
            length_secs,
            quality: qualities.sum::<f64>() / held.len() as f64,
        })
    }

    /// The length of a baseline that z needs [s].
    pub(super) fn needed_secs(&self) -> f64 {
        WINDOWS_FOR_Z * self.length_secs
    }

    /// Whether the baseline is too short for z.
    pub(super) fn is_brief(&self) -> bool {
        self.known_secs < LEAST_FOR_Z * self.length_secs
    }

    /// The difference of a window's value: from the mean, in its unit and in standard deviations,
    /// and from the median in 1.4826 median absolute deviations.
    ///
    /// Sigmas are the baseline's own, with n the equivalent number of windows: SD/√n for the difference, √(1/n + z²/2(n
    /// − 1)) for z (the mean and the SD are uncertain), and for the robust z the same with the variances of a median
    /// and a MAD. There is no z against a baseline that is too short.
    pub(super) fn difference(&self, value: f64) -> Difference {
        let shares = [1.0, 1.0, MEDIAN_OVER_MEAN].map(|factor| factor / self.worth);
        self.differences([value - self.mean, value - self.mean, value - self.median], shares)
    }

    /// The difference of a phase's value, equivalent to this many windows, from that of the baseline
    /// as one phase, in the same units; both are as uncertain as means of their numbers of windows.
    pub(super) fn between(&self, value: f64, baseline: f64, worth: f64) -> Difference {
        let share = 1.0 / self.worth + 1.0 / worth.max(1.0);
        self.differences([value - baseline; 3], [share; 3])
    }

    /// Differences from three centres, each with its share of the variance of a window.
    fn differences(&self, from: [f64; 3], shares: [f64; 3]) -> Difference {
        let z = |place: usize, deviation: f64, of_spread: f64| {
            let z = self.over(from[place], deviation)?;
            let of_deviation = of_spread * z * z / (2.0 * (self.worth - 1.0));
            defined(Some(Estimate { value: z, sigma: (shares[place] + of_deviation).sqrt() }))
        };
        // Windows that are all equal have no known spread.
        let sigma = if self.sd > 0.0 { self.sd * shares[0].sqrt() } else { f64::NAN };
        let in_unit = Estimate { value: from[0], sigma };
        [defined(Some(in_unit)), z(1, self.sd, 1.0), z(2, self.deviation, MAD_OVER_SD)]
    }

    /// A difference in units of a deviation; a rounding error of equal values counts as no difference.
    fn over(&self, difference: f64, deviation: f64) -> Result<f64, Reason> {
        if self.is_brief() {
            return Err(Reason::BriefBaseline);
        }
        let is_spread = deviation > self.mean.abs() * 1e-12;
        if is_spread { Ok(difference / deviation) } else { Err(Reason::Undefined) }
    }
}

/// The time that windows in order of time cover together, without the missing data in them [s].
fn known_secs(held: &[Held], length_secs: f64) -> f64 {
    let mut until_ns = None;
    let known = held.iter().map(|window| {
        let since_secs = until_ns.map_or(f64::INFINITY, |until_ns| secs(window.end_ns, until_ns));
        until_ns = Some(window.end_ns);
        since_secs.clamp(0.0, length_secs) * f64::from(window.coverage).clamp(0.0, 1.0)
    });
    known.sum()
}

/// The time from one point to another [s].
fn secs(to_ns: i64, from_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    fn held(values: &[f64]) -> Vec<Held> {
        let each = |(place, &value): (usize, &f64)| Held {
            end_ns: place as i64 * 1_000_000_000,
            value,
            coverage: 1.0,
            quality: 1.0,
        };
        values.iter().enumerate().map(each).collect()
    }

    fn baseline(values: &[f64]) -> Baseline {
        Baseline::of(&held(values), 1.0).unwrap()
    }

    /// Whether windows of 30 s, one every second, give a z for a baseline of a length.
    fn has_z(secs: i64, coverage: impl Fn(i64) -> f32) -> bool {
        let window = |end: i64| Held {
            end_ns: end * 1_000_000_000,
            value: (end * 37 % 11) as f64,
            coverage: coverage(end),
            quality: 1.0,
        };
        let held: Vec<Held> = (30..=secs).map(window).collect();
        let [difference, z, robust_z] = Baseline::of(&held, 30.0).unwrap().difference(20.0);
        assert!(difference.is_ok() && z.is_ok() == robust_z.is_ok());
        assert!(z.is_ok() || z == Err(Reason::BriefBaseline));
        z.is_ok()
    }

    #[test]
    fn z_needs_five_windows_side_by_side_and_a_difference_does_not() {
        assert_eq!(
            [60, 120, 140, 150, 300].map(|secs| has_z(secs, |_| 1.0)),
            [false, false, false, true, true]
        );
    }

    #[test]
    fn gaps_shorten_a_baseline_by_their_length() {
        // Each missing second is missing in thirty windows.
        let gap_secs = |lasts: i64| {
            move |end: i64| {
                1.0 - (end.min(60 + lasts) - (end - 30).max(60)).clamp(0, lasts) as f32 / 30.0
            }
        };
        assert!(has_z(150, gap_secs(5)) && !has_z(150, gap_secs(14)) && has_z(180, gap_secs(14)));
    }

    #[test]
    fn differences_are_those_of_the_statistics_of_a_baseline() {
        use teampulse_signal::statistics::baseline_change;
        let values = [66.0, 70.0, 74.0, 69.0, 71.5];
        let change = baseline_change(&[80.0, 80.0], &values).unwrap();
        let [difference, z, robust] =
            baseline(&values).difference(80.0).map(|value| value.unwrap().value);
        assert_eq!(difference, change.mean_difference);
        assert_eq!((Some(z), Some(robust)), (change.z, change.robust_z));
    }

    #[test]
    fn equal_windows_have_a_difference_but_no_z() {
        let difference = baseline(&[5.0; 10]).difference(6.0);
        assert!(
            difference[0]
                .is_ok_and(|difference| difference.value == 1.0 && difference.sigma.is_nan())
        );
        assert_eq!(difference[1..], [Err(Reason::Undefined); 2]);
    }

    #[test]
    fn windows_that_all_overlap_are_no_baseline() {
        assert_eq!(Baseline::of(&held(&[1.0, 2.0, 3.0, 4.0]), 30.0), None);
        assert_eq!(Baseline::of(&held(&[1.0, 2.0]), 1.0), None);
        assert_eq!(Baseline::of(&[], 1.0), None);
    }

    #[test]
    fn windows_count_as_no_more_than_fit_side_by_side() {
        let wild: Vec<f64> = (0..61).map(|k| f64::from(k * 37 % 11)).collect();
        assert_eq!(Baseline::of(&held(&wild), 20.0).unwrap().worth, 4.0);
    }

    #[test]
    fn overlapping_windows_make_a_baseline_less_certain() {
        let wild: Vec<f64> = (0..60).map(|k| f64::from(k * 37 % 11)).collect();
        let mut drifting = wild.clone();
        drifting.sort_by(f64::total_cmp);
        let sigma = |values: &[f64]| baseline(values).difference(20.0)[1].unwrap().sigma;
        assert!(sigma(&drifting) > 3.0 * sigma(&wild));
    }
}
