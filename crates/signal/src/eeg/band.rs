//! The frequency bands of the EEG and their powers.

use crate::spectrum::{Rule, Spectrum};

/// The tolerance for a bin to lie on a band's edge [Hz]; far below any bin spacing.
const ON_EDGE_HZ: f64 = 1e-6;

/// A band of the EEG.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Band {
    /// 1–4 Hz.
    Delta,
    /// 4–8 Hz.
    Theta,
    /// 8–13 Hz.
    Alpha,
    /// 13–30 Hz.
    Beta,
    /// 30–45 Hz: below the mains of all countries.
    Gamma,
}

impl Band {
    /// All bands, from the slowest.
    pub const ALL: [Band; 5] = [Band::Delta, Band::Theta, Band::Alpha, Band::Beta, Band::Gamma];

    /// The edges of the band [Hz].
    pub const fn edges_hz(self) -> (f64, f64) {
        match self {
            Band::Delta => (1.0, 4.0),
            Band::Theta => (4.0, 8.0),
            Band::Alpha => (8.0, 13.0),
            Band::Beta => (13.0, 30.0),
            Band::Gamma => (30.0, 45.0),
        }
    }
}

/// The power of each band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Powers {
    uv2: [f64; 5],
}

impl Powers {
    /// Computes the band powers of a [spectrum](super::spectrum), integrated by the trapezoidal rule from edge to edge,
    /// both included.
    ///
    /// Where no bin lies on an edge, the interval that crosses it belongs to neither band, as in the usual
    /// recipe with SciPy. `None` where a band has fewer than two bins.
    pub fn of(spectrum: &Spectrum) -> Option<Powers> {
        let mut uv2 = [0.0; 5];
        for (band, power) in Band::ALL.into_iter().zip(&mut uv2) {
            let (low_hz, high_hz) = up_to(band.edges_hz());
            *power = spectrum.band_power(low_hz, high_hz, Rule::Trapezoid)?;
        }
        Some(Powers { uv2 })
    }

    /// The power of one band [µV²].
    pub fn uv2(&self, band: Band) -> f64 {
        self.uv2[band as usize]
    }

    /// The total power of all five bands [µV²].
    pub fn total_uv2(&self) -> f64 {
        self.uv2.iter().sum()
    }

    /// The share of one band in all five [0..1]. `None` without any power.
    pub fn relative(&self, band: Band) -> Option<f64> {
        ratio(self.uv2(band), self.total_uv2())
    }

    /// The engagement index: β / (α + θ) [1].
    ///
    /// Pope, Bogart & Bartolome (1995), doi:10.1016/0301-0511(95)05116-3, from sums over channels. For
    /// comparing conditions within a person; muscle activity raises beta. `None` without alpha and theta.
    pub fn engagement(&self) -> Option<f64> {
        ratio(self.uv2(Band::Beta), self.uv2(Band::Alpha) + self.uv2(Band::Theta))
    }

    /// Theta over alpha [1]: rises with drowsiness and with working memory load.
    ///
    /// Blinks raise theta in frontal channels. `None` without alpha.
    pub fn theta_over_alpha(&self) -> Option<f64> {
        ratio(self.uv2(Band::Theta), self.uv2(Band::Alpha))
    }
}

/// Bounds that include the bins on both edges.
pub(super) fn up_to((low_hz, high_hz): (f64, f64)) -> (f64, f64) {
    (low_hz - ON_EDGE_HZ, high_hz + ON_EDGE_HZ)
}

/// The quotient, if it is finite.
pub(super) fn ratio(above: f64, below: f64) -> Option<f64> {
    Some(above / below).filter(|ratio| ratio.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(step_hz: f64) -> Spectrum {
        let frequencies_hz: Vec<f64> = (0..400).map(|bin| f64::from(bin) * step_hz).collect();
        Spectrum { power: vec![2.0; 400], frequencies_hz, segments: 1 }
    }

    #[test]
    fn a_band_of_even_density_has_its_width_in_power() {
        let powers = Powers::of(&flat(0.25)).unwrap();
        assert_eq!(Band::ALL.map(|band| powers.uv2(band)), [6.0, 8.0, 10.0, 34.0, 30.0]);
        assert_eq!(powers.total_uv2(), 88.0);
        assert_eq!(powers.relative(Band::Alpha), Some(10.0 / 88.0));
        assert_eq!(powers.engagement(), Some(34.0 / 18.0));
    }

    #[test]
    fn edges_are_met_although_frequencies_are_rounded() {
        // 40 bins of 0.1 Hz do not give 4 exactly.
        let powers = Powers::of(&Spectrum {
            power: vec![2.0; 500],
            frequencies_hz: (0..500).map(|bin| f64::from(bin) * 0.1).collect(),
            segments: 1,
        })
        .unwrap();
        assert!((powers.uv2(Band::Delta) - 6.0).abs() < 1e-9);
        assert!((powers.uv2(Band::Theta) - 8.0).abs() < 1e-9);
    }

    #[test]
    fn bands_without_bins_or_power_have_no_answer() {
        assert_eq!(Powers::of(&flat(10.0)), None);
        let silent = Powers::of(&Spectrum { power: vec![0.0; 400], ..flat(0.25) }).unwrap();
        assert_eq!(silent.engagement(), None);
        assert_eq!(silent.theta_over_alpha(), None);
        assert_eq!(silent.relative(Band::Beta), None);
    }
}
