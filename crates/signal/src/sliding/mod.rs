//! Statistics of the newest samples, kept up to date sample by sample.
//!
//! Window lengths are in samples: each push takes in one sample and removes the oldest of a full window. A
//! sample that is [not a usable number](crate::gaps::is_usable) takes its place but is not counted. Nothing
//! is ever subtracted, so that rounding errors do not accumulate over hours, and nothing is allocated after
//! [`new`](SlidingMoments::new).
//!
//! ```
//! use teampulse_signal::sliding::{SlidingExtremes, SlidingMoments, SlidingQuantiles};
//!
//! let (mut moments, mut extremes, mut quantiles) =
//!     (SlidingMoments::new(3)?, SlidingExtremes::new(3)?, SlidingQuantiles::new(3)?);
//! for sample in [100.0, 1.0, 2.0, 6.0] {
//!     moments.push(sample);
//!     extremes.push(sample);
//!     quantiles.push(sample);
//! }
//! assert_eq!((moments.mean(), moments.variance()), (Some(3.0), Some(7.0)));
//! assert_eq!((extremes.least(), extremes.greatest()), (Some(1.0), Some(6.0)));
//! assert_eq!((quantiles.median(), quantiles.quantile(0.25)), (Some(2.0), Some(1.5)));
//! # Ok::<(), teampulse_signal::error::SignalError>(())
//! ```

mod fold;
mod moments;
mod extremes;
mod tree;
mod quantiles;

pub use extremes::SlidingExtremes;
pub(crate) use fold::{Fold, Sum};
pub use moments::SlidingMoments;
pub use quantiles::SlidingQuantiles;

use crate::error::{SignalError, checked};

/// The longest window [samples]: an hour at 1 kHz.
pub const MOST_SAMPLES: usize = 3_600_000;

fn checked_length(length: usize) -> Result<usize, SignalError> {
    checked("window length", length as f64, (1.0, MOST_SAMPLES as f64)).map(|_| length)
}
