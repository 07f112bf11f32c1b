//! Voice features of speech: level, voice activity, pitch, speaking rate, pauses, jitter and shimmer.
//!
//! Samples are those of a microphone, with 1 as full scale. There is a [`Frame`] every 10 ms, which is known 0.3 s
//! later, as it depends on the sound after it. Frames are a pure function of the samples: speech in blocks of any
//! length gives the same frames as the whole recording, bit for bit. Words cannot be reconstructed from frames, as they
//! contain no spectrum.
//!
//! - Pitch: the autocorrelation of the sound over that of the window (Boersma 1993), and the best path through its
//!   candidates, at a fixed delay.
//! - Voice activity: the level above a tracked noise floor, or a voice; closures within speech count as
//!   speech.
//! - Jitter and shimmer: Praat's local jitter and shimmer, of glottal pulses placed by cross-correlation.
//! - Syllables: peaks of level between dips, in voiced speech (de Jong & Wempe 2009, doi:10.3758/BRM.41.2.385).
//!
//! ```
//! use teampulse_signal::voice::{Framer, Settings};
//!
//! // Two seconds of a buzz at 120 Hz between silences.
//! let rate_hz = 16_000.0;
//! let buzz = |k: i64| {
//!     let secs = k as f64 / rate_hz;
//!     let is_on = (1.0..3.0).contains(&secs);
//!     (1..20).map(|n| (std::f64::consts::TAU * 120.0 * f64::from(n) * secs).sin()).sum::<f64>()
//!         * if is_on { 0.02 } else { 0.0 }
//! };
//! let mut framer = Framer::new(&Settings::default(), rate_hz)?;
//! let mut frames = Vec::new();
//! for k in 0..64_000 {
//!     frames.extend(framer.push((k as f64 / rate_hz * 1e9) as i64, buzz(k)));
//! }
//! let at = |secs: f64| frames.iter().find(|frame| frame.at_ns as f64 >= secs * 1e9).unwrap();
//! assert!((at(2.0).pitch_hz / 120.0 - 1.0).abs() < 0.001);
//! assert!(at(2.0).is_speech() && !at(0.5).is_speech() && at(0.5).pitch_hz.is_nan());
//! # Ok::<(), teampulse_signal::error::SignalError>(())
//! ```

mod settings;
mod frame;
mod framer;
mod sound;
mod periodicity;
mod tilt;
mod path;
mod activity;
mod pulses;
mod nuclei;
pub mod analysis;
mod store;
mod values;

pub use frame::{CHANNELS, Frame, Glottal};
pub use framer::Framer;
pub use settings::{RATES_HZ, Settings};
