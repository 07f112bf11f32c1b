use proptest::prelude::*;

use super::*;

const SECOND: f64 = 1e9;

/// Some times [s] as stamps [ns], in this century.
fn stamps(secs: impl IntoIterator<Item = f64>) -> Vec<i64> {
    secs.into_iter().map(|secs| 1_700_000_000_000_000_000 + (secs * SECOND) as i64).collect()
}

/// A stream of `rate_hz` over 20 s with impacts that ring on for a while.
fn ringing(blows: &[f64], rate_hz: f64) -> (Vec<i64>, Vec<f64>) {
    let secs: Vec<f64> = (0..(20.0 * rate_hz) as u32).map(|k| f64::from(k) / rate_hz).collect();
    let ring = |since: f64| if since < 0.0 { 0.0 } else { (-since / 0.05).exp() };
    let value = |at: &f64| 9.8 + blows.iter().map(|blow| 20.0 * ring(at - blow)).sum::<f64>();
    let values = secs.iter().map(value).collect();
    (stamps(secs), values)
}

const TAPS: [f64; 5] = [3.0013, 5.2128, 6.9407, 9.6251, 12.0079];

fn later(by_secs: f64) -> Vec<f64> {
    TAPS.iter().map(|tap| tap + by_secs).collect()
}

#[test]
fn a_delayed_stream_is_found_to_be_that_much_later() {
    let presses = stamps(TAPS);
    for lag_secs in [0.08, -0.3, 0.0, 0.75] {
        let (times, values) = ringing(&later(lag_secs), 100.0);
        let seen = Seen::Samples { times: &times, values: &values };
        let found = calibrate(Seen::Events(&presses), seen, 1.0).unwrap();
        assert_eq!(found.events, 5);
        assert!((found.lag_secs - lag_secs).abs() < 0.005, "{lag_secs}: {found:?}");
        assert!(
            (found.lag_secs - lag_secs).abs() < found.uncertainty_secs,
            "{lag_secs}: {found:?}"
        );
        assert!(found.uncertainty_secs >= 0.005, "half an interval is the least: {found:?}");
        assert!(found.is_trustworthy());
    }
}

#[test]
fn the_lag_changes_its_sign_with_the_roles() {
    let (times, values) = ringing(&later(0.08), 200.0);
    let (seen, presses) = (Seen::Samples { times: &times, values: &values }, stamps(TAPS));
    let there = calibrate(Seen::Events(&presses), seen, 1.0).unwrap();
    let back = calibrate(seen, Seen::Events(&presses), 1.0).unwrap();
    assert!((there.lag_secs + back.lag_secs).abs() < 1e-9);
}

#[test]
fn the_part_of_a_step_within_an_exposure_gives_its_time() {
    let on_secs = 4.0 / 30.0 * 30.0 + 0.011;
    let frames: Vec<f64> = (0..200).map(|k| f64::from(k) / 30.0).collect();
    let lit = |middle: &f64| ((middle + 0.5 / 30.0 - on_secs) * 30.0).clamp(0.0, 1.0);
    let brightness: Vec<f64> = frames.iter().map(|middle| 40.0 + 80.0 * lit(middle)).collect();
    let times = stamps(frames);
    let seen = Seen::Samples { times: &times, values: &brightness };
    let found = calibrate(Seen::Events(&stamps([on_secs])), seen, 1.0).unwrap();
    assert!(found.lag_secs.abs() < 0.0005, "{found:?}");
    assert!(found.uncertainty_secs >= 0.5 / 30.0);
}

#[test]
fn the_order_of_the_samples_does_not_matter_and_repeated_ones_count_once() {
    let (mut times, mut values) = ringing(&later(0.08), 100.0);
    let presses = stamps(TAPS);
    let find = |times: &[i64], values: &[f64]| {
        calibrate(Seen::Events(&presses), Seen::Samples { times, values }, 1.0)
    };
    let in_order = find(&times, &values);
    times.extend_from_within(100..300);
    values.extend_from_within(100..300);
    times.reverse();
    values.reverse();
    assert_eq!(find(&times, &values), in_order);
}

#[test]
fn events_at_even_intervals_are_ambiguous() {
    let even = stamps((0..20).map(|k| f64::from(k) * 0.5));
    let shifted = stamps((0..20).map(|k| f64::from(k) * 0.5 + 0.25));
    let found = calibrate(Seen::Events(&even), Seen::Events(&shifted), 1.0);
    assert!(matches!(found, Err(CalibrationError::Ambiguous { .. })), "{found:?}");
}

#[test]
fn each_failure_has_its_own_error() {
    let presses = stamps(TAPS);
    let (times, values) = ringing(&later(0.08), 100.0);
    let still = vec![9.8; times.len()];
    let seen = Seen::Samples { times: &times, values: &values };
    let of = |reference, stream| calibrate(reference, stream, 1.0).unwrap_err();
    assert_eq!(
        of(Seen::Events(&[]), seen),
        CalibrationError::Short(Which::Reference),
        "an empty reference"
    );
    assert_eq!(
        of(Seen::Events(&presses), Seen::Samples { times: &times[..5], values: &values[..5] }),
        CalibrationError::Short(Which::Stream)
    );
    assert_eq!(
        of(Seen::Samples { times: &times, values: &still }, seen),
        CalibrationError::Quiet(Which::Reference)
    );
    let elsewhere = stamps([17.0]);
    assert_eq!(of(Seen::Events(&elsewhere), seen), CalibrationError::Apart { max_lag_secs: 1.0 });
}

#[test]
fn onsets_without_a_partner_make_it_untrustworthy() {
    let presses = stamps((0..40).map(|k| f64::from(k) * 7.3 + 0.01 * f64::from(k * k)));
    let found = calibrate(Seen::Events(&presses), Seen::Events(&presses[3..4]), 1.0).unwrap();
    assert_eq!((found.events, found.is_trustworthy()), (1, false));
}

#[test]
fn values_that_are_not_finite_are_ignored() {
    let (times, mut values) = ringing(&later(0.08), 100.0);
    for (place, value) in values.iter_mut().enumerate().skip(20).step_by(97) {
        *value = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY][place % 3];
    }
    let seen = Seen::Samples { times: &times, values: &values };
    let found = calibrate(Seen::Events(&stamps(TAPS)), seen, 1.0).unwrap();
    assert!((found.lag_secs - 0.08).abs() < 0.01, "{found:?}");
}

#[test]
fn students_quantiles_are_those_of_the_tables() {
    for (freedom, quantile) in [(1, 12.706), (9, 2.262), (10, 2.228), (30, 2.042), (1000, 1.962)] {
        assert!((student_t(freedom) - quantile).abs() < 0.003, "{freedom}");
    }
}

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![any::<f64>(), -10.0..10.0, Just(f64::MAX), Just(f64::MIN), Just(f64::NAN)]
}

fn any_time() -> impl Strategy<Value = i64> {
    prop_oneof![any::<i64>(), 0..5_000_000_000_i64, Just(i64::MAX), Just(i64::MIN), Just(7)]
}

proptest! {
    #[test]
    fn absurd_input_is_answered_with_numbers_or_an_error(
        reference in prop::collection::vec(any_time(), 0..40),
        times in prop::collection::vec(any_time(), 0..60),
        values in prop::collection::vec(any_number(), 0..200),
        max_lag_secs in any_number(),
    ) {
        let seen = Seen::Samples { times: &times, values: &values };
        for (a, b) in [(Seen::Events(&reference), seen), (seen, Seen::Events(&reference)), (seen, seen)] {
            if let Ok(found) = calibrate(a, b, max_lag_secs) {
                prop_assert!(found.lag_secs.abs() <= LONGEST_LAG_SECS + 1.0);
                prop_assert!(found.uncertainty_secs >= 0.0);
                prop_assert!((0.0..=1.0).contains(&found.correlation));
            }
        }
    }
}
