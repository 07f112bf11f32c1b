//! Breathing rate derived from the beats of an ECG or the pulses of a PPG.
//!
//! Breathing rotates the heart's electrical axis and changes the volume of the chest (amplitudes), modulates the heart
//! rate (intervals), and shifts blood (baseline). Each of these modulations is sampled once per beat. A rhythm that
//! they have in common is breathing; a rhythm that only one modulation has may have another cause: blood pressure waves
//! at about 6 per minute also appear in intervals.
//!
//! ```
//! use std::f64::consts::TAU;
//! use teampulse_signal::respiration::derived::rate_from_beats;
//!
//! // 70 beats a minute; 15 breaths a minute move their intervals and amplitudes.
//! let breath = |secs: f64| (TAU * 15.0 / 60.0 * secs).sin();
//! let times_secs: Vec<f64> = (0..69).map(|k| 0.857 * f64::from(k)).map(|t| t + 0.03 * breath(t)).collect();
//! let amplitudes: Vec<f64> = times_secs.iter().map(|&t| 1.0 + 0.1 * breath(t)).collect();
//! let derived = rate_from_beats(&times_secs, &amplitudes, 0.0..60.0)?;
//! assert!((derived.rate_per_min.value - 15.0).abs() < 0.5);
//! assert!(derived.rate_per_min.sigma < 1.0);
//! # Ok::<(), teampulse_signal::analysis::Reason>(())
//! ```

mod grid;
mod modulation;
mod fusion;
mod kept;
mod window;

use std::ops::Range;

pub(crate) use modulation::Beat;
pub(crate) use window::BreathingWindows;

use crate::analysis::{Reason, Span};
use crate::estimate::Estimate;

/// A breathing rate derived from beats or pulses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Derived {
    /// Breaths a minute [1/min].
    pub rate_per_min: Estimate,
    /// How clearly the modulations agree on one rhythm [0..1]: the share of their common spectrum around its
    /// peak, averaged over segments, times the share of segments with a result.
    pub clarity: f64,
}

/// Derives the breathing rate from the beats of an ECG within a window [s].
///
/// - *What*: the common rhythm of the intervals between beats (respiratory sinus arrhythmia) and of their
///   amplitudes [any unit]: the height of R above S, or the strength of the QRS complex
///   ([`Beat::strength`](crate::ecg::Beat)). Heights above the baseline alone show far less of it.
/// - *Formula*: in segments of 30 s with 50 % overlap, each from the beats within it alone: each modulation
///   without outliers (4 · 1.4826 · MAD), linearly detrended, under a Hann window; its power from 4 a
///   minute up to 45 or 0.47 of the heart rate, multiplied by frequency (against the slow waves that all of
///   them have); the product of the modulations' shares, each with a floor of a tenth of the mean; the rate
///   at the maximum of the product, and as its uncertainty the root mean square distance of the squared
///   product from it. A segment counts if 80 % of the product lie within 1.5 / 30 s of the peak and its
///   uncertainty is below 2 a minute; a window if half of its segments do, with their median.
/// - *Window*: at least 30 s.
/// - *Reference*: fusion of modulations after Karlen et al. (2013), doi:10.1109/TBME.2013.2246160;
///   segments and limits of the method: Charlton et al. (2016), doi:10.1088/0967-3334/37/4/610.
/// - *Limits*: breaths faster than about half the heart rate look as much slower than half of it as they are faster; so
///   a segment does not count if breathing below 34 a minute would look the same (22 a minute at a heart rate of 50 may
///   be 28); pauses count as breaths; a rate that changes within 30 s is represented by its most frequent value.
///   Without any rhythm, one in six segments of 30 s shows one by chance, and one in a hundred windows of 60 s.
///   Premature beats are left out, but with bigeminy the method fails.
///
/// Times that are out of order are left out; missing amplitudes are NaN. The reason is `Short` for a short
/// window, `Missing` without amplitudes, `Gap` when beats cover less than half of the window, and `Quality`
/// without a common rhythm.
pub fn rate_from_beats(
    times_secs: &[f64],
    amplitudes: &[f64],
    window_secs: Range<f64>,
) -> Result<Derived, Reason> {
    rate(times_secs, [amplitudes, &[]], window_secs)
}

/// Derives the breathing rate from the pulses of a PPG within a window [s].
///
/// Works like [`rate_from_beats`], with three modulations: the intervals between pulses, their `amplitudes` (foot to
/// peak) and their `baselines` (the height of the foot, or of the middle), in any unit. `Missing` without both
/// amplitudes and baselines. Karlen et al. (2013), doi:10.1109/TBME.2013.2246160, reject the rate if the three differ
/// by more than 4 a minute; here the uncertainty is used instead.
pub fn rate_from_pulses(
    times_secs: &[f64],
    amplitudes: &[f64],
    baselines: &[f64],
    window_secs: Range<f64>,
) -> Result<Derived, Reason> {
    rate(times_secs, [amplitudes, baselines], window_secs)
}

fn rate(times_secs: &[f64], heights: [&[f64]; 2], window: Range<f64>) -> Result<Derived, Reason> {
    let length_secs = window.end - window.start;
    // This also rejects NaN.
    if !length_secs.is_finite() {
        return Err(Reason::Short);
    }
    let beat = |(place, secs): (usize, &f64)| Beat {
        at_ns: nanos(secs - window.start),
        heights: heights.map(|heights| heights.get(place).copied().unwrap_or(f64::NAN)),
    };
    let beats = times_secs.iter().enumerate().map(beat);
    let span = Span { begin_ns: 0, end_ns: nanos(length_secs) };
    BreathingWindows::default().measure(beats, span)
}

/// Converts a time to nanoseconds; NaN comes before all other times.
fn nanos(secs: f64) -> i64 {
    if secs.is_nan() { i64::MIN } else { (secs * 1e9).round() as i64 }
}
