//! Measures from the magnitude of the acceleration.

use crate::gaps::is_usable;

/// The vector magnitude √(x² + y² + z²), in the unit of the axes; NaN when an axis is not
/// [usable](is_usable).
pub fn magnitude(axes: [f64; 3]) -> f64 {
    let is_whole = axes.iter().all(|&axis| is_usable(axis));
    if is_whole { axes.iter().map(|axis| axis * axis).sum::<f64>().sqrt() } else { f64::NAN }
}

/// Euclidean norm minus one: the mean of max(magnitude − 1 g, 0) [g].
///
/// van Hees et al. (2013), doi:10.1371/journal.pone.0061691. Uses only usable magnitudes [g]; `None` without
/// one. It needs a sensor that reads 1 g at rest: an offset of 20 mg appears in full.
pub fn enmo_g(magnitudes_g: &[f64]) -> Option<f64> {
    mean(magnitudes_g, |magnitude| (magnitude - 1.0).max(0.0))
}

/// Mean amplitude deviation: the mean of |magnitude − its mean| [g].
///
/// Vähä-Ypyä et al. (2015), doi:10.1111/cpf.12127, who use epochs of 5 or 6 s. Uses only usable magnitudes
/// [g]; `None` without one. Independent of the sensor's offset at rest.
pub fn mean_amplitude_deviation_g(magnitudes_g: &[f64]) -> Option<f64> {
    let centre = mean(magnitudes_g, |magnitude| magnitude)?;
    mean(magnitudes_g, |magnitude| (magnitude - centre).abs())
}

fn mean(values: &[f64], of: impl Fn(f64) -> f64) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for &value in values.iter().filter(|&&value| is_usable(value)) {
        (sum, count) = (sum + of(value), count + 1.0);
    }
    (count > 0.0).then(|| sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rest_has_no_activity() {
        assert_eq!(
            (enmo_g(&[1.0; 9]), mean_amplitude_deviation_g(&[1.0; 9])),
            (Some(0.0), Some(0.0))
        );
        // Less than gravity does not count.
        assert_eq!(enmo_g(&[0.5, 1.5]), Some(0.25));
        assert_eq!(mean_amplitude_deviation_g(&[0.5, 1.5]), Some(0.5));
    }

    #[test]
    fn what_is_missing_is_left_out() {
        assert_eq!(enmo_g(&[f64::NAN, 1.5]), Some(0.5));
        assert_eq!(enmo_g(&[f64::NAN]), None);
        assert_eq!(mean_amplitude_deviation_g(&[]), None);
        assert!(magnitude([1.0, f64::INFINITY, 0.0]).is_nan());
    }
}
