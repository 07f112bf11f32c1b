//! The combination of two estimates of one quantity.

use teampulse_core::data::Reason;
use teampulse_signal::estimate::Estimate;

use crate::value::Value;

/// Combines two independent estimates, weighted by the inverse of their variances; where they differ
/// by more than their sigmas explain, sigma is enlarged accordingly (Birge 1932,
/// doi:10.1103/PhysRev.40.207). A single estimate is returned unchanged.
pub(super) fn combined(one: Value, other: Value) -> Value {
    let (one, other) = match (one, other) {
        (Ok(one), Ok(other)) => (one, other),
        (Ok(alone), Err(_)) | (Err(_), Ok(alone)) => return Ok(alone),
        (Err(Reason::Missing), Err(reason)) | (Err(reason), Err(_)) => return Err(reason),
    };
    let weights = [one, other].map(|each| each.sigma.powi(-2));
    let value = (weights[0] * one.value + weights[1] * other.value) / (weights[0] + weights[1]);
    let apart = (one.value - other.value).powi(2) / (one.sigma.powi(2) + other.sigma.powi(2));
    let sigma = (apart.max(1.0) / (weights[0] + weights[1])).sqrt();
    Ok(Estimate { value, sigma })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn both(one: (f64, f64), other: (f64, f64)) -> Estimate {
        let [one, other] = [one, other].map(|(value, sigma)| Ok(Estimate { value, sigma }));
        combined(one, other).unwrap()
    }

    #[test]
    fn equal_weights_give_the_mean_with_a_smaller_sigma() {
        let both = both((0.4, 0.2), (0.5, 0.2));
        assert!((both.value - 0.45).abs() < 1e-12 && both.sigma < 0.2);
    }

    #[test]
    fn a_single_estimate_stays_unchanged() {
        let alone = Ok(Estimate { value: 0.4, sigma: 0.2 });
        assert_eq!(combined(alone, Err(Reason::Gap)), alone);
        assert_eq!(combined(Err(Reason::Gap), alone), alone);
    }

    #[test]
    fn a_contradiction_enlarges_sigma() {
        assert!(both((0.0, 0.1), (1.0, 0.1)).sigma > 0.4);
    }
}
