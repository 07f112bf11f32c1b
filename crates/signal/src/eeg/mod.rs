//! Brain waves from the electroencephalogram (EEG) and measures derived from them: band powers, engagement,
//! workload and asymmetry, the alpha frequency, blinks, and the quality of channels.
//!
//! Spectra use Welch's method with segments of [`SEGMENT_SECS`] that overlap by half, a Hann window and the
//! mean removed, on the samples as measured: the window keeps drift, offset and mains out of the bands, all
//! of which lie between 1 and 45 Hz, whereas a [filter](cleaning) would attenuate frequencies near its
//! cut-off. So a spectrum is the same live and afterwards.
//!
//! ```
//! use std::f64::consts::TAU;
//! use teampulse_signal::eeg::{Band, Powers, alpha_frequency, spectrum};
//!
//! // Alpha of 10 Hz and 20 µV, beta of 20 Hz and 10 µV, on an offset of 800 µV.
//! let wave = |k: u32, hz: f64| (TAU * hz * f64::from(k) / 256.0).sin();
//! let signal: Vec<f64> =
//!     (0..2560).map(|k| 800.0 + 20.0 * wave(k, 10.0) + 10.0 * wave(k, 20.0)).collect();
//! let spectrum = spectrum(&signal, 256.0)?;
//! let powers = Powers::of(&spectrum).expect("the bands have bins");
//! assert!((powers.uv2(Band::Alpha) - 200.0).abs() < 1e-6);
//! assert!((powers.engagement().expect("there is alpha") - 0.25).abs() < 1e-6);
//! assert_eq!(alpha_frequency(&spectrum).expect("there is alpha").peak_hz, Some(10.0));
//! # Ok::<(), teampulse_signal::error::SignalError>(())
//! ```

mod band;
mod indices;
mod cleaning;
mod quality;
mod lines;
mod blinks;
pub mod analysis;
mod known;
mod quantities;
mod pieces;
mod examiner;
mod frontal;
mod site;

use std::ops::RangeInclusive;

use crate::error::{SignalError, checked};
use crate::spectrum::{Spectrum, Welch};

pub use band::{Band, Powers};
pub use blinks::{Blink, BlinkDetector, find_blinks};
pub use cleaning::{clean, cleaning};
pub use indices::{AlphaFrequency, alpha_frequency, asymmetry, slope, workload};
pub use quality::{LEAST_QUALITY, Quality};

/// The length of a spectral segment [s].
pub const SEGMENT_SECS: f64 = 4.0;
/// The supported rates [Hz]: the Nyquist frequency must exceed the highest band.
pub const RATES_HZ: RangeInclusive<f64> = 100.0..=5000.0;

/// The power spectrum of an EEG [µV² / Hz] at 100 to 5000 Hz.
///
/// Welch's method: Hann window, segments of 4 s with 50 % overlap, means removed (`scipy.signal.welch(x, fs,
/// nperseg=4 * fs)`). Welch (1967), doi:10.1109/TAU.1967.1161901. Segments with a sample that is not a
/// [usable number](crate::gaps::is_usable) are left out; returns an error when none is left, or for another
/// rate. A signal shorter than 4 s is one segment.
pub fn spectrum(signal: &[f64], rate_hz: f64) -> Result<Spectrum, SignalError> {
    welch(rate_hz)?.of(signal)
}

fn welch(rate_hz: f64) -> Result<Welch, SignalError> {
    let rate_hz = checked_rate_hz(rate_hz)?;
    Ok(Welch::new(rate_hz, (SEGMENT_SECS * rate_hz).round() as usize))
}

fn checked_rate_hz(rate_hz: f64) -> Result<f64, SignalError> {
    checked("rate", rate_hz, (*RATES_HZ.start(), *RATES_HZ.end()))
}
