//! Electrodermal activity: skin conductance [µS], its level and the responses of sweat glands.
//!
//! A [clean](clean()) signal is [split](Split) into a slow level (tonic) and responses (phasic): by a
//! [high-pass](high_pass_split), or by [cvxEDA](cvx_eda), which finds the sparsest nerve activity that
//! explains the signal. [Responses](find_responses) are detected in the phasic part, in whole recordings or
//! [sample by sample](ResponseDetector), and can be [related to events](EventWindow).
//!
//! ```
//! use teampulse_signal::eda::{Threshold, clean, find_responses, high_pass_split};
//!
//! // Two minutes at 8 Hz: a response of 0.4 µS every 20 s, on a drifting level.
//! let rate_hz = 8.0;
//! let response = |secs: f64| ((-secs / 2.0).exp() - (-secs / 0.7).exp()) / 0.3689;
//! let signal: Vec<f64> = (0..960)
//!     .map(|k| f64::from(k) / rate_hz)
//!     .map(|secs| 5.0 + 0.002 * secs + 0.4 * response(secs % 20.0))
//!     .collect();
//! let split = high_pass_split(&clean(&signal, rate_hz)?, rate_hz)?;
//! let responses = find_responses(&split.phasic, rate_hz, Threshold::default())?;
//! assert_eq!(responses.len(), 5);
//! assert!(responses.iter().all(|response| (response.amplitude_us - 0.4).abs() < 0.04));
//! assert!(responses.iter().all(|response| (response.rise_secs - 1.13).abs() < 0.3));
//! # Ok::<(), teampulse_signal::error::SignalError>(())
//! ```

pub mod analysis;
mod clean;
mod thinned;
mod split;
mod cvx;
mod response;
mod responses;
mod onset;
mod sharpened;
mod fall;
mod detector;
mod event_related;
mod contact;
mod quality;
mod noise;
mod step;
mod shape;
mod sympathetic;
mod causal;
mod store;
mod values;

pub use clean::clean;
pub use cvx::cvx_eda;
pub use detector::ResponseDetector;
pub use event_related::{EventResponse, EventWindow};
pub use quality::{quality, valid_samples};
pub use response::{Response, Threshold};
pub use responses::find_responses;
pub use split::{Split, high_pass_split};
pub use sympathetic::{Sympathetic, sympathetic};
pub use thinned::{Thinned, thinned};

use crate::error::{SignalError, checked};

/// The slowest and fastest supported rates [Hz].
const RATES_HZ: (f64, f64) = (1.0, 2000.0);

fn checked_rate(rate_hz: f64) -> Result<f64, SignalError> {
    checked("the rate of a skin conductance [Hz]", rate_hz, RATES_HZ)
}

fn checked_threshold(threshold: Threshold) -> Result<f64, SignalError> {
    match threshold {
        Threshold::Absolute(least_us) => checked("the threshold [µS]", least_us, (1e-9, 1e9)),
        Threshold::Relative(share) => checked("the relative threshold", share, (0.0, 1.0)),
    }
}
