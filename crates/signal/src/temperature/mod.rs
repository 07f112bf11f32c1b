//! Skin temperature, and whether the sensor is on the body.
//!
//! ```
//! use teampulse_signal::temperature::{Limits, OnBody, change_c};
//!
//! // A wristband at 4 Hz that is taken off after five samples.
//! let readings_c = [33.1, 33.1, 33.12, 33.12, 33.12, 24.0, 23.5];
//! let mut on_body = OnBody::new(Limits::default())?;
//! let worn: Vec<bool> = (0i64..).zip(readings_c)
//!     .map(|(k, reading_c)| on_body.push(k * 250_000_000, reading_c))
//!     .collect();
//! assert_eq!(worn, [true, true, true, true, true, false, false]);
//! let change = change_c(&readings_c[2..5], &readings_c[..2]).expect("there are readings");
//! assert!((change.value - 0.02).abs() < 1e-9);
//! # Ok::<(), teampulse_signal::error::SignalError>(())
//! ```

mod on_body;
mod change;
pub mod analysis;

pub use change::change_c;
pub use on_body::{Limits, OnBody};
