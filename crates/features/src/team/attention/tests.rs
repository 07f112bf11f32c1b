//! Laws of the team's attention.

use std::sync::Arc;

use proptest::prelude::*;
use teampulse_core::alerts::{Alert, Stage, Why};
use teampulse_core::data::{Event, EventKind, FeatureValues};

use super::*;
use crate::drive::{Drive, built};
use crate::value::moment;

const PERSON: StreamId = StreamId(0);
const ONLINE: StreamId = StreamId(1);
const OFFLINE: StreamId = StreamId(2);
const BATTERY: StreamId = StreamId(3);
const SHORT: StreamId = StreamId(4);
const STUCK: StreamId = StreamId(5);
const COMMANDS: StreamId = StreamId(6);
const LEVEL: StreamId = StreamId(7);

fn person() -> Stream {
    let subject = Subject { about: About::Person, id: "p001".to_owned() };
    Stream::raw("/humans/persons/p001/strap/ecg", subject, Shape::Wave)
}

fn of_robot(
    (input, family): (&str, &str),
    signal: Signal,
    shape: Shape,
    channels: &[(&str, &str)],
) -> Stream {
    let input = Stream::raw(input, Subject::robot("r1"), Shape::Sample);
    Stream { signal, ..Stream::derived(&input, family, shape).with_channels(channels) }
}

/// A team of a person and a robot, with everything that is reported about them.
fn drive() -> Drive {
    let feature = built::<Attention>("");
    let mut drive = Drive::new(feature.as_ref(), &person());
    let battery = [("empty_in_secs", "s"), ("fraction_left", "1")];
    let (events, windows) = (Shape::Event, Shape::Feature);
    let commands = Stream::raw("/r1/goal_pose", Subject::robot("r1"), Shape::Sample);
    for (id, stream) in [
        (
            ONLINE,
            of_robot(("/r1", "deployment"), Signal::Other, windows.clone(), &[("online", "1")]),
        ),
        (
            OFFLINE,
            of_robot(("/r1", "deployment"), Signal::Event, events.clone(), &[]).below("events"),
        ),
        (
            BATTERY,
            of_robot(("/r1/bat", "use"), Signal::Battery, windows.clone(), &battery).below("w60"),
        ),
        (
            SHORT,
            of_robot(("/r1/bat", "use"), Signal::Battery, windows.clone(), &battery).below("w30"),
        ),
        (STUCK, of_robot(("/r1/wifi", "stuck"), Signal::Event, events, &[])),
        (COMMANDS, Stream { signal: Signal::Input, ..commands }),
        (LEVEL, of_robot(("/r1/d", "level"), Signal::Diagnostics, windows, &[("level", "1")])),
    ] {
        assert!(feature.accepts(&stream), "{}", stream.name);
        drive.join(id, &stream);
    }
    drive
}

fn feature(values: &[f64]) -> Data {
    let reason = |value: &f64| if value.is_nan() { Reason::Undefined } else { Reason::Ok };
    Data::Feature(Arc::new(FeatureValues {
        window_secs: 30.0,
        coverage: 1.0,
        quality: 1.0,
        values: values.to_vec(),
        sigmas: Vec::new(),
        reasons: values.iter().map(reason).collect(),
    }))
}

fn event(kind: EventKind) -> Data {
    Data::Event(Arc::new(moment(kind, String::new())))
}

fn command(drive: &mut Drive, secs: f64) {
    drive.take_on(COMMANDS, secs, Data::Sample([].into()));
}

fn reported(drive: &mut Drive) -> Vec<(f64, String)> {
    drive.events(ALERTS).into_iter().map(|(at, event)| (at, event.label)).collect()
}

fn said(expected: &[(f64, &str)]) -> Vec<(f64, String)> {
    expected.iter().map(|(at, label)| (*at, (*label).to_owned())).collect()
}

const NEEDS: &str = "r1 needs someone: offline";
const ANSWERED: &str = "r1 was answered: offline";
const OVER: &str = "r1 no longer needs someone: offline";

#[test]
fn an_alert_is_raised_answered_and_over_each_reported_once() {
    let mut drive = drive();
    drive.take_on(OFFLINE, 10.0, event(EventKind::Fault));
    drive.take_on(OFFLINE, 11.0, event(EventKind::Fault));
    command(&mut drive, 14.5);
    command(&mut drive, 15.0);
    drive.take_on(OFFLINE, 30.0, event(EventKind::Marker));
    drive.take_on(OFFLINE, 31.0, event(EventKind::Marker));
    assert_eq!(reported(&mut drive), said(&[(10.0, NEEDS), (14.5, ANSWERED), (30.0, OVER)]));
    let events: Vec<Event> = drive.events(ALERTS).into_iter().map(|(_, event)| event).collect();
    assert_eq!(events[0].kind, EventKind::Fault);
    assert_eq!((events[1].kind, events[1].value), (EventKind::Marker, 4.5));
    assert_eq!((events[2].kind, events[2].duration_secs), (EventKind::Marker, 20.0));
}

proptest! {
    #[test]
    fn whatever_comes_an_alert_is_raised_then_answered_once_at_most_then_over(
        steps in prop::collection::vec((0u8..5, any::<bool>()), 0..60)
    ) {
        let mut drive = drive();
        for (secs, (what, needs)) in steps.into_iter().enumerate() {
            let kind = if needs { EventKind::Fault } else { EventKind::Marker };
            let battery = feature(&[if needs { 10.0 } else { 1e4 }, if needs { 0.1 } else { 0.9 }]);
            match what {
                0 => command(&mut drive, secs as f64),
                1 => drive.take_on(OFFLINE, secs as f64, event(kind)),
                2 => drive.take_on(STUCK, secs as f64, event(kind)),
                3 => drive.take_on(SHORT, secs as f64, battery),
                _ => drive.take_on(BATTERY, secs as f64, battery),
            }
        }
        let mut stages: BTreeMap<Why, Stage> = BTreeMap::new();
        for label in drive.labels(ALERTS) {
            let Alert { why, stage, .. } = Alert::read(&label).unwrap();
            let before = stages.insert(why, stage);
            let is_in_order = match stage {
                Stage::Raised => matches!(before, None | Some(Stage::Over)),
                Stage::Answered => before == Some(Stage::Raised),
                Stage::Over => matches!(before, Some(Stage::Raised | Stage::Answered)),
                Stage::Unknown => false,
            };
            prop_assert!(is_in_order, "{label}");
        }
    }
}

#[test]
fn a_command_before_an_alert_is_no_answer_to_it() {
    let mut drive = drive();
    command(&mut drive, 5.0);
    drive.take_on(OFFLINE, 10.0, event(EventKind::Fault));
    assert_eq!(reported(&mut drive), said(&[(10.0, NEEDS)]));
}

#[test]
fn the_oldest_unanswered_alert_counts() {
    let mut drive = drive();
    drive.take_on(STUCK, 10.0, event(EventKind::Fault));
    drive.take_on(OFFLINE, 20.0, event(EventKind::Fault));
    drive.until(30.1);
    assert_eq!(drive.last(STATE).values[3..], [1.0, 20.0], "one robot, two reasons");
    drive.take_on(STUCK, 35.0, event(EventKind::Marker));
    drive.until(40.1);
    assert_eq!(drive.last(STATE).values[3..], [1.0, 20.0]);
    command(&mut drive, 41.0);
    drive.until(45.1);
    assert_eq!(drive.last(STATE).values[3], 0.0);
    assert_eq!(drive.last(STATE).reasons[4], Reason::Nothing);
}

#[test]
fn an_alert_ends_only_clearly_beyond_its_limit_and_in_every_window() {
    let mut drive = drive();
    let charge = |drive: &mut Drive, id, secs, left| drive.take_on(id, secs, feature(&[1e4, left]));
    charge(&mut drive, SHORT, 10.0, 0.199);
    charge(&mut drive, BATTERY, 11.0, 0.201);
    charge(&mut drive, BATTERY, 12.0, 0.199);
    charge(&mut drive, SHORT, 13.0, 0.21);
    charge(&mut drive, SHORT, 14.0, 0.25);
    charge(&mut drive, BATTERY, 20.0, 0.25);
    let [raised, over] = ["needs someone", "no longer needs someone"]
        .map(|word| format!("r1 {word}: battery below 20 %"));
    assert_eq!(reported(&mut drive), said(&[(10.0, &raised), (20.0, &over)]));
}

#[test]
fn a_battery_with_an_unknown_time_left_needs_nobody() {
    let mut drive = drive();
    for (secs, empty_in_secs) in [(10.0, 250.0), (20.0, f64::NAN)] {
        drive.take_on(BATTERY, secs, feature(&[empty_in_secs, 0.5]));
    }
    let labels: Vec<String> = reported(&mut drive).into_iter().map(|(_, label)| label).collect();
    assert_eq!(labels[0], "r1 needs someone: battery empty within 5 min");
    assert_eq!(labels.len(), 2);
}

#[test]
fn diagnostics_need_someone_from_an_error_on() {
    let mut drive = drive();
    for (secs, level) in [(1.0, 1.0), (2.0, 2.0), (3.0, 3.0), (4.0, 0.0)] {
        drive.take_on(LEVEL, secs, feature(&[level]));
    }
    let at: Vec<f64> = reported(&mut drive).into_iter().map(|(at, _)| at).collect();
    assert_eq!(at, [2.0, 4.0]);
}

#[test]
fn robots_per_person_need_a_person() {
    let mut drive = drive();
    drive.until(2.1);
    let state = drive.last(STATE);
    assert_eq!((state.values[0], state.reasons[1]), (0.0, Reason::Missing));
    drive.take_on(ONLINE, 3.0, feature(&[1.0]));
    drive.until(4.1);
    assert_eq!(drive.last(STATE).reasons[2], Reason::Undefined, "one robot and nobody");
    drive.take_on(PERSON, 5.0, Data::Sample([0.0].into()));
    drive.until(6.1);
    assert_eq!(drive.last(STATE).values[..3], [1.0, 1.0, 1.0]);
    drive.until(20.1);
    assert_eq!(drive.last(STATE).values[0], 0.0, "silent for too long");
}

#[test]
fn the_state_of_a_second_is_that_which_all_features_reported_for_it() {
    let mut drive = drive();
    drive.until(10.0);
    drive.take_on(ONLINE, 10.0, feature(&[1.0]));
    drive.until(10.1);
    let (at, state) = drive.features(STATE).pop().unwrap();
    assert_eq!((at, state.values[1]), (10.0, 1.0));
}

#[test]
fn reports_about_the_team_do_not_name_what_a_person_wears() {
    let drive = drive();
    assert!(drive.streams().iter().all(|stream| stream.about == About::Team));
}
