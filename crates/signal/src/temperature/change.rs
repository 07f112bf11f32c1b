//! Change against a baseline.

use crate::estimate::Estimate;
use crate::gaps::is_usable;

/// The change of a span against a baseline: the difference of the means of usable readings [°C].
///
/// The uncertainty is that of a difference of two means, √(s₁²/n₁ + s₂²/n₂), for independent readings; skin temperature
/// drifts, so it is a lower bound. `None` when either has no usable reading; the uncertainty of a single reading counts
/// as zero.
pub fn change_c(span_c: &[f64], baseline_c: &[f64]) -> Option<Estimate> {
    let (span, baseline) = (mean_c(span_c)?, mean_c(baseline_c)?);
    let sigma = span.sigma.hypot(baseline.sigma);
    Some(Estimate { value: span.value - baseline.value, sigma })
}

fn mean_c(readings_c: &[f64]) -> Option<Estimate> {
    let usable = || readings_c.iter().filter(|&&reading_c| is_usable(reading_c));
    let count = usable().count() as f64;
    let value = usable().sum::<f64>() / count;
    let squares: f64 = usable().map(|reading_c| (reading_c - value).powi(2)).sum();
    let sigma = (squares / (count - 1.0).max(1.0) / count).sqrt();
    (count > 0.0).then_some(Estimate { value, sigma })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warmer_span_has_a_positive_change() {
        let change = change_c(&[33.0, 34.0, f64::NAN], &[32.0, 32.0, 32.0]).unwrap();
        assert_eq!((change.value, change.sigma), (1.5, 0.5));
    }

    #[test]
    fn without_readings_there_is_no_change() {
        assert_eq!(change_c(&[], &[32.0]), None);
        assert_eq!(change_c(&[32.0], &[f64::NAN]), None);
        assert_eq!(change_c(&[32.0], &[31.0]), Some(Estimate { value: 1.0, sigma: 0.0 }));
    }
}
