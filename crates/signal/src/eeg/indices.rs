//! Indices from the spectra of particular sites, and from the shape of a spectrum.

use super::band::{Band, Powers, ratio, up_to};
use crate::spectrum::Spectrum;

/// The search range of the alpha peak [Hz].
const ALPHA_HZ: (f64, f64) = (7.0, 13.0);
/// The range of the slope's fit [Hz], and the alpha range excluded from it.
const SLOPE_HZ: (f64, f64) = (2.0, 40.0);
const BUMP_HZ: (f64, f64) = (7.0, 14.0);

/// Mental workload: theta at Fz over alpha at Pz [1].
///
/// Frontal theta rises and parietal alpha falls with task load. Holm et al. (2009), doi:10.1100/tsw.2009.83. Compare
/// conditions within a person only; blinks raise theta at Fz. `None` without alpha at Pz.
pub fn workload(fz: &Powers, pz: &Powers) -> Option<f64> {
    ratio(fz.uv2(Band::Theta), pz.uv2(Band::Alpha))
}

/// Frontal alpha asymmetry: ln(right) − ln(left) [1].
///
/// Alpha is lower over the more active cortex: positive values mean greater left activity. Allen, Coan &
/// Nazarian (2004), doi:10.1016/j.biopsycho.2004.03.007. `None` when one side has no alpha.
pub fn asymmetry(left: &Powers, right: &Powers) -> Option<f64> {
    ratio(right.uv2(Band::Alpha), left.uv2(Band::Alpha)).map(f64::ln).filter(|ln| ln.is_finite())
}

/// The individual alpha frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlphaFrequency {
    /// The peak between 7 and 13 Hz [Hz]; `None` at an edge of the range, where it is not a peak but a slope.
    pub peak_hz: Option<f64>,
    /// The centre of gravity of the power between 7 and 13 Hz [Hz]; defined without a peak, too.
    pub centre_hz: f64,
}

/// Computes the individual alpha frequency of a [spectrum](super::spectrum).
///
/// Σ f·P / Σ P and the maximum of P over the bins from 7 to 13 Hz, both included. Klimesch (1999),
/// doi:10.1016/S0165-0173(98)00056-3. The peak's resolution is a bin (0.25 Hz); it is clearest with the eyes
/// closed. `None` without bins or power.
pub fn alpha_frequency(spectrum: &Spectrum) -> Option<AlphaFrequency> {
    let (low_hz, high_hz) = up_to(ALPHA_HZ);
    let bins = spectrum.bins(low_hz, high_hz);
    let (hz, power) = (&spectrum.frequencies_hz[bins.clone()], &spectrum.power[bins]);
    let moment: f64 = hz.iter().zip(power).map(|(hz, power)| hz * power).sum();
    let centre_hz = ratio(moment, power.iter().sum())?;
    let highest = (0..power.len()).max_by(|&a, &b| power[a].total_cmp(&power[b]))?;
    let is_inside = highest > 0 && highest + 1 < power.len();
    Some(AlphaFrequency { peak_hz: is_inside.then(|| hz[highest]), centre_hz })
}

/// The spectral slope: log P over log f [1], about −1 to −2.
///
/// A least-squares line through the bins from 2 to 40 Hz, except for alpha, 7 to 14 Hz. A simple form of the
/// aperiodic exponent of Donoghue et al. (2020), doi:10.1038/s41593-020-00744-x (with the sign of the slope);
/// muscle activity flattens it. `None` with fewer than ten bins that have power.
pub fn slope(spectrum: &Spectrum) -> Option<f64> {
    let (low_hz, high_hz) = up_to(SLOPE_HZ);
    let bins = spectrum.bins(low_hz, high_hz);
    let bins = bins.map(|bin| (spectrum.frequencies_hz[bin], spectrum.power[bin]));
    let is_within = |(hz, power): &(f64, f64)| {
        let (low_hz, high_hz) = up_to(BUMP_HZ);
        *power > 0.0 && !(low_hz..=high_hz).contains(hz)
    };
    let points = bins.filter(is_within).map(|(hz, power)| (hz.ln(), power.ln()));
    let points: Vec<(f64, f64)> = points.collect();
    if points.len() < 10 {
        return None;
    }
    let count = points.len() as f64;
    let x_mean = points.iter().map(|(x, _)| x).sum::<f64>() / count;
    let products: f64 = points.iter().map(|(x, y)| (x - x_mean) * y).sum();
    let squares: f64 = points.iter().map(|(x, _)| (x - x_mean).powi(2)).sum();
    ratio(products, squares)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spectrum(power: impl Fn(f64) -> f64) -> Spectrum {
        let frequencies_hz: Vec<f64> = (0..400).map(|bin| f64::from(bin) / 4.0).collect();
        let power = frequencies_hz.iter().map(|&hz| power(hz)).collect();
        Spectrum { frequencies_hz, power, segments: 1 }
    }

    fn powers(theta: f64, alpha: f64) -> Powers {
        Powers::of(&spectrum(|hz| if hz < 8.0 { theta } else { alpha })).unwrap()
    }

    #[test]
    fn less_alpha_on_the_left_is_above_zero() {
        let (weak, strong) = (powers(1.0, 1.0), powers(1.0, 2.0));
        assert!(asymmetry(&weak, &strong).unwrap() > 0.5);
        assert_eq!(asymmetry(&strong, &weak), asymmetry(&weak, &strong).map(|ln| -ln));
        assert_eq!(asymmetry(&powers(1.0, 0.0), &strong), None);
        assert_eq!(asymmetry(&strong, &powers(1.0, 0.0)), None);
    }

    #[test]
    fn workload_rises_with_frontal_theta_and_falls_with_parietal_alpha() {
        let at_rest = workload(&powers(1.0, 1.0), &powers(1.0, 2.0)).unwrap();
        assert!(workload(&powers(2.0, 1.0), &powers(1.0, 2.0)).unwrap() > at_rest);
        assert!(workload(&powers(1.0, 1.0), &powers(1.0, 1.0)).unwrap() > at_rest);
        assert_eq!(workload(&powers(1.0, 1.0), &powers(1.0, 0.0)), None);
    }

    #[test]
    fn a_slope_without_a_peak_has_a_centre_only() {
        let falling = alpha_frequency(&spectrum(|hz| 1.0 / (1.0 + hz))).unwrap();
        assert_eq!(falling.peak_hz, None);
        assert!((9.0..10.0).contains(&falling.centre_hz));
        let peak = spectrum(|hz| 1.0 / (1.0 + hz) + (-(hz - 10.5f64).powi(2)).exp());
        let peak = alpha_frequency(&peak).unwrap();
        assert_eq!(peak.peak_hz, Some(10.5));
        assert!((10.0..10.5).contains(&peak.centre_hz));
        assert_eq!(alpha_frequency(&spectrum(|_| 0.0)), None);
    }

    #[test]
    fn a_power_law_has_its_exponent_with_and_without_alpha() {
        for bump in [0.0, 50.0] {
            let law = spectrum(|hz| {
                hz.max(0.1).powf(-1.5) * if (7.5..13.5).contains(&hz) { 1.0 + bump } else { 1.0 }
            });
            assert!((slope(&law).unwrap() + 1.5).abs() < 1e-9);
        }
        assert_eq!(slope(&spectrum(|_| 0.0)), None);
    }
}
