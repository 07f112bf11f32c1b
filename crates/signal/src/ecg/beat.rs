//! Heartbeats in an ECG.

use super::candidates::Candidate;

/// When a beat was found.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Found {
    /// As soon as the beat had passed.
    InTime,
    /// Only after the next beat was found missing, or once the usual height of beats had been learnt.
    Later,
}

/// A heartbeat in an ECG.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beat {
    /// The time of the main deflection (the R peak), as located in the mean over 20 ms [samples from the first one],
    /// fractional.
    pub sample: f64,
    /// The height of the envelope around 17 Hz [unit of the signal].
    pub strength: f64,
    /// Whether the main deflection points upwards.
    pub upright: bool,
    /// When the beat was found.
    pub found: Found,
}

impl Candidate {
    pub(super) fn beat(&self, found: Found) -> Beat {
        let Candidate { strength, deflection, .. } = *self;
        Beat { sample: deflection.sample, strength, upright: deflection.upright, found }
    }
}
