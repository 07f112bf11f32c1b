//! The values of a span, except for pulse rate variability.

use std::borrow::Cow;

use crate::analysis::Value;

/// Name, unit (`=` is that of the signal) and recipe: of pulses, then of the signal.
const TABLE: [(&str, &str, &str); 14] = [
    (
        "PPG_Rate_Mean",
        "1/min",
        "60 over the mean interval between systolic peaks of neighbouring good cycles",
    ),
    (
        "PPG_Rate_SD",
        "1/min",
        "standard deviation (n - 1) of 60 over each interval between peaks of good cycles",
    ),
    ("PPG_PP_Mean", "ms", "mean interval between systolic peaks of neighbouring good cycles"),
    (
        "PPG_Amplitude_Mean",
        "=",
        "PWA: peak minus lowest point of the rise, smoothed (Savitzky-Golay, 2nd order, 60 ms to either side); mean of good cycles",
    ),
    ("PPG_Amplitude_SD", "=", "standard deviation (n - 1) of PWA of good cycles"),
    (
        "PPG_RiseTime_Mean",
        "ms",
        "from the onset (tangent of the steepest rise at the level of the lowest point) to the peak; mean of good cycles",
    ),
    ("PPG_Width_Mean", "ms", "time above half of the amplitude; mean of good cycles"),
    (
        "PPG_Perfusion",
        "%",
        "AC/DC: 100 times the median PWA of good cycles over the mean of the signal in whole pieces of 5 s; none above 20 %, where the device leaves out DC",
    ),
    (
        "PPG_RSP_Rate",
        "1/min",
        "breathing: the common rhythm of intervals, amplitudes and baselines of good cycles (fusion after Karlen 2013, in stretches of 30 s)",
    ),
    ("PPG_Peaks_N", "1", "pulses of good cycles"),
    (
        "PPG_Quality",
        "1",
        "probability that the rate is within 10 %: 0.98 unless there is evidence against it (0.79), such as broad waves that may be footsteps, a residual beside the mean cycle, slow pulses of which every second one may be missed, odd intervals; strong evidence (0.275), such as a late second crest; or no pulse at all (0.05) (ppg/doubt.rs)",
    ),
    ("PPG_Flagged", "1", "share of the span without a cycle of quality 0.8 or more"),
    ("PPG_Flat", "1", "share of samples that are missing or constant for more than 0.2 s"),
    (
        "PPG_Skewness",
        "1",
        "skewness of the smoothed signal, median of the whole pieces of 5 s, counted from the first sample, without trend",
    ),
];

/// The values of a signal in some unit; `how` states the method, whole or causal.
pub(super) fn of_signal(how: &'static str, unit: &str) -> Vec<Value> {
    let value = |&(name, of, recipe): &(&'static str, &'static str, &'static str)| Value {
        unit: if of == "=" { Cow::Owned(unit.to_owned()) } else { Cow::Borrowed(of) },
        ..Value::of_channel(name, "", "1", format!("{recipe}; pulses: {how}"))
    };
    TABLE.iter().map(value).collect()
}
