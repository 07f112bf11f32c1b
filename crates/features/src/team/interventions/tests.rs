//! Laws of interventions.

use super::*;
use crate::drive::{Drive, built, plain};

const W30: &str = "/team/interventions/w30";

fn drive() -> Drive {
    let stream = plain("/fleet/r1/cmd_vel", Signal::Input, &[]);
    Drive::new(built::<Interventions>("pause_secs = 2").as_ref(), &stream)
}

/// The outputs, with their start times [s].
fn reported(drive: &mut Drive) -> Vec<(f64, String, f64, f64)> {
    let events = drive.events(NAME).into_iter();
    events.map(|(at, event)| (at, event.label, event.value, event.duration_secs)).collect()
}

#[test]
fn driving_by_hand_is_one_intervention_however_many_messages_it_takes() {
    let mut drive = drive();
    (0..200).for_each(|k| drive.at(5.0 + f64::from(k) / 20.0, &[]));
    drive.until(30.0);
    assert_eq!(reported(&mut drive), [(5.0, "r1 cmd_vel".to_owned(), 200.0, 9.95)]);
    let (_, event) = drive.events(NAME).remove(0);
    assert_eq!(event.kind, EventKind::Intervention);
}

#[test]
fn a_pause_ends_an_intervention_and_a_shorter_one_does_not() {
    let mut drive = drive();
    for secs in [1.0, 3.0, 5.1, 9.0] {
        drive.at(secs, &[]);
    }
    drive.until(20.0);
    let begun: Vec<_> = reported(&mut drive).into_iter().map(|each| (each.0, each.2)).collect();
    assert_eq!(begun, [(1.0, 2.0), (5.1, 1.0), (9.0, 1.0)]);
}

#[test]
fn a_late_message_counts_at_the_time_it_was_sent() {
    let mut drive = drive();
    drive.at(5.0, &[]);
    drive.late(4.0, &[]);
    drive.until(10.0);
    drive.late(5.5, &[]);
    drive.until(20.0);
    assert_eq!(reported(&mut drive), [(4.0, "r1 cmd_vel".to_owned(), 2.0, 1.0)]);
}

#[test]
fn windows_give_how_often_and_how_long_ago() {
    let mut drive = drive();
    for secs in [1.0, 20.0, 25.0, 28.0] {
        drive.at(secs, &[]);
    }
    drive.until(30.0);
    assert_eq!(drive.last(W30).values, [8.0, 1.0, 2.0]);
    drive.until(60.0);
    assert_eq!(drive.last(W30).values, [0.0, 0.0, 32.0]);
}

#[test]
fn before_half_a_window_there_is_no_rate_and_before_a_command_no_time_since() {
    let mut drive = drive();
    drive.until(10.0);
    assert_eq!(drive.last(W30).reasons, [Reason::Short, Reason::Short, Reason::Nothing]);
    drive.until(15.0);
    assert_eq!(drive.last(W30).reasons[..2], [Reason::Ok; 2]);
}

#[test]
fn an_intervention_at_the_end_of_the_session_is_reported() {
    let feature = built::<Interventions>("");
    let (command, events) = (plain("/r1/goal_pose", Signal::Input, &[]), session_events());
    assert!(feature.accepts(&events));
    let mut drive = Drive::new(feature.as_ref(), &command);
    drive.join(StreamId(1), &events);
    drive.at(5.0, &[]);
    let label = END.to_owned();
    let end = Event { kind: EventKind::Clock, label, value: f64::NAN, duration_secs: 0.0 };
    drive.take_on(StreamId(1), 6.0, Data::Event(Arc::new(end)));
    assert_eq!(reported(&mut drive), [(5.0, "r1 goal_pose".to_owned(), 1.0, 0.0)]);
}

#[test]
fn input_of_people_and_messages_of_robots_are_no_commands() {
    let feature = built::<Interventions>("");
    let keys = Subject { about: About::Person, id: "p001".to_owned() };
    let keys = Stream { signal: Signal::Input, ..Stream::raw("/p/keys", keys, Shape::Event) };
    assert!(!feature.accepts(&keys));
    assert!(!feature.accepts(&plain("/r1/odom", Signal::Odometry, &[])));
}
