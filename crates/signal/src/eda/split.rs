//! Level and responses.

use super::checked_rate;
use crate::error::SignalError;
use crate::filter::butterworth::{high_pass, low_pass};
use crate::filter::zero_phase;

/// Where level and responses are parted [Hz].
const PARTING_HZ: f64 = 0.05;

/// A skin conductance as a level and responses, sample by sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Split {
    /// The slow level, the tonic part [µS].
    pub tonic: Vec<f64>,
    /// The responses, the phasic part [µS].
    pub phasic: Vec<f64>,
}

/// What is slower and what is faster than 0.05 Hz, as NeuroKit2's default `eda_phasic`.
///
/// Butterworth of order 2 with zero phase, once as low-pass and once as high-pass; both add up to
/// the signal but for a little around 0.05 Hz. Responses dip below zero before and after them, and
/// lose about 3 % of their amplitude. Expects a [clean](super::clean()) signal [µS]. An error for a
/// rate outside of 1 to 2000 Hz, and for a signal of less than 10 samples or without a usable one.
pub fn high_pass_split(signal: &[f64], rate_hz: f64) -> Result<Split, SignalError> {
    checked_rate(rate_hz)?;
    Ok(Split {
        tonic: zero_phase(&low_pass(2, PARTING_HZ, rate_hz)?, signal)?,
        phasic: zero_phase(&high_pass(2, PARTING_HZ, rate_hz)?, signal)?,
    })
}
