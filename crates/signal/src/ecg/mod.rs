//! Heart beats from the electrocardiogram (ECG), causal and of whole recordings.
//!
//! Both detectors look at the energy of the QRS complex around 17 Hz: derivatives of a Gaussian of
//! even and odd order give an envelope without regard to shape and polarity (Hamilton & Tompkins
//! 1986, doi:10.1109/TBME.1986.325695, use the same band). Its maxima are judged by thresholds
//! between the usual height of beats and that of everything else, which fall as the next beat
//! becomes due. A beat must also stand out of a quiet quarter of the time before it: flutter and
//! noise without pauses are no beats. What has the form of the beats around it is one although it is
//! lower or follows fast; what is far higher is an electrode that moved; and what was more than 10 s ago
//! counts no more. In whole recordings those candidates are chosen of which heights
//! and rhythm together are the most probable, which separates beats from noise that is as high. The time of a beat is that of the main deflection, within
//! less than a sample.
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
mod values;
mod signs;
mod likeness;
mod pieces;
mod bands;
mod judge;
mod deflections;
mod shape;
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
