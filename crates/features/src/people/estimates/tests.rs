//! Laws of estimates, on states and reports in any order.

use std::sync::Arc;

use proptest::prelude::*;
use teampulse_core::data::{EventKind, FeatureValues, Reason};
use teampulse_core::session_streams::{END, session_events};
use teampulse_core::stream::{Channel, Window};

use super::*;
use crate::drive::{Drive, built};

const EVENTS: StreamId = StreamId(0);
const REPORTS: StreamId = StreamId(1);
const STATES: StreamId = StreamId(2);
const W30: &str = "/humans/persons/p1/estimates/w30";
const WHOLE: &str = "/humans/persons/p1/estimates/phases";
const MEASURES: [&str; 5] =
    ["heart_rate", "ln_rmssd", "breathing_rate", "skin_level", "response_rate"];
const WORKLOAD: usize = 0;
const OF_BODY: usize = 1;
const OF_REPORT: usize = 2;
const AROUSAL: usize = 3;

fn person(id: &str) -> Subject {
    Subject { about: About::Person, id: id.into() }
}

fn reports(id: &str) -> Stream {
    Stream::raw(format!("/humans/persons/{id}/task/reports"), person(id), Shape::Event)
}

fn states(window: Window) -> Stream {
    let name = "/humans/persons/p1/state";
    let stream = Stream::concluded(name, person("p1"), "state", Shape::Feature).over(window);
    let channel = |name: String| Channel::new(name, "1");
    let kinds = |measure: &&str| ["z", "robust_z"].map(|kind| channel(format!("{measure}_{kind}")));
    let channels = MEASURES.iter().flat_map(kinds).collect();
    Stream { channels, ..stream }
}

/// A state with these z values of each measure; NaN is a gap.
fn state(secs: f64, z: [f64; 5]) -> Data {
    let values: Vec<f64> = z.iter().flat_map(|&z| [z, z]).collect();
    Data::Feature(Arc::new(FeatureValues {
        window_secs: secs,
        coverage: 1.0,
        quality: 1.0,
        sigmas: vec![0.5; values.len()],
        reasons: values.iter().map(|z| if z.is_nan() { Reason::Gap } else { Reason::Ok }).collect(),
        values,
    }))
}

const HARD: [f64; 5] = [6.0, -6.0, 6.0, 6.0, 6.0];
const CALM: [f64; 5] = [0.0; 5];

fn event(kind: EventKind, label: &str, value: f64) -> Data {
    let label = label.to_owned();
    Data::Event(Arc::new(Event { kind, label, value, duration_secs: f64::NAN }))
}

fn begun() -> Drive {
    let mut drive = Drive::new(built::<Estimates>("").as_ref(), &session_events());
    drive.join(REPORTS, &reports("p1"));
    drive
}

fn with_body() -> Drive {
    let mut drive = begun();
    drive.join(STATES, &states(Window::of_secs(30.0)));
    drive
}

fn phase(drive: &mut Drive, secs: f64, label: &str) {
    drive.take_on(EVENTS, secs, event(EventKind::Phase, label, f64::NAN));
}

fn report(drive: &mut Drive, secs: f64, isa: f64) {
    drive.take_on(REPORTS, secs, event(EventKind::Report, "isa", isa));
}

fn has_values(drive: &Drive, name: &str) -> bool {
    drive.outputs().iter().any(|stream| stream.name == name)
}

#[test]
fn without_a_body_and_without_a_report_nothing_is_estimated() {
    let mut drive = begun();
    phase(&mut drive, 0.0, "baseline");
    phase(&mut drive, 60.0, "task");
    drive.until(200.0);
    assert!(drive.outputs().is_empty());
}

#[test]
fn a_body_alone_gives_an_estimate() {
    let mut drive = with_body();
    drive.take_on(STATES, 100.0, state(30.0, CALM));
    drive.take_on(STATES, 101.0, state(30.0, HARD));
    let windows = drive.features(W30);
    let [calm, hard] = [&windows[0].1, &windows[1].1];
    assert_eq!((calm.values[WORKLOAD], calm.values[AROUSAL]), (0.0, 0.0));
    assert!(hard.values[WORKLOAD] > 0.5 && hard.values[AROUSAL] > 0.5);
    assert_eq!(hard.values[WORKLOAD], hard.values[OF_BODY]);
    assert_eq!(hard.reasons[OF_REPORT], Reason::Nothing);
    assert!(hard.sigmas[WORKLOAD] > 0.2 && hard.sigmas[AROUSAL] > hard.sigmas[WORKLOAD]);
}

#[test]
fn a_report_off_the_scale_is_a_fault_that_is_reported_once() {
    let mut drive = begun();
    for (secs, isa) in [(10.0, 3.0), (20.0, 7.0), (30.0, 0.0), (40.0, f64::NAN)] {
        report(&mut drive, secs, isa);
    }
    let faults = drive.events("/humans/persons/p1/reports/faults");
    let [(secs, fault)] = &faults[..] else { panic!("{faults:?}") };
    assert_eq!((*secs, fault.kind), (20.0, EventKind::Fault));
    assert_eq!(
        fault.label,
        "ISA 7 is not used: report the workload as a value from 1 (idle) to 5 (too much)"
    );
    drive.take_on(EVENTS, 50.0, event(EventKind::Report, "isa p1", 80.0));
    assert_eq!(drive.events("/humans/persons/p1/reports/faults").len(), 1);
}

#[test]
fn a_report_about_nobody_is_a_fault_that_is_reported_once() {
    let first = |people: &[&str], label: &str| {
        let mut drive = Drive::new(built::<Estimates>("").as_ref(), &session_events());
        for (place, id) in (1..).zip(people) {
            drive.join(StreamId(place), &reports(id));
        }
        for secs in [10.0, 20.0] {
            drive.take_on(EVENTS, secs, event(EventKind::Report, label, 3.0));
        }
        let faults = drive.events("/session/reports/faults");
        let [(10.0, fault)] = &faults[..] else { panic!("{faults:?}") };
        assert_eq!(fault.kind, EventKind::Fault);
        fault.label.split(": ").next().map(str::to_owned).unwrap()
    };
    let unknown = |id| format!("ISA of {id} is not used, as nobody of that name is known");
    assert_eq!(first(&["p1"], "isa p009"), unknown("p009"));
    assert_eq!(first(&["p1"], "isa P1"), unknown("P1"));
    assert_eq!(
        first(&["p1", "p2"], "isa"),
        "ISA without a name is not used, as there are 2 people"
    );
    assert_eq!(first(&[], "isa"), "ISA without a name is not used, as nobody is known yet");
}

#[test]
fn a_report_that_is_not_a_number_is_not_called_off_the_scale() {
    assert!(output::off_scale(f64::NAN).starts_with("ISA that is not a number is not used"));
    assert!(output::off_scale(f64::INFINITY).starts_with("ISA inf is not used"));
}

#[test]
fn a_report_alone_gives_an_estimate_whose_sigma_grows_with_its_age() {
    let mut drive = begun();
    report(&mut drive, 10.5, 4.0);
    drive.until(131.0);
    let windows = drive.features(W30);
    assert_eq!(windows.len(), 121);
    assert!(windows.iter().all(|(_, values)| values.values[WORKLOAD] == 0.75));
    assert!(windows.is_sorted_by(|(_, a), (_, b)| a.sigmas[WORKLOAD] < b.sigmas[WORKLOAD]));
    let doubled = (windows[120].1.sigmas[WORKLOAD] / windows[0].1.sigmas[WORKLOAD]).powi(2);
    assert!((doubled - 2.0).abs() < 0.01, "{doubled}");
    assert!(windows.iter().all(|(_, values)| values.reasons[AROUSAL] == Reason::Missing));
}

#[test]
fn a_body_that_is_measured_lacks_a_baseline_until_there_is_a_state() {
    let mut drive = begun();
    let windows = |name: (&str, &str), channel| {
        let (input, family) = name;
        let input = Stream::raw(format!("/humans/persons/p1/{input}"), person("p1"), Shape::Wave);
        let stream = Stream::derived(&input, family, Shape::Feature).over(Window::of_secs(30.0));
        stream.with_channels(&[(channel, "1/min")])
    };
    phase(&mut drive, 0.0, "baseline");
    report(&mut drive, 10.0, 2.0);
    let mut reasons = |place: u32, secs, name, channel| {
        drive.join(StreamId(place), &windows(name, channel));
        drive.until(secs);
        let window = drive.last(W30);
        [WORKLOAD, OF_BODY, OF_REPORT, AROUSAL].map(|place| window.reasons[place])
    };
    let (is, lacks, not) = (Reason::Ok, Reason::NoBaseline, Reason::Missing);
    assert_eq!(reasons(5, 12.0, ("strap/ecg", "heart"), "HRV_MeanHR"), [is, lacks, is, not]);
    assert_eq!(reasons(6, 14.0, ("wrist/eda", "skin"), "EDA_Tonic_Mean"), [is, lacks, is, lacks]);
    phase(&mut drive, 60.0, "task");
    drive.until(90.0);
    let whole = drive.last(WHOLE);
    assert_eq!([OF_BODY, AROUSAL].map(|place| whole.reasons[place]), [lacks, lacks]);
}

#[test]
fn body_and_report_are_weighted_by_their_sigmas() {
    let mut drive = with_body();
    report(&mut drive, 99.0, 2.0);
    drive.take_on(STATES, 100.0, state(30.0, HARD));
    let window = drive.last(W30);
    let [both, body, report] = [WORKLOAD, OF_BODY, OF_REPORT].map(|place| window.values[place]);
    assert!(report < both && both < body);
    // The report is fresh, the body never surer than a fresh report.
    assert!(both - report < body - both);
}

#[test]
fn a_body_that_is_no_longer_known_leaves_the_report() {
    let mut drive = with_body();
    report(&mut drive, 99.0, 2.0);
    drive.take_on(STATES, 100.0, state(30.0, [f64::NAN; 5]));
    let window = drive.last(W30);
    assert_eq!((window.values[WORKLOAD], window.reasons[OF_BODY]), (0.25, Reason::Gap));
    drive.take_on(STATES, 101.0, state(30.0, [6.0, f64::NAN, f64::NAN, f64::NAN, 6.0]));
    assert!(drive.last(W30).sigmas[OF_BODY] > 0.5);
}

#[test]
fn each_second_is_reported_once_when_a_body_comes_to_reports() {
    let mut drive = begun();
    report(&mut drive, 10.0, 3.0);
    drive.until(20.0);
    drive.join(STATES, &states(Window::of_secs(30.0)));
    drive.take_on(STATES, 20.0, state(30.0, CALM));
    drive.take_on(STATES, 21.0, state(30.0, CALM));
    let secs: Vec<f64> = drive.features(W30).into_iter().map(|(secs, _)| secs).collect();
    assert!(secs.is_sorted_by(|a, b| a + 1.0 == *b), "{secs:?}");
}

#[test]
fn a_phase_is_reported_with_the_report_at_its_end() {
    let mut drive = with_body();
    drive.join(StreamId(3), &states(Window::Phases));
    phase(&mut drive, 0.0, "baseline");
    phase(&mut drive, 60.0, "task");
    phase(&mut drive, 120.0, "rest");
    drive.take_on(StreamId(3), 120.0, state(60.0, HARD));
    report(&mut drive, 123.0, 5.0);
    drive.until(132.0);
    let windows = drive.features(WHOLE);
    // The baseline has neither a state nor a report.
    assert_eq!(windows.len(), 1);
    assert_eq!((windows[0].0, windows[0].1.window_secs), (120.0, 60.0));
    assert_eq!(windows[0].1.values[OF_REPORT], 1.0);
    assert!(windows[0].1.reasons.iter().all(|reason| *reason == Reason::Ok));
}

#[test]
fn a_phase_is_reported_with_the_newest_report_that_counts_for_it() {
    let of_report = |secs: f64| {
        let mut drive = with_body();
        drive.join(StreamId(3), &states(Window::Phases));
        phase(&mut drive, 60.0, "task");
        phase(&mut drive, 120.0, "rest");
        drive.take_on(StreamId(3), 120.0, state(60.0, HARD));
        report(&mut drive, 120.0, 5.0);
        drive.until(secs);
        report(&mut drive, secs, 4.0);
        drive.until(135.0);
        drive.last(WHOLE).values[OF_REPORT]
    };
    assert_eq!([124.8, 129.9, 130.0, 134.0].map(of_report), [0.75, 0.75, 1.0, 1.0]);
}

#[test]
fn a_phase_without_a_report_waits_for_it_and_is_reported_without() {
    let mut drive = with_body();
    drive.join(StreamId(3), &states(Window::Phases));
    phase(&mut drive, 60.0, "task");
    phase(&mut drive, 120.0, "rest");
    drive.take_on(StreamId(3), 120.0, state(60.0, HARD));
    drive.until(130.0);
    assert!(!has_values(&drive, WHOLE));
    drive.until(140.0);
    assert_eq!(drive.last(WHOLE).reasons[OF_REPORT], Reason::Nothing);
}

#[test]
fn the_last_phase_is_reported_as_the_session_ends() {
    let mut drive = with_body();
    drive.join(StreamId(3), &states(Window::Phases));
    phase(&mut drive, 60.0, "task");
    drive.take_on(EVENTS, 120.0, event(EventKind::Clock, END, f64::NAN));
    drive.take_on(StreamId(3), 120.0, state(60.0, HARD));
    assert_eq!(drive.features(WHOLE).len(), 1);
}

#[test]
fn a_report_on_the_session_s_events_names_whom_it_is_about() {
    let counts_for_p1 = |people: &[&str], label: &str| {
        let mut drive = Drive::new(built::<Estimates>("").as_ref(), &session_events());
        for (place, id) in (1..).zip(people) {
            drive.join(StreamId(place), &reports(id));
        }
        drive.take_on(EVENTS, 10.0, event(EventKind::Report, label, 3.0));
        drive.until(20.0);
        has_values(&drive, W30)
    };
    assert!(counts_for_p1(&["p1"], "isa"));
    assert!(counts_for_p1(&["p1", "p2"], "isa p1"));
    assert!(!counts_for_p1(&["p1", "p2"], "isa"));
    assert!(!counts_for_p1(&["p1", "p2"], "isa p2"));
    assert!(!counts_for_p1(&["p1"], "tired"));
}

#[test]
fn every_estimate_names_all_of_its_inputs() {
    let mut drive = with_body();
    phase(&mut drive, 0.0, "task");
    drive.take_on(STATES, 10.0, state(30.0, CALM));
    report(&mut drive, 10.5, 3.0);
    drive.take_on(STATES, 11.0, state(30.0, CALM));
    let inputs = &drive.outputs()[0].inputs;
    assert_eq!(
        *inputs,
        [states(Window::of_secs(30.0)).name, reports("p1").name, session_events().name]
    );
    assert!(drive.outputs()[0].doc.contains("not a measurement"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn whatever_comes_an_estimate_is_sound(
        z in prop::collection::vec(prop::array::uniform5(prop::num::f64::ANY), 20),
        isa in prop::num::f64::ANY,
    ) {
        let mut drive = with_body();
        report(&mut drive, 5.0, isa);
        for (secs, z) in (1_u32..).zip(z) {
            drive.take_on(STATES, f64::from(secs), state(30.0, z.map(|z| if z.is_finite() { z } else { f64::NAN })));
        }
        for (_, window) in drive.features(W30) {
            for (place, value) in window.values.iter().enumerate() {
                prop_assert_eq!(value.is_nan(), window.reasons[place] != Reason::Ok);
                prop_assert!(value.is_nan() || (0.0..=1.0).contains(value));
                prop_assert!(value.is_nan() || window.sigmas[place] >= 0.14);
            }
        }
    }
}
