//! Notch filters.

use std::f64::consts::PI;

use super::butterworth::checked_frequency;
use super::{Design, Section};
use crate::error::{SignalError, checked, checked_rate_hz};

/// A notch at `frequency_hz` with a −3 dB width of `frequency_hz` / `quality`.
///
/// For mains hum. SciPy's `iirnotch`; Orfanidis, Introduction to Signal Processing (1996), section 11.3.
/// `quality` is between 0.5 and 10,000 (typically 30). It rings for about `quality` / `frequency_hz` seconds
/// after a step. Returns an error for a frequency outside 0..`rate_hz` / 2.
pub fn notch(frequency_hz: f64, quality: f64, rate_hz: f64) -> Result<Design, SignalError> {
    let rate_hz = checked_rate_hz(rate_hz)?;
    let quality = checked("quality", quality, (0.5, 10_000.0))?;
    let fraction = 2.0 * checked_frequency(frequency_hz, rate_hz)? / rate_hz;
    let beta = (PI * fraction / quality / 2.0).tan();
    let gain = 1.0 / (1.0 + beta);
    let middle = -2.0 * gain * (PI * fraction).cos();
    let section = Section { b: [gain, middle, gain], a: [middle, 2.0 * gain - 1.0] };
    Design::new(vec![section], rate_hz)
}
