use teampulse_core::data::{EventKind, FeatureValues, Reason};
use teampulse_core::stream::{Signal, Stream};

use super::BatteryUse;
use crate::drive::{Drive, built, plain};

const USE: &str = "/r1/battery_state/use/w30";
const NOTES: &str = "/r1/battery_state/notes";

/// A stream with voltage, current, percentage, charge, capacity and status.
fn battery_state() -> Stream {
    plain(
        "/r1/battery_state",
        Signal::Battery,
        &[
            ("voltage", "V"),
            ("current", "A"),
            ("percentage", "1"),
            ("charge", "Ah"),
            ("capacity", "Ah"),
            ("power_supply_status", "1"),
        ],
    )
}

fn one_number(unit: &str) -> Stream {
    plain("/r1/battery_state", Signal::Battery, &[("data", unit)])
}

fn drive(stream: &Stream) -> Drive {
    Drive::new(built::<BatteryUse>("").as_ref(), stream)
}

/// Feeds the numbers of each time, twice a second for `secs`.
fn fed<const N: usize>(stream: &Stream, secs: u32, numbers: impl Fn(f64) -> [f64; N]) -> Drive {
    let mut drive = drive(stream);
    for k in 0..=2 * secs {
        let secs = f64::from(k) / 2.0;
        drive.at(secs, &numbers(secs));
    }
    drive.until(f64::from(secs));
    drive
}

fn close(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{found}, not {expected}");
}

fn is_ok(window: &FeatureValues) -> bool {
    window.reasons.iter().all(|reason| *reason == Reason::Ok)
}

const NAN: f64 = f64::NAN;

#[test]
fn a_standard_battery_gives_power_loss_and_time_left() {
    let mut drive = fed(&battery_state(), 60, |t| [12.0, -2.0, 0.5 - t / 6000.0, NAN, NAN, 2.0]);
    let window = drive.last(USE);
    assert!(is_ok(&window), "{window:?}");
    assert_eq!(window.values[0], 24.0);
    close(window.values[1], 1.0, 1e-6);
    close(window.values[2], 49.0 * 60.0, 1e-6);
    close(window.values[3], 0.4925, 1e-3);
    assert_eq!((window.coverage, window.quality), (1.0, 1.0));
    assert_eq!(drive.labels(NOTES), ["/r1/battery_state: power from voltage × current"]);
}

#[test]
fn a_driver_that_counts_to_a_hundred_is_recognised_and_said_once() {
    let mut drive = fed(&battery_state(), 60, |t| [12.0, -2.0, 50.0 - t / 60.0, NAN, NAN, 2.0]);
    close(drive.last(USE).values[1], 1.0, 1e-6);
    let events = drive.events(NOTES);
    let faults: Vec<_> = events.iter().filter(|(_, e)| e.kind == EventKind::Fault).collect();
    assert_eq!(faults.len(), 1);
    assert_eq!(faults[0].1.label, "/r1/battery_state: percentage is given as 0–100");
}

#[test]
fn one_wild_percentage_is_not_a_convention() {
    let mut drive = fed(&battery_state(), 60, |t| {
        let wild = if t == 20.0 { 65.0 } else { 0.5 - t / 6000.0 };
        [12.0, -2.0, wild, NAN, NAN, 2.0]
    });
    close(drive.last(USE).values[1], 1.0, 0.02);
    assert_eq!(drive.labels(NOTES).len(), 1);
}

#[test]
fn a_positive_discharge_current_is_recognised_by_the_status() {
    let mut drive = fed(&battery_state(), 40, |_| [12.0, 2.0, 0.5, NAN, NAN, 2.0]);
    assert_eq!(drive.last(USE).values[0], 24.0);
    let label = "/r1/battery_state: current is positive while discharging".to_owned();
    assert!(drive.labels(NOTES).contains(&label));
}

#[test]
fn a_positive_discharge_current_is_recognised_by_a_falling_charge() {
    let mut drive = fed(&battery_state(), 60, |t| [12.0, 2.0, 0.5 - t / 6000.0, NAN, NAN, 0.0]);
    assert_eq!(drive.last(USE).values[0], 24.0);
    let label = "/r1/battery_state: current is positive while discharging".to_owned();
    assert!(drive.labels(NOTES).contains(&label));
}

#[test]
fn a_current_that_swings_both_ways_has_no_direction() {
    let mut drive = fed(&battery_state(), 60, |t| {
        let current_a = if (t * 2.0) % 5.0 < 3.0 { 2.0 } else { -2.0 };
        [12.0, current_a, 0.5, NAN, NAN, 2.0]
    });
    assert_eq!(drive.last(USE).values[0], 24.0);
    assert_eq!(drive.labels(NOTES), ["/r1/battery_state: power from voltage × current"]);
}

#[test]
fn a_current_that_is_seldom_given_does_not_stand_for_the_window() {
    let mut drive = fed(&battery_state(), 60, |t| {
        let current_a = if t % 2.0 == 0.0 { -9.0 } else { NAN };
        [10.0, current_a, 0.5 - t / 3600.0, NAN, 2.0, 2.0]
    });
    close(drive.last(USE).values[0], 20.0, 1e-6);
}

#[test]
fn a_loss_within_its_uncertainty_does_not_give_when_the_battery_is_empty() {
    let mut drive = fed(&battery_state(), 60, |t| {
        let noise = 0.01 * ((t * 7.3).sin() + (t * 12.9).sin());
        [12.0, -2.0, 0.5 - t * 2.5e-4 + noise, NAN, NAN, 2.0]
    });
    let window = drive.last(USE);
    assert!(window.values[1] > 0.0 && window.values[1] < 2.0 * window.sigmas[1], "{window:?}");
    assert_eq!(window.reasons[2], Reason::Undefined);
}

#[test]
fn the_time_left_is_as_uncertain_as_the_loss() {
    let window = fed(&one_number("%"), 60, |t| [(70.0 - t / 12.0).floor()]).last(USE);
    assert!(window.sigmas[2] > 0.0);
    close(window.sigmas[2] / window.values[2], window.sigmas[1] / window.values[1], 1e-9);
}

#[test]
fn powers_that_no_robot_has_are_left_out() {
    let window = fed(&one_number("W"), 60, |_| [1e12]).last(USE);
    assert_eq!(window.reasons, [Reason::Missing; 4]);
}

#[test]
fn a_charging_battery_gives_negative_use_and_is_never_empty() {
    let mut drive = fed(&battery_state(), 60, |t| [12.0, 2.0, 0.5 + t / 6000.0, NAN, NAN, 1.0]);
    let window = drive.last(USE);
    assert_eq!(window.values[0], -24.0);
    close(window.values[1], -1.0, 1e-6);
    assert_eq!(window.reasons[2], Reason::Undefined);
    assert_eq!(drive.labels(NOTES).len(), 1);
}

#[test]
fn joules_give_power_and_time_left_and_no_percent() {
    let mut drive = fed(&one_number("J"), 60, |t| [1000.0 - 10.0 * t]);
    let window = drive.last(USE);
    close(window.values[0], 10.0, 1e-9);
    close(window.values[2], 40.0, 1e-9);
    assert_eq!(window.reasons[1], Reason::Missing);
    assert_eq!(drive.labels(NOTES), ["/r1/battery_state: power from the loss of energy"]);
}

#[test]
fn an_energy_that_never_moved_says_nothing() {
    let window = fed(&one_number("J"), 60, |_| [1000.0]).last(USE);
    assert_eq!(
        window.reasons,
        [Reason::Undefined, Reason::Missing, Reason::Undefined, Reason::Missing]
    );
}

#[test]
fn percent_times_capacity_times_voltage_is_power_where_no_current_is_given() {
    let window =
        fed(&battery_state(), 60, |t| [10.0, NAN, 0.5 - t / 3600.0, NAN, 2.0, 2.0]).last(USE);
    close(window.values[0], 20.0, 1e-6);
}

#[test]
fn a_charge_counter_with_its_capacity_is_a_fraction() {
    let window =
        fed(&battery_state(), 60, |t| [10.0, NAN, NAN, 1.0 - t / 3600.0, 2.0, 0.0]).last(USE);
    close(window.values[0], 10.0, 1e-6);
    close(window.values[1], 100.0 / 120.0, 1e-6);
}

#[test]
fn a_percentage_in_whole_percents_is_uncertain_and_says_so() {
    let truth = 0.8;
    let mut drive = fed(&one_number("%"), 60, |t| [(70.0 - truth * t / 60.0).floor()]);
    for (secs, window) in drive.features(USE).into_iter().filter(|(secs, _)| *secs > 31.0) {
        let error = (window.values[1] - truth).abs();
        assert!(error < 2.5 * window.sigmas[1], "{secs} s: {window:?}");
    }
    assert_eq!(drive.last(USE).reasons[2], Reason::Undefined);
}

#[test]
fn watts_are_taken_as_given() {
    let window = fed(&one_number("W"), 40, |t| [if t == 30.0 { 1e9 } else { 15.0 }]).last(USE);
    assert_eq!(window.values[0], 15.0);
    assert_eq!(window.reasons[1..], [Reason::Missing; 3]);
}

#[test]
fn a_voltage_alone_says_nothing_about_use() {
    assert!(!built::<BatteryUse>("").accepts(&one_number("V")));
}

#[test]
fn a_current_that_a_driver_left_at_zero_is_not_measured() {
    let window =
        fed(&battery_state(), 60, |t| [10.0, 0.0, 0.5 - t / 3600.0, 0.0, 2.0, 2.0]).last(USE);
    close(window.values[0], 20.0, 1e-6);
    let window = fed(&battery_state(), 60, |_| [10.0, 0.0, NAN, 0.0, 0.0, 0.0]).last(USE);
    assert_eq!(window.reasons[1], Reason::Missing);
    assert!(window.values[0].is_nan());
}

#[test]
fn unmeasured_is_missing() {
    let window = fed(&battery_state(), 60, |_| [12.0, NAN, NAN, NAN, NAN, 0.0]).last(USE);
    assert_eq!(window.reasons, [Reason::Missing; 4]);
    assert_eq!(window.quality, 0.0);
}

#[test]
fn a_new_battery_is_short_and_a_silent_one_has_a_gap() {
    let mut drive = fed(&one_number("J"), 60, |t| [1000.0 - t]);
    drive.until(100.0);
    let windows = drive.features(USE);
    assert_eq!(windows[3].1.reasons, [Reason::Short; 4]);
    assert_eq!(windows.last().unwrap().1.reasons, [Reason::Gap; 4]);
}

#[test]
fn a_hop_is_a_whole_second() {
    let mut drive = fed(&one_number("J"), 20, |t| [1000.0 - t]);
    let ends: Vec<f64> = drive.features(USE).into_iter().map(|(end, _)| end).collect();
    assert_eq!(ends, (1..=20).map(f64::from).collect::<Vec<_>>());
}

#[test]
fn late_samples_give_what_timely_ones_give() {
    let joules = |secs: f64| 1000.0 - secs * (secs / 7.0).sin();
    let mut timely = drive(&one_number("J"));
    let mut late = drive(&one_number("J"));
    (0..40).map(f64::from).for_each(|secs| timely.at(secs, &[joules(secs)]));
    (0..40).step_by(2).map(f64::from).for_each(|secs| late.at(secs, &[joules(secs)]));
    (1..40).step_by(2).map(f64::from).for_each(|secs| late.late(secs, &[joules(secs)]));
    timely.until(40.0);
    late.until(40.0);
    assert_eq!(timely.last(USE).values[0], late.last(USE).values[0]);
}
