//! Tonic and phasic skin conductance.

use super::checked_rate;
use crate::error::SignalError;
use crate::filter::butterworth::{high_pass, low_pass};
use crate::filter::zero_phase;

/// The cut-off between tonic and phasic [Hz].
const PARTING_HZ: f64 = 0.05;

/// A skin conductance split into tonic and phasic parts, sample by sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Split {
    /// The tonic part, the slow level [µS].
    pub tonic: Vec<f64>,
    /// The phasic part, the responses [µS].
    pub phasic: Vec<f64>,
}

/// Splits a signal at 0.05 Hz, as NeuroKit2's default `eda_phasic`.
///
/// Zero-phase Butterworth filters of order 2, a low-pass and a high-pass; their sum differs from the signal
/// only around 0.05 Hz. Responses undershoot zero before and after, and lose about 3 % of their amplitude.
/// Expects a [clean](super::clean()) signal [µS]. Returns an error for a rate outside 1 to 2000 Hz, and for a
/// signal of fewer than 10 samples or without a usable one.
pub fn high_pass_split(signal: &[f64], rate_hz: f64) -> Result<Split, SignalError> {
    checked_rate(rate_hz)?;
    Ok(Split {
        tonic: zero_phase(&low_pass(2, PARTING_HZ, rate_hz)?, signal)?,
        phasic: zero_phase(&high_pass(2, PARTING_HZ, rate_hz)?, signal)?,
    })
}
