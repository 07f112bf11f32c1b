//! Two estimates of one quantity as one.

use teampulse_core::data::Reason;
use teampulse_signal::estimate::Estimate;

use crate::value::Value;

/// Two independent estimates as one, each by the inverse of its variance; where they are further apart
/// than their sigmas explain, it is as much less sure (Birge 1932, doi:10.1103/PhysRev.40.207). One
/// alone is that one.
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
    fn equals_meet_in_the_middle_and_are_surer_together() {
        let both = both((0.4, 0.2), (0.5, 0.2));
        assert!((both.value - 0.45).abs() < 1e-12 && both.sigma < 0.2);
    }

    #[test]
    fn one_alone_is_that_one() {
        let alone = Ok(Estimate { value: 0.4, sigma: 0.2 });
        assert_eq!(combined(alone, Err(Reason::Gap)), alone);
        assert_eq!(combined(Err(Reason::Gap), alone), alone);
    }

    #[test]
    fn a_contradiction_is_not_sure_of_itself() {
        assert!(both((0.0, 0.1), (1.0, 0.1)).sigma > 0.4);
    }
}
