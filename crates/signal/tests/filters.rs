//! Filters against SciPy.

#![expect(clippy::unwrap_used, reason = "a test")]

#[expect(
    clippy::approx_constant,
    clippy::type_complexity,
    clippy::unreadable_literal,
    reason = "printed by a script"
)]
#[path = "golden/filters.rs"]
mod golden;

use teampulse_signal::error::SignalError;
use teampulse_signal::filter::butterworth::{band_pass, band_stop, high_pass, low_pass};
use teampulse_signal::filter::{Cascade, Design, notch, zero_phase};

/// Exact in binary, so that SciPy had the very same.
fn signal() -> Vec<f64> {
    (0..200u32).map(|k| f64::from(k * 7919 % 1000) / 500.0 - 1.0 + f64::from(k) / 100.0).collect()
}

fn band() -> Design {
    band_pass(3, 0.5, 8.0, 64.0).unwrap()
}

fn assert_close(ours: f64, theirs: f64, tolerance: f64, what: &str) {
    assert!((ours - theirs).abs() <= tolerance, "{what}: {ours} {theirs}");
}

fn assert_every_twentieth(ours: &[f64], theirs: &[f64]) {
    for (ours, theirs) in ours.iter().step_by(20).zip(theirs) {
        assert_close(*ours, *theirs, 1e-12, "sample");
    }
}

fn designed(name: &str) -> Result<Design, SignalError> {
    match name {
        "low_pass(2, 40.0, 250.0)" => low_pass(2, 40.0, 250.0),
        "low_pass(5, 3.0, 128.0)" => low_pass(5, 3.0, 128.0),
        "low_pass(1, 0.4, 4.0)" => low_pass(1, 0.4, 4.0),
        "high_pass(5, 0.5, 130.0)" => high_pass(5, 0.5, 130.0),
        "high_pass(2, 0.05, 4.0)" => high_pass(2, 0.05, 4.0),
        "high_pass(4, 20.0, 1000.0)" => high_pass(4, 20.0, 1000.0),
        "band_pass(1, 5.0, 15.0, 360.0)" => band_pass(1, 5.0, 15.0, 360.0),
        "band_pass(3, 0.5, 8.0, 64.0)" => band_pass(3, 0.5, 8.0, 64.0),
        "band_pass(3, 1.0, 90.0, 200.0)" => band_pass(3, 1.0, 90.0, 200.0),
        "band_pass(4, 20.0, 95.0, 200.0)" => band_pass(4, 20.0, 95.0, 200.0),
        "band_pass(2, 0.1, 0.35, 50.0)" => band_pass(2, 0.1, 0.35, 50.0),
        "band_stop(2, 48.0, 52.0, 250.0)" => band_stop(2, 48.0, 52.0, 250.0),
        "band_stop(3, 45.0, 55.0, 1000.0)" => band_stop(3, 45.0, 55.0, 1000.0),
        "band_stop(1, 0.2, 20.0, 100.0)" => band_stop(1, 0.2, 20.0, 100.0),
        _ => panic!("{name} is not known"),
    }
}

#[test]
fn butterworth_designs_have_scipys_coefficients() {
    for (name, theirs) in golden::BUTTERWORTH {
        let design = designed(name).unwrap();
        assert_eq!(design.sections().len(), theirs.len(), "{name}");
        for (section, (b, a)) in design.sections().iter().zip(*theirs) {
            let ours = section.b.iter().chain(&section.a);
            for (ours, theirs) in ours.zip(b.iter().chain(a)) {
                assert_close(*ours, *theirs, 1e-10, name);
            }
        }
    }
}

#[test]
fn a_notch_has_scipys_coefficients() {
    let section = notch(50.0, 30.0, 250.0).unwrap().sections()[0];
    for (ours, theirs) in section.b.iter().zip(golden::NOTCH.0) {
        assert_close(*ours, theirs, 1e-14, "b");
    }
    for (ours, theirs) in section.a.iter().zip(golden::NOTCH.1) {
        assert_close(*ours, theirs, 1e-14, "a");
    }
}

#[test]
fn a_cascade_gives_scipys_samples_and_states() {
    let (mut at_rest, mut settled) = (signal(), signal());
    Cascade::at_rest(&band()).filter(&mut at_rest);
    assert_every_twentieth(&at_rest, golden::AT_REST);
    let mut cascade = Cascade::settled(&band());
    cascade.filter(&mut settled);
    assert_every_twentieth(&settled, golden::FROM_SETTLED);
    assert_states(&cascade, golden::LAST_STATES);
    cascade.settle(1.0);
    assert_states(&cascade, golden::SETTLED);
}

fn assert_states(cascade: &Cascade, theirs: &[[f64; 2]]) {
    for (ours, theirs) in cascade.states().zip(theirs) {
        assert_close(ours[0], theirs[0], 1e-12, "state");
        assert_close(ours[1], theirs[1], 1e-12, "state");
    }
}

#[test]
fn zero_phase_gives_scipys_samples() {
    assert_every_twentieth(&zero_phase(&band(), &signal()).unwrap(), golden::ZERO_PHASE);
    let first_order = low_pass(1, 0.4, 4.0).unwrap();
    let ours = zero_phase(&first_order, &signal()).unwrap();
    assert_every_twentieth(&ours, golden::ZERO_PHASE_FIRST_ORDER);
}

#[test]
fn group_delay_and_gain_are_scipys() {
    for [frequency_hz, delay_samples, gain] in golden::RESPONSE {
        let design = band();
        // SciPy's delay of 32 samples at 0.7 Hz is 2e-9 off; ours agrees with 80-bit arithmetic.
        let delay = design.group_delay_secs(*frequency_hz) * 64.0;
        assert_close(delay, *delay_samples, 1e-8, "delay");
        assert_close(design.gain(*frequency_hz), *gain, 1e-12, "gain");
    }
}
