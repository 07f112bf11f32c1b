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
    /// Creates a filter with these sections; an error if one is unstable.
    pub fn new(sections: Vec<Section>, rate_hz: f64) -> Result<Design, SignalError> {
        let rate_hz = checked_rate_hz(rate_hz)?;
        let is_stable = sections.iter().all(Section::is_stable);
        if is_stable { Ok(Design { sections, rate_hz }) } else { Err(SignalError::Unstable) }
    }

    /// This filter followed by `next`; an error when their sampling rates differ.
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

    /// The sampling rate [Hz] for which the filter was designed.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// The amplitude gain at `frequency_hz`, applied once.
    pub fn gain(&self, frequency_hz: f64) -> f64 {
        self.response(frequency_hz).norm()
    }

    /// The phase shift at `frequency_hz` [rad, −π..π], applied once.
    pub fn phase_rad(&self, frequency_hz: f64) -> f64 {
        self.response(frequency_hz).arg()
    }

    /// The group delay at `frequency_hz` of the causal filter [s].
    ///
    /// −dφ/dω, computed analytically: the delay of a feature in a filtered signal with energy around
    /// `frequency_hz`. NaN where the gain is zero.
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

    /// The length of the step response's transient [s]: until the slowest mode has decayed to `share`.
    ///
    /// ln `share` / ln r / rate, with r the radius of the outermost pole. For judging the first seconds after
    /// a gap or a knock.
    pub fn memory_secs(&self, share: f64) -> f64 {
        let radius = self.sections.iter().map(Section::pole_radius).fold(0.0, f64::max);
        (share.ln() / radius.ln()).max(0.0) / self.rate_hz
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::{Cascade, butterworth, notch};

    #[test]
    fn filters_in_a_row_multiply_gains_and_add_delays() {
        let first = butterworth::high_pass(2, 0.5, 250.0).unwrap();
        let second = notch(50.0, 30.0, 250.0).unwrap();
        let both = first.clone().then(&second).unwrap();
        assert!((both.gain(40.0) - first.gain(40.0) * second.gain(40.0)).abs() < 1e-15);
        let sum = first.group_delay_secs(40.0) + second.group_delay_secs(40.0);
        assert!((both.group_delay_secs(40.0) - sum).abs() < 1e-15);
        assert!(first.then(&notch(50.0, 30.0, 500.0).unwrap()).is_err());
    }

    #[test]
    fn an_oscillation_comes_out_as_late_as_its_phase_says() {
        let design = butterworth::low_pass(3, 20.0, 1000.0).unwrap();
        let wave = |k: f64| (TAU * 5.0 * k / 1000.0).sin();
        let mut filter = Cascade::at_rest(&design);
        let filtered: Vec<f64> = (0..2000).map(|k| filter.push(wave(f64::from(k)))).collect();
        let late = -design.phase_rad(5.0) / TAU / 5.0 * 1000.0;
        assert!((filtered[1777] - design.gain(5.0) * wave(1777.0 - late)).abs() < 1e-9);
    }

    #[test]
    fn the_latency_of_a_band_is_its_longest_delay() {
        let band = butterworth::band_pass(1, 5.0, 15.0, 250.0).unwrap();
        let (at_edge, in_band) = (band.group_delay_secs(5.0), band.latency_secs(5.0, 15.0));
        assert!(in_band >= at_edge && in_band < 0.06, "{in_band}");
    }

    #[test]
    fn a_jump_is_felt_as_long_as_stated() {
        let design = butterworth::high_pass(1, 0.5, 100.0).unwrap();
        let mut filter = Cascade::at_rest(&design);
        let jump: Vec<f64> = (0..1000).map(|_| filter.push(1.0)).collect();
        let memory = (design.memory_secs(0.01) * 100.0).ceil() as usize;
        assert!(jump[memory].abs() < 0.01 && jump[memory - 3].abs() > 0.0099);
    }
}
