//! The values of a feature, each with its uncertainty or the reason why there is none.

use std::sync::Arc;

use teampulse_core::data::{Data, Event, EventKind, FeatureValues, Reason};
use teampulse_signal::estimate::Estimate;

/// A value with its uncertainty, or the reason why there is none.
pub(crate) type Value = Result<Estimate, Reason>;

/// A computed value; undefined if it is not finite.
pub(crate) fn defined(estimate: Option<Estimate>) -> Value {
    let sound = |estimate: &Estimate| estimate.value.is_finite() && !estimate.sigma.is_infinite();
    estimate.filter(sound).ok_or(Reason::Undefined)
}

/// The values of one window as a sample: `coverage` and `quality` are shares [0..1].
pub(crate) fn window_of(window_secs: f64, coverage: f64, quality: f64, values: &[Value]) -> Data {
    let sigma = |value: &Value| value.map_or(f64::NAN, |estimate| estimate.sigma);
    let mut sigmas: Vec<f64> = values.iter().map(sigma).collect();
    if sigmas.iter().all(|sigma| sigma.is_nan()) {
        sigmas.clear();
    }
    Data::Feature(Arc::new(FeatureValues {
        window_secs,
        coverage: coverage as f32,
        quality: quality as f32,
        values: values.iter().map(|value| value.map_or(f64::NAN, |each| each.value)).collect(),
        sigmas,
        reasons: values.iter().map(|value| value.err().unwrap_or(Reason::Ok)).collect(),
    }))
}

/// An instantaneous event without a number.
pub(crate) fn moment(kind: EventKind, label: String) -> Event {
    Event { kind, label, value: f64::NAN, duration_secs: 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_missing_exactly_where_it_has_a_reason() {
        let values = [Ok(Estimate { value: 1.0, sigma: 0.5 }), Err(Reason::Gap)];
        let Data::Feature(window) = window_of(30.0, 1.0, 1.0, &values) else { panic!() };
        assert_eq!(window.reasons, [Reason::Ok, Reason::Gap]);
        assert!(window.values[1].is_nan() && window.sigmas[1].is_nan());
    }

    #[test]
    fn no_stated_uncertainty_at_all_is_an_empty_list() {
        let Data::Feature(window) = window_of(1.0, 1.0, 1.0, &[Ok(Estimate::unstated(2.0))]) else {
            panic!()
        };
        assert!(window.sigmas.is_empty());
    }

    #[test]
    fn a_value_that_is_not_a_number_is_undefined() {
        assert_eq!(defined(None), Err(Reason::Undefined));
        assert_eq!(defined(Some(Estimate::unstated(f64::INFINITY))), Err(Reason::Undefined));
        let unbounded = Estimate { value: 1.0, sigma: f64::INFINITY };
        assert_eq!(defined(Some(unbounded)), Err(Reason::Undefined));
    }
}
