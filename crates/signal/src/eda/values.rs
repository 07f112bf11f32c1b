//! Names, units and recipes of the values.

use std::borrow::Cow;

use super::Threshold;
use super::analysis::{Phasic, Settings};
use crate::analysis::Value;

/// Names and units in the order of the values.
const VALUES: [(&str, &str, &str); 12] = [
    ("EDA_Tonic_Mean", "µS", "mean of the tonic part"),
    ("EDA_Tonic_SD", "µS", "standard deviation of the tonic part, over n"),
    ("EDA_Tonic_Slope", "µS/min", "slope of the least-squares line through the tonic part"),
    ("SCR_Peaks_N", "1", "responses with their peak in the window"),
    ("SCR_Peaks_Rate", "1/min", "responses with their peak in the window, over its length"),
    (
        "SCR_Peaks_Amplitude_Mean",
        "µS",
        "mean amplitude: the phasic part at the peak above the recovery, extrapolated, of the response before",
    ),
    (
        "SCR_Peaks_Amplitude_Sum",
        "µS",
        "sum of amplitudes, each above the recovery, extrapolated, of the response before",
    ),
    ("SCR_RiseTime_Mean", "s", "mean time from onset to peak"),
    (
        "SCR_RecoveryTime_Mean",
        "s",
        "mean time from peak to half of the amplitude, over responses that reach it in the window",
    ),
    ("EDA_Phasic_AUC", "µS·s", "integral of the phasic part where it is above zero"),
    ("EDA_Sympathetic", "µS²", SYMPATHETIC),
    ("EDA_SympatheticN", "1", SYMPATHETIC_SHARE),
];

/// The number of values.
pub(super) const COUNT: usize = VALUES.len();

const SYMPATHETIC: &str = "power 0.045-0.25 Hz of the clean signal: low-pass 0.8 Hz, 2 to 4 Hz, Welch 64 s, Blackman, \
     50 % overlap, linearly detrended, trapezoids between bins";
const SYMPATHETIC_SHARE: &str = "EDA_Sympathetic over the power up to 0.8 Hz";

/// The values of a whole recording.
pub(super) fn of_whole(settings: &Settings) -> Vec<Value> {
    let split = match settings.phasic {
        Phasic::HighPass => {
            "zero-phase Butterworth of order 2 at 0.05 Hz, tonic below and phasic above, after low-pass 3 Hz"
        }
        Phasic::CvxEda => {
            "cvxEDA (tau 0.7 and 2 s, knots every 10 s, alpha 8e-4, gamma 1e-2) at 4 to 8 Hz"
        }
    };
    let threshold = match settings.threshold {
        Threshold::Absolute(least_us) => format!("of at least {least_us} µS"),
        Threshold::Relative(share) => {
            format!("at least {share} times as prominent as the most prominent one")
        }
    };
    values(split, &threshold)
}

/// The values of a causal analysis.
pub(super) fn of_causal(threshold_us: f64) -> Vec<Value> {
    let split = "causal Butterworth high-pass of order 2 at 0.01 Hz, the rest is tonic, after low-pass 3 Hz";
    values(split, &format!("of at least {threshold_us} µS, reported 1.1 s after their peaks"))
}

fn values(split: &str, threshold: &str) -> Vec<Value> {
    let method = |name: &str, recipe: &'static str| -> Cow<'static, str> {
        if recipe == SYMPATHETIC || recipe == SYMPATHETIC_SHARE {
            Cow::Borrowed(recipe)
        } else if name.starts_with("SCR") {
            format!("{recipe}; responses {threshold}; {split}").into()
        } else {
            format!("{recipe}; {split}").into()
        }
    };
    let value = |&(name, unit, recipe): &(&'static str, &'static str, &'static str)| Value {
        name: name.into(),
        unit: unit.into(),
        method: method(name, recipe),
    };
    VALUES.iter().map(value).collect()
}
