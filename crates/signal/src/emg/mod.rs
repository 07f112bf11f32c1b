//! Muscle activity from the surface electromyogram (EMG), causal and of whole recordings.
//!
//! The signal is band-passed from 20 Hz to 450 Hz (or 95 % of the Nyquist frequency): motion of skin and cables lies
//! below this band, noise above it (De Luca et al. 2010, doi:10.1016/j.jbiomech.2010.01.027). Rates from 100 Hz (a
//! wristband has 200) to 10 kHz.
//!
//! ```
//! use teampulse_signal::emg::{Frames, clean, find_bursts};
//!
//! // Ten seconds; the sixth and the seventh are ten times as loud.
//! let rate_hz = 1000.0;
//! let noise = |k: u32| f64::from((k * k % 977) * 31 % 1009) / 1009.0 - 0.5;
//! let loud = |k: u32| if (5000..7000).contains(&k) { 1.0 } else { 0.1 };
//! let signal: Vec<f64> = (0..10_000).map(|k| loud(k) * noise(k)).collect();
//!
//! let bursts = find_bursts(&signal, rate_hz)?;
//! assert_eq!(bursts.len(), 1);
//! assert!((bursts[0].onset / rate_hz - 5.0).abs() < 0.1);
//!
//! let mut frames = Frames::new(rate_hz, 0.25, 0.125)?;
//! let features = frames.of(&clean(&signal, rate_hz)?);
//! let rms = |index: usize| features[index].map_or(0.0, |features| features.rms);
//! assert!((8.0..12.0).contains(&(rms(45) / rms(10))));
//! # Ok::<(), teampulse_signal::error::SignalError>(())
//! ```

mod band;
mod amplitude;
mod frequency;
mod comb;
mod frames;
mod cocontraction;
mod burst;
mod rest;
mod faults;
pub mod analysis;
mod channel;
mod store;
mod values;

pub use amplitude::Thresholds;
pub use band::{Cleaner, RATES_HZ, band, clean, envelope, envelope_filter};
pub use burst::{Burst, BurstDetector, BurstSettings, find_bursts};
pub use cocontraction::cocontraction;
pub use faults::{Faults, quality};
pub use frames::{Features, Frames};
