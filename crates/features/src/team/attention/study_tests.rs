//! Laws of the study's alerts.

use std::sync::Arc;

use teampulse_core::alerts::{ALERTS, holds_alerts};
use teampulse_core::data::{Data, Event, EventKind, FeatureValues, Reason, Wave};
use teampulse_core::feature::Feature;
use teampulse_core::registry::Component;
use teampulse_core::session_streams::{END, session_events};
use teampulse_core::stream::{Shape, Stream, StreamId, Subject, Window};

use super::Attention;
use crate::context::FeatureContext;
use crate::drive::Drive;

const OWN: &str = "/humans/persons/p001/alerts";
const OF_ESTIMATES: &str = "/humans/persons/p001/estimates/alerts";
const WATCHED: StreamId = StreamId(0);
const HR: &str = "stream = \"/humans/persons/*/strap/hr\"\nabove = 120\nclear = 110\nfor_secs = 3\ntier = \"act\"";

fn watching(alerts: &[&str]) -> Box<dyn Feature> {
    let alerts = alerts.iter().map(|alert| toml::from_str(alert).expect("an alert")).collect();
    let context = FeatureContext { alerts, ..FeatureContext::default() };
    Attention::default().build(&context).expect("settings that build")
}

fn heart_rate() -> Stream {
    let subject = Subject::person("p001");
    Stream::raw("/humans/persons/p001/strap/hr", subject, Shape::Sample)
        .with_channels(&[("HR", "1/min")])
}

fn labels(drive: &mut Drive, stream: &str) -> Vec<(f64, String)> {
    drive.events(stream).into_iter().map(|(at, event)| (at, event.label)).collect()
}

fn said(expected: &[(f64, &str)]) -> Vec<(f64, String)> {
    let reason = "HR of strap/hr above 120 1/min for 3 s";
    expected.iter().map(|(at, words)| (*at, format!("p001 {words}: {reason}"))).collect()
}

#[test]
fn a_number_beyond_its_limit_for_so_long_begins_an_alert_that_ends_where_it_is_clear() {
    let mut drive = Drive::new(&*watching(&[HR]), &heart_rate());
    for (secs, rate) in [(1.0, 121.0), (2.0, 130.0), (3.0, 119.0), (4.0, 125.0), (6.9, 126.0)] {
        drive.at(secs, &[rate]);
    }
    assert_eq!(labels(&mut drive, OWN), [], "never for three seconds in a row");
    for (secs, rate) in [(7.0, 127.0), (8.0, 128.0), (9.0, 119.0), (10.0, 110.0), (11.0, 100.0)] {
        drive.at(secs, &[rate]);
    }
    let both = said(&[(7.0, "needs someone now"), (10.0, "no longer needs someone")]);
    assert_eq!(labels(&mut drive, OWN), both);
    let events: Vec<Event> = drive.events(OWN).into_iter().map(|(_, event)| event).collect();
    assert_eq!((events[0].value, events[1].duration_secs), (127.0, 3.0));
    assert_eq!(labels(&mut drive, ALERTS), [], "nothing about a person is where robots are");
}

#[test]
fn a_silent_stream_neither_keeps_nor_clears_an_alert_unsaid() {
    let mut drive = Drive::new(&*watching(&[HR]), &heart_rate());
    drive.at(1.0, &[130.0]);
    drive.at(4.0, &[130.0]);
    drive.at(9.0, &[f64::NAN]);
    drive.until(20.0);
    drive.at(21.0, &[115.0]);
    drive.at(22.0, &[90.0]);
    let lost = "may still need someone, no value comes";
    assert_eq!(
        labels(&mut drive, OWN),
        said(&[
            (4.0, "needs someone now"),
            (14.1, lost),
            (21.0, "needs someone now"),
            (22.0, "no longer needs someone")
        ])
    );
    // The time beyond the limit before a silence does not count.
    drive.at(23.0, &[130.0]);
    drive.at(40.0, &[130.0]);
    assert_eq!(labels(&mut drive, OWN).len(), 4);
}

#[test]
fn a_standstill_of_teampulse_is_no_silence_of_the_stream() {
    let mut drive = Drive::new(&*watching(&[HR]), &heart_rate());
    drive.at(1.0, &[130.0]);
    drive.at(4.0, &[130.0]);
    drive.stood_still(60.0);
    drive.until(69.0);
    assert_eq!(labels(&mut drive, OWN), said(&[(4.0, "needs someone now")]));
}

#[test]
fn an_alert_on_an_estimate_is_where_estimates_are() {
    let subject = Subject::person("p001");
    let name = "/humans/persons/p001/estimates";
    let stream = Stream::concluded(name, subject, "estimates", Shape::Feature)
        .over(Window::of_secs(30.0))
        .with_channels(&[("workload", "1"), ("arousal", "1")]);
    let alert = "stream = \"/humans/persons/*/estimates/w30\"\nchannel = \"workload\"\nabove = 0.8\ntext = \"too much\"";
    let mut drive = Drive::new(&*watching(&[alert]), &stream);
    let values = |value: f64, reason| {
        Data::Feature(Arc::new(FeatureValues {
            window_secs: 30.0,
            coverage: 1.0,
            quality: 1.0,
            values: vec![value, 0.0],
            sigmas: Vec::new(),
            reasons: vec![reason, Reason::Ok],
        }))
    };
    drive.take(30.0, values(0.9, Reason::Ok));
    drive.take(31.0, values(f64::NAN, Reason::Nothing));
    let words = ["needs someone soon", "no longer needs someone"];
    let expected = words.map(|words| format!("p001 {words}: too much (workload above 0.8)"));
    let found: Vec<String> =
        labels(&mut drive, OF_ESTIMATES).into_iter().map(|(_, label)| label).collect();
    assert_eq!(found, expected);
    let own = drive.streams().iter().find(|stream| stream.name == OF_ESTIMATES).cloned().unwrap();
    assert!(own.family == "estimates" && holds_alerts(&own));
    assert!(drive.streams().iter().all(|stream| stream.name != OWN));
}

#[test]
fn every_sample_of_a_wave_is_watched_at_its_own_time() {
    let arm = Stream::raw("/r1/arm", Subject::robot("r1"), Shape::Wave)
        .with_channels(&[("left", "N"), ("right", "N")]);
    let alert = "stream = \"/*/arm\"\nchannel = \"right\"\nbelow = -2\nrobot = \"r1\"";
    let mut drive = Drive::new(&*watching(&[alert]), &arm);
    let samples = [0.0, 0.0, 0.0, -3.0, 0.0, 0.0];
    let wave = Wave { period_ns: 0.0, channels: 2, samples: samples.into() };
    drive.take(1.0, Data::Wave(wave));
    let found: Vec<String> =
        labels(&mut drive, ALERTS).into_iter().map(|(_, label)| label).collect();
    let reason = "right of arm below -2 N";
    let words = ["needs someone soon", "no longer needs someone"];
    assert_eq!(found, words.map(|words| format!("r1 {words}: {reason}")));
}

#[test]
fn one_concern_of_two_windows_is_one_alert_until_both_are_fine() {
    let window = |secs| {
        Stream::derived(&heart_rate(), "heart", Shape::Feature)
            .over(Window::of_secs(secs))
            .with_channels(&[("HR", "1/min")])
    };
    let alert = "stream = \"/humans/persons/*/strap/hr/heart/*\"\nabove = 100";
    let mut drive = Drive::new(&*watching(&[alert]), &window(30.0));
    drive.join(StreamId(1), &window(60.0));
    let value = |value: f64| {
        Data::Feature(Arc::new(FeatureValues {
            window_secs: 30.0,
            coverage: 1.0,
            quality: 1.0,
            values: vec![value],
            sigmas: Vec::new(),
            reasons: vec![Reason::Ok],
        }))
    };
    for (secs, stream, rate) in [
        (1.0, WATCHED, 101.0),
        (2.0, StreamId(1), 102.0),
        (3.0, WATCHED, 90.0),
        (4.0, StreamId(1), 90.0),
    ] {
        drive.take_on(stream, secs, value(rate));
    }
    let times: Vec<f64> = labels(&mut drive, OWN).into_iter().map(|(at, _)| at).collect();
    assert_eq!(times, [1.0, 4.0]);
}

#[test]
fn an_alert_that_watches_nothing_is_reported_once_without_naming_anybody() {
    let mut drive = Drive::new(
        &*watching(&[HR, "stream = \"/humans/persons/p009/x\"\nabove = 1"]),
        &heart_rate(),
    );
    drive.until(100.0);
    let found = labels(&mut drive, ALERTS);
    assert_eq!(found.len(), 1);
    assert!(found[0].1.starts_with("alert 2 of the study watches nothing"), "{}", found[0].1);
    assert!(!found[0].1.contains("p009"));
}

#[test]
fn an_alert_that_watched_nothing_is_reported_at_the_end_of_a_short_session() {
    let idle = "stream = \"/humans/persons/p009/x\"\nabove = 1";
    let mut drive = Drive::new(&*watching(&[HR, idle]), &heart_rate());
    drive.join(StreamId(1), &session_events());
    drive.until(5.0);
    assert_eq!(labels(&mut drive, ALERTS), []);
    let end = || {
        let (kind, label) = (EventKind::Clock, END.to_owned());
        Data::Event(Arc::new(Event { kind, label, value: f64::NAN, duration_secs: 0.0 }))
    };
    drive.take_on(StreamId(1), 6.0, end());
    drive.until(100.0);
    let found = labels(&mut drive, ALERTS);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].1.starts_with("alert 2 of the study watches nothing"), "{}", found[0].1);
}
