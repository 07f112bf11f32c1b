//! The values of an ECG in a span, in order.

use std::borrow::Cow;

use crate::analysis::Value;

/// Name, unit and recipe of each value.
const ALL: [(&str, &str, &str); 13] = [
    (
        "ECG_Rate_Mean",
        "bpm",
        "60 s · number of RR intervals within the span / their sum; intervals above 15 s left out, above 3 s where the signal is not as quiet as between beats, and with more than 0.1 s missing in a row (0.02 s if longer than 1.4 usual ones), {}",
    ),
    ("ECG_Rate_Min", "bpm", "60 s / longest of these RR intervals, {}"),
    ("ECG_Rate_Max", "bpm", "60 s / shortest of these RR intervals, {}"),
    ("ECG_Rate_SD", "bpm", "standard deviation (n − 1) of 60 s / RR of these intervals, {}"),
    (
        "ECG_RSP_Rate",
        "1/min",
        "common rhythm of RR intervals and QRS heights in stretches of 30 s (respiration::derived::rate_from_beats), {}",
    ),
    (
        "ECG_Quality",
        "1",
        "probability that the mean rate is within 10 %: 0.03, 0.93 and 0.99 at a signal quality of 0.03, 0.06 and 1, linear between, and at most what these leave: deflections between beats that are as large as beats or of their form, intervals twice as long as others or near a multiple of the median, odd intervals of unlike beats, saturation, unless they are few and the mean of 15 intervals or more is within 7 % of the median; pauses of a clear signal; few intervals; beats as uneven as steps (ecg/doubt.rs); between 0.6 and 0.79 the slopes of beats and of what lies between them, and the noise where there are none, may settle it as 0.93 or 0.05 (ecg/settle.rs); beats of two rhythms that come at any time of each other leave 0.5 (ecg/company.rs); signal quality: likeness / (1 + (between / 0.18)³); likeness: mean over beats of 2⟨a, b⟩ / (⟨a, a⟩ + ⟨b, b⟩) with the third-likest of the 8 before (0.1 s before to 0.15 s after, clean, without the line that fits best); between: median |clean|, median of pieces of 4 s, over the median height of beats; {}",
    ),
    (
        "ECG_kSQI",
        "1",
        "kurtosis (normal: 3) of the clean signal (0.5 Hz high-pass of order 2, notch at the mains), median over pieces of 4 s",
    ),
    (
        "ECG_pSQI",
        "1",
        "power(5–15 Hz) / power(5–40 Hz), pieces of 4 s each 2 s, Hann, without the mean, median",
    ),
    (
        "ECG_basSQI",
        "1",
        "power(0–1 Hz) / power(0–40 Hz), pieces of 4 s each 2 s, Hann, without the mean, median",
    ),
    (
        "ECG_Flat",
        "1",
        "share of samples that stay exactly the same for more than 0.2 s, mean over pieces of 4 s",
    ),
    (
        "ECG_Saturated",
        "1",
        "share of samples that stay at the highest or lowest value so far for more than 0.03 s, mean over pieces of 4 s",
    ),
    (
        "ECG_Motion",
        "1",
        "share of pieces of 4 s whose clean range exceeds 2.5 times that of the median of the 8 before, or with more than 0.8 of their power at 0–1 Hz",
    ),
    ("ECG_LeadOff", "1", "share of the span in stretches of more than 3 s without a beat, {}"),
];

/// The number of values that describe beats; they come first.
pub(super) const OF_BEATS: usize = 5;

/// All values but heart rate variability; `how` states how beats were detected.
pub(super) fn of_signal(how: &'static str) -> Vec<Value> {
    let value = |&(name, unit, method): &(&'static str, &'static str, &'static str)| {
        let beats = format!("beats found {how}");
        let method = if method.contains("{}") {
            Cow::Owned(method.replace("{}", &beats))
        } else {
            Cow::Borrowed(method)
        };
        Value { name: Cow::Borrowed(name), unit: Cow::Borrowed(unit), method }
    };
    ALL.iter().map(value).collect()
}
