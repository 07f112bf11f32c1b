//! How a body part moves, from an accelerometer of three axes.
//!
//! ```
//! use teampulse_signal::acceleration::{Motion, Unit, enmo_g, magnitude, tilt_deg};
//!
//! // A wristband at 32 Hz, in steps of 1/64 g, lying still and then shaken.
//! let unit = Unit::StepsPerG(64.0);
//! let mut motion = Motion::new(32.0, 0.1)?;
//! let shaken = |k: u32| f64::from(k) / 64.0 + (f64::from(k) * 0.9).sin();
//! let mut levels = (0..128u32).map(|k| {
//!     let z = if k < 64 { 64.0 } else { 64.0 + 40.0 * shaken(k) };
//!     motion.push(unit.in_g([0.0, 0.0, z]))
//! });
//! assert!(levels.nth(63).is_some_and(|still| !still.is_artefact));
//! assert!(levels.last().is_some_and(|shaken| shaken.is_artefact && shaken.level_g > 0.2));
//!
//! assert_eq!(magnitude([0.0, 3.0, 4.0]), 5.0);
//! assert_eq!(enmo_g(&[1.2, 0.9, 1.0]), Some(0.2 / 3.0 * 0.9999999999999998));
//! assert_eq!(tilt_deg([1.0, 0.0, 0.0]), Some(90.0));
//! # Ok::<(), teampulse_signal::error::SignalError>(())
//! ```

mod unit;
mod magnitude;
mod tilt;
mod activity;
mod motion;
mod faults;
pub mod analysis;

pub use activity::{Counts, activity_band, counts_of};
pub use faults::{Fault, Faults};
pub use magnitude::{enmo_g, magnitude, mean_amplitude_deviation_g};
pub use motion::{Motion, Moved};
pub use tilt::tilt_deg;
pub use unit::{RATES_HZ, Unit};
