//! Laws of acceleration's values, and they themselves against plain formulas.

#[expect(clippy::unreadable_literal, reason = "printed by a script")]
#[path = "golden/acceleration.rs"]
mod golden;

use proptest::prelude::*;
use teampulse_signal::acceleration::Unit;
use teampulse_signal::acceleration::analysis::{Settings, causal, whole};
use teampulse_signal::analysis::{Causal, Measured, Reason, Recording, Span, Windows};

/// As the golden script makes it.
fn movement(count: i64) -> Vec<Vec<f64>> {
    let loud = |k: i64| if k / 160 % 2 == 1 { 1.0 } else { 0.05 };
    let axis = |level: f64, a: i64, b: i64| {
        let noise = move |k: i64| (k * k * a % 977 * 31 % b) as f64 / b as f64 - 0.5;
        (0..count).map(move |k| level + loud(k) * noise(k)).collect()
    };
    vec![axis(0.1, 1, 1009), axis(0.0, 3, 1013), axis(0.95, 5, 1019)]
}

fn secs(begin: f64, end: f64) -> Span {
    Span { begin_ns: (begin * 1e9) as i64, end_ns: (end * 1e9) as i64 }
}

fn value(windows: &dyn Windows, measured: &Measured, name: &str) -> Result<f64, Reason> {
    let index = windows.values().iter().position(|value| value.name == name);
    measured.values[index.unwrap_or_else(|| panic!("no value {name}"))]
}

fn feed(analysis: &mut dyn Causal, channels: &[Vec<f64>], rate_hz: f64) {
    let length = channels.first().map_or(0, Vec::len);
    for sample in 0..length {
        let row: Vec<f64> = channels.iter().map(|channel| channel[sample]).collect();
        analysis.push((sample as f64 / rate_hz * 1e9).round() as i64, &row);
    }
}

#[test]
fn values_are_those_of_plain_formulas() {
    let channels = movement(32 * 23);
    let mut running = causal(&Settings::default(), 32.0).unwrap();
    feed(&mut *running, &channels, 32.0);
    let recording = Recording { rate_hz: 32.0, begin_ns: 0, channels: &channels };
    let all = whole(&Settings::default(), &recording).unwrap();
    let span = recording.span();
    let both: [(&dyn Windows, &str); 2] = [(&*running, "causal"), (&*all.windows, "whole")];
    for (windows, kind) in both {
        let measured = windows.measure(span);
        assert_eq!((measured.coverage, measured.quality), (1.0, 1.0));
        for (name, theirs) in golden::VALUES {
            let (name, of) = name.split_once(' ').unwrap_or((name, kind));
            // Motion of the whole recording stands elsewhere.
            if of != kind || (kind == "whole" && ["ACC_Motion", "ACC_Artefact"].contains(&name)) {
                continue;
            }
            let ours = value(windows, &measured, name).unwrap();
            // Relative.
            assert!((ours - theirs).abs() <= 1e-9 * theirs, "{kind} {name}: {ours} {theirs}");
        }
    }
}

#[test]
fn the_unit_does_not_matter() {
    let channels = movement(640);
    let span = secs(0.0, 20.0);
    let recording = Recording { rate_hz: 32.0, begin_ns: 0, channels: &channels };
    let in_g = whole(&Settings::default(), &recording).unwrap().windows.measure(span);
    for unit in [Unit::MetresPerSecondSquared, Unit::StepsPerG(64.0)] {
        let scaled = |axis: &Vec<f64>| axis.iter().map(|value| value * unit.one_g()).collect();
        let channels: Vec<Vec<f64>> = channels.iter().map(scaled).collect();
        let recording = Recording { rate_hz: 32.0, begin_ns: 0, channels: &channels };
        let settings = Settings { unit, ..Settings::default() };
        let measured = whole(&settings, &recording).unwrap().windows.measure(span);
        for (one, other) in measured.values.iter().zip(&in_g.values) {
            assert!((one.unwrap() - other.unwrap()).abs() < 1e-9);
        }
    }
}

#[test]
fn motion_is_flagged_where_it_is() {
    let channels = movement(640);
    let mut running = causal(&Settings::default(), 32.0).unwrap();
    feed(&mut *running, &channels, 32.0);
    let share = |begin: f64, end: f64| {
        value(&*running, &running.measure(secs(begin, end)), "ACC_Artefact").unwrap()
    };
    assert_eq!((share(1.0, 5.0), share(7.0, 10.0), share(12.0, 15.0)), (0.0, 1.0, 0.0));
}

#[test]
fn a_wrong_unit_is_too_poor_and_says_so() {
    let mut channels = movement(640);
    channels.iter_mut().flatten().for_each(|value| *value *= 64.0);
    let recording = Recording { rate_hz: 32.0, begin_ns: 0, channels: &channels };
    let all = whole(&Settings::default(), &recording).unwrap();
    let measured = all.windows.measure(recording.span());
    assert!(measured.quality < 0.1, "{}", measured.quality);
    assert_eq!(value(&*all.windows, &measured, "ACC_ENMO"), Err(Reason::Quality));
    assert!(value(&*all.windows, &measured, "ACC_Implausible").unwrap() > 0.9);
}

#[test]
fn at_rest_an_error_of_gain_is_no_activity() {
    let enmo = |gain: f64| {
        let wobble = |k: u32| gain + 0.01 * (f64::from(k * k % 97) / 97.0 - 0.5);
        let channels = [vec![0.0; 640], vec![0.0; 640], (0..640).map(wobble).collect()];
        let recording = Recording { rate_hz: 32.0, begin_ns: 0, channels: &channels };
        let all = whole(&Settings::default(), &recording).unwrap();
        value(&*all.windows, &all.windows.measure(recording.span()), "ACC_ENMO")
    };
    assert!(enmo(1.0).unwrap() < 0.005);
    assert_eq!(enmo(1.05), Err(Reason::Quality));
}

#[test]
fn an_axis_that_is_missing_leaves_nothing() {
    let mut channels = movement(640);
    channels[1].fill(f64::NAN);
    for channels in [&channels[..], &channels[..1], &[]] {
        let recording = Recording { rate_hz: 32.0, begin_ns: 0, channels };
        let all = whole(&Settings::default(), &recording).unwrap();
        let mut running = causal(&Settings::default(), 32.0).unwrap();
        feed(&mut *running, channels, 32.0);
        for windows in [&*all.windows as &dyn Windows, &*running] {
            let measured = windows.measure(secs(0.0, 20.0));
            assert_eq!((measured.coverage, measured.quality), (0.0, 0.0));
            assert!(measured.values.iter().all(|value| *value == Err(Reason::Gap)));
        }
    }
}

#[test]
fn settings_that_make_no_sense_are_refused() {
    let usual = Settings::default();
    for settings in [
        Settings { unit: Unit::StepsPerG(0.0), ..usual },
        Settings { unit: Unit::StepsPerG(f64::NAN), ..usual },
        Settings { artefact_g: f64::NAN, ..usual },
    ] {
        assert!(causal(&settings, 32.0).is_err());
    }
    for rate_hz in [0.0, 1e-9, 1e9, f64::NAN, f64::INFINITY] {
        assert!(causal(&usual, rate_hz).is_err());
        assert!(whole(&usual, &Recording { rate_hz, begin_ns: 0, channels: &[] }).is_err());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn no_input_gives_nonsense(
        axis in prop::collection::vec(prop_oneof![prop::num::f64::ANY, -2.0..2.0], 0..800),
        rate_hz in 8.0..200.0,
        begin in -1.0..5.0,
        length in prop_oneof![-1.0..20.0, Just(f64::INFINITY)],
    ) {
        let channels = [axis.clone(), axis.iter().rev().copied().collect(), axis];
        let mut running = causal(&Settings::default(), rate_hz).unwrap();
        feed(&mut *running, &channels, rate_hz);
        let recording = Recording { rate_hz, begin_ns: 0, channels: &channels };
        let all = whole(&Settings::default(), &recording).unwrap();
        let span = secs(begin, begin + length);
        for measured in [running.measure(span), all.windows.measure(span)] {
            prop_assert!((0.0..=1.0).contains(&measured.coverage));
            prop_assert!((0.0..=1.0).contains(&measured.quality));
            prop_assert_eq!(measured.values.len(), running.values().len());
            prop_assert!(measured.values.iter().flatten().all(|value| value.is_finite()));
        }
    }
}
