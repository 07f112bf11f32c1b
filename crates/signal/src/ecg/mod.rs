//! Heartbeats from the electrocardiogram (ECG), causal and of whole recordings.
//!
//! Both detectors use the energy of the QRS complex around 17 Hz: derivatives of a Gaussian of even and odd order give
//! an envelope that does not depend on shape and polarity (Hamilton & Tompkins 1986, doi:10.1109/TBME.1986.325695, use
//! the same band). The maxima of the envelope are compared with thresholds between the usual height of beats and that
//! of all other deflections, which fall as the next beat becomes due. At least a quarter of the time before a beat must
//! also be quiet: flutter and continuous noise are not beats. Flutter also has most of its energy at lower frequencies,
//! where it does not pause. Once it is known what follows, quiet after it counts as well. A deflection with the shape
//! of the surrounding beats counts as a beat even if it is lower or follows early; one unlike them must be higher if it
//! is early in a regular rhythm; one that is far higher is an electrode movement; heights older than 10 s are
//! forgotten. In whole recordings the sequence of candidates with the most probable heights and rhythm is chosen, which
//! separates beats from noise of the same height. The time of a beat is that of its main deflection, to within less
//! than a sample.
//!
//! ```
//! use teampulse_signal::ecg::{BeatDetector, find_beats};
//!
//! let rate_hz = 250.0;
//! let spike = |k: usize| (-((k % 200) as f64 - 100.0).powi(2) / 20.0).exp();
//! let signal: Vec<f64> = (0..5000).map(spike).collect();
//! let beats = find_beats(&signal, rate_hz)?;
//! assert_eq!(beats.len(), 25);
//! assert!((beats[3].sample - 700.0).abs() < 0.01);
//!
//! let mut detector = BeatDetector::new(rate_hz)?;
//! let causal: Vec<_> = signal.iter().filter_map(|&sample| detector.push(sample)).collect();
//! assert!((causal[3].sample - 700.0).abs() < 0.01);
//! # Ok::<(), teampulse_signal::error::SignalError>(())
//! ```

mod beat;
mod causal;
mod whole;
mod rhythm;
mod quality;
mod clean;
mod mains;
pub mod analysis;
mod windows;
mod doubt;
mod company;
mod settle;
mod silence;
mod steepness;
mod values;
mod signs;
mod likeness;
mod pieces;
mod bands;
mod judge;
mod deflections;
mod flutter;
mod shape;
mod both_sides;
mod candidates;
mod peak;
mod kernel;
mod moving_sum;
mod intake;

use crate::{history, recent};

pub use beat::{Beat, Found};
pub use causal::BeatDetector;
pub use clean::{clean, cleaning};
pub use quality::quality;
pub use whole::find_beats;
