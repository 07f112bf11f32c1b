//! Filters of second-order sections: designed as SciPy does, run causally or with zero phase.
//!
//! ```
//! use teampulse_signal::filter::{Cascade, butterworth, zero_phase};
//!
//! let band = butterworth::band_pass(2, 5.0, 15.0, 250.0)?;
//! // Causal, sample by sample, without a jump at the beginning:
//! let mut filter = Cascade::settled(&band);
//! let causal: Vec<f64> = [1.0, 1.0, 2.0].map(|sample| filter.push(sample)).to_vec();
//! assert!(causal[1].abs() < 1e-12);
//! assert!((band.group_delay_secs(10.0) - 0.0416).abs() < 1e-4);
//! // Of a whole recording, without delay:
//! let whole = zero_phase(&band, &[0.5; 100])?;
//! assert_eq!(whole.len(), 100);
//! # Ok::<(), teampulse_signal::error::SignalError>(())
//! ```

mod section;
mod design;
pub mod butterworth;
mod roots;
pub mod notch;
mod cascade;
mod zero_phase;

pub use cascade::Cascade;
pub use design::Design;
pub use notch::notch;
pub use section::Section;
pub(crate) use zero_phase::apply_zero_phase;
pub use zero_phase::zero_phase;
