//! Descriptive statistics that apply to any series of numbers, for signals of an unknown kind.
//!
//! ```
//! use teampulse_signal::descriptive::describe;
//!
//! let (secs, values) = ([0.0, 1.0, 2.0, 3.0], [5.0, 7.0, f64::NAN, 11.0]);
//! let summary = describe(&secs, &values).expect("there are numbers");
//! assert_eq!((summary.n, summary.median, summary.greatest), (3, 7.0, 11.0));
//! assert!((summary.slope_per_sec.expect("they differ in time") - 2.0).abs() < 1e-12);
//! assert_eq!(describe(&[0.0], &[f64::NAN]), None);
//! ```

mod summary;
pub mod analysis;
mod rolling;
mod kept;
mod moments;
mod middle;
mod band;

pub use rolling::{Described, Pace, Rolling, View};
pub use summary::{Summary, describe};
