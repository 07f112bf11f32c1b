//! A designed filter.

use std::f64::consts::TAU;

use realfft::num_complex::Complex64;

use super::Section;
use crate::error::{SignalError, checked_rate_hz};

/// A stable filter of second-order sections for one sampling rate.
///
/// [`butterworth`](super::butterworth) and [`notch`](super::notch()) make designs;
/// [`Cascade`](super::Cascade) and [`zero_phase`](super::zero_phase()) run them.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    sections: Vec<Section>,
    rate_hz: f64,
}

impl Design {
    /// A filter of `sections` for signals of `rate_hz`; an error where one is not stable.
    pub fn new(sections: Vec<Section>, rate_hz: f64) -> Result<Design, SignalError> {
        let rate_hz = checked_rate_hz(rate_hz)?;
        let is_stable = sections.iter().all(Section::is_stable);
        if is_stable { Ok(Design { sections, rate_hz }) } else { Err(SignalError::Unstable) }
    }

    /// This filter followed by `next`; an error when they are for different sampling rates.
    pub fn then(mut self, next: &Design) -> Result<Design, SignalError> {
        if self.rate_hz.to_bits() != next.rate_hz.to_bits() {
            return Err(SignalError::Rate { rate_hz: next.rate_hz });
        }
        self.sections.extend_from_slice(&next.sections);
        Ok(self)
    }

    /// The sections, in the order in which they are run.
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// The sampling rate [Hz] that it is for.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// The factor on the amplitude of an oscillation of `frequency_hz`, run causally once.
    pub fn gain(&self, frequency_hz: f64) -> f64 {
        self.response(frequency_hz).norm()
    }

    /// How far an oscillation of `frequency_hz` is turned [rad, −π..π], run causally once.
    pub fn phase_rad(&self, frequency_hz: f64) -> f64 {
        self.response(frequency_hz).arg()
    }

    /// How late the envelope of an oscillation of `frequency_hz` comes out of the causal filter [s].
    ///
    /// −dφ/dω, from the coefficients, not by differences. What a mark found in a filtered signal is
    /// late by, where the signal's energy lies around `frequency_hz`. NaN where the gain is zero.
    pub fn group_delay_secs(&self, frequency_hz: f64) -> f64 {
        let delay = self.unit_delay(frequency_hz);
        let samples: f64 = self.sections.iter().map(|section| section.group_delay(delay)).sum();
        samples / self.rate_hz
    }

    /// The longest group delay [s] between `low_hz` and `high_hz`, at 200 frequencies between them.
    pub fn latency_secs(&self, low_hz: f64, high_hz: f64) -> f64 {
        let at = |k: u32| low_hz + (high_hz - low_hz) * f64::from(k) / 199.0;
        (0..200).map(|k| self.group_delay_secs(at(k))).fold(f64::NAN, f64::max)
    }

    fn response(&self, frequency_hz: f64) -> Complex64 {
        let delay = self.unit_delay(frequency_hz);
        self.sections.iter().map(|section| section.response(delay)).product()
    }

    /// z⁻¹ on the unit circle.
    fn unit_delay(&self, frequency_hz: f64) -> Complex64 {
        Complex64::from_polar(1.0, -TAU * frequency_hz / self.rate_hz)
    }
}
