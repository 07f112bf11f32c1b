//! Breathing: from a belt, a thermistor or an impedance, and derived from heartbeats and pulses.
//!
//! A breath lasts from one trough of the signal (the onset of inhalation) to the next, with the peak (the
//! onset of exhalation) between them; for a thermistor, which falls with inhalation, invert the signal.
//! Troughs and peaks are the points where the signal turns by more than a share of its usual range,
//! regardless of its level: slow drift does not hide them, and ripples during a pause do not count. A pause
//! between breaths belongs to the exhalation before it.
//!
//! ```
//! use std::f64::consts::TAU;
//! use teampulse_signal::respiration::{BreathDetector, Pattern, find_breaths};
//!
//! // 15 breaths a minute on a belt that slips.
//! let rate_hz = 50.0;
//! let belt: Vec<f64> =
//!     (0..3000).map(|k| f64::from(k) / rate_hz).map(|t| 0.1 * t - (TAU * 0.25 * t).cos()).collect();
//! let breaths = find_breaths(&belt, rate_hz)?;
//! let pattern = Pattern::of(&breaths, rate_hz, 0.0..3000.0).expect("there are breaths");
//! assert!((pattern.rate_mean_per_min - 15.0).abs() < 0.1);
//!
//! let mut detector = BreathDetector::new(rate_hz)?;
//! let causal: Vec<_> = belt.iter().filter_map(|&sample| detector.push(sample)).collect();
//! assert!(causal.len() + 4 > breaths.len());
//! # Ok::<(), teampulse_signal::error::SignalError>(())
//! ```

mod band;
mod breath;
mod causal;
mod whole;
mod scale;
mod turns;
mod onset;
mod history;
mod grouping;
mod pattern;
mod variability;
mod phase;
mod quality;
mod recurrence;
mod spectral;
mod rival;
mod cusps;
mod uncounted;
mod extra;
mod pulsation;
pub mod rsa;
pub mod derived;
pub mod analysis;

pub use band::{RATES_HZ, band, clean};
pub use breath::Breath;
pub use causal::BreathDetector;
pub use pattern::Pattern;
pub use phase::{Phase, phase_at};
pub use quality::quality;
pub use spectral::spectral_rate_per_min;
pub use variability::{Variability, variability};
pub use whole::find_breaths;
