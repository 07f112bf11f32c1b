//! Pulse waves from the photoplethysmogram (PPG, blood volume pulse), causal and of whole recordings.
//!
//! Pulses are detected with two moving averages of the squared, band-passed signal (Elgendi et al. 2013,
//! doi:10.1371/journal.pone.0076585), which needs no threshold in the unit of the signal. This implementation
//! differs in three ways: the detector's offset follows the signal instead of being constant over the
//! recording; of two maxima that are too close, and of a pulse and its likely diastolic wave, the lower is
//! dropped; and each pulse is placed at the maximum of the signal itself, with subsample resolution, not of
//! the filtered signal. Rates above 200 Hz are first averaged down to between 100 and 200 Hz.
//!
//! ```
//! use teampulse_signal::ppg::{PulseDetector, find_pulses};
//!
//! let rate_hz = 64.0;
//! let wave = |k: usize| (-((k % 64) as f64 - 20.0).powi(2) / 60.0).exp();
//! let signal: Vec<f64> = (0..1280).map(|k| 100.0 + wave(k)).collect();
//! let pulses = find_pulses(&signal, rate_hz)?;
//! assert_eq!(pulses.len(), 20);
//! assert!((pulses[3].sample - 212.0).abs() < 0.1);
//! assert!((pulses[3].amplitude - 1.0).abs() < 0.05);
//!
//! let mut detector = PulseDetector::new(rate_hz)?;
//! let causal: Vec<_> = signal.iter().filter_map(|&sample| detector.push(sample)).collect();
//! assert!((causal[3].sample - 212.0).abs() < 0.1);
//! # Ok::<(), teampulse_signal::error::SignalError>(())
//! ```

mod pulse;
mod clean;
mod causal;
mod whole;
mod smoothed;
mod runs;
mod pulses;
mod pieces;
mod quality;
mod template;
pub mod analysis;
mod store;
mod view;
mod cycles;
mod train;
mod doubt;
mod values;
mod judge;
mod blocks;
mod level;
mod working;
mod shape;
mod smooth;

pub use causal::PulseDetector;
pub use clean::{BAND_HZ, band_pass, clean};
pub use pulse::Pulse;
pub use quality::{Cycle, LEAST_QUALITY, Quality};
pub use whole::find_pulses;
