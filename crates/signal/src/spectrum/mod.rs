//! Power spectra: the distribution of a signal's power over frequency.
//!
//! ```
//! use std::f64::consts::TAU;
//! use teampulse_signal::spectrum::{Rule, Welch};
//!
//! // 10 Hz with an amplitude of 2: its power is 2² / 2.
//! let alpha: Vec<f64> = (0..2560).map(|k| 2.0 * (TAU * 10.0 * f64::from(k) / 256.0).sin()).collect();
//! let spectrum = Welch::new(256.0, 512).of(&alpha)?;
//! assert!((spectrum.band_power(8.0, 13.0, Rule::Trapezoid).unwrap() - 2.0).abs() < 1e-3);
//! assert_eq!(spectrum.peak(1.0, 40.0).unwrap().frequency_hz, 10.0);
//! # Ok::<(), teampulse_signal::error::SignalError>(())
//! ```

mod band_power;
mod taper;
mod detrend;
mod welch;
mod transforms;
mod lomb_scargle;

pub use band_power::{Peak, Rule, Spectrum};
pub use detrend::Detrend;
pub use lomb_scargle::{LombScargle, Mean, Normalisation};
pub use taper::Taper;
pub(crate) use transforms::Transforms;
pub(crate) use welch::Transform;
pub use welch::{Average, Scaling, Welch};
