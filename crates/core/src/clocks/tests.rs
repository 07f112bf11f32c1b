use std::sync::Arc;

use teampulse_timefilter::clock::StampOf;

use super::*;
use crate::stream::{Schema, Subject};

fn clocks_of(clocks: &Clocks) -> Vec<Option<usize>> {
    clocks.of.iter().map(|placed| placed.map(|placed| placed.clock)).collect()
}

const STREAMS: u32 = 100_000;
const NOW: i64 = 1_700_000_000_000_000_000;

fn messages(number: u32, schema: &Arc<Schema>) -> Stream {
    let subject = Subject::robot(format!("robot{number}"));
    Stream::raw(format!("/robot{number}/x"), subject, Shape::Message(Arc::clone(schema)))
}

fn schema() -> Arc<Schema> {
    let name = "test_msgs/msg/Any".into();
    Arc::new(Schema { name, encoding: String::new(), text: String::new(), hash: String::new() })
}

#[test]
fn a_device_is_called_by_its_last_word_or_that_of_its_topic() {
    let mut stream = Stream::raw("/strap/imu", Subject::robot("strap"), Shape::Sample);
    assert_eq!(device_of(&stream), "imu");
    stream.device = "power/state".into();
    assert_eq!(device_of(&stream), "state");
}

/// Comparing each with all others would take hours.
#[test]
fn a_hundred_thousand_computers_have_a_clock_each() {
    let (mut clocks, schema) = (Clocks::default(), schema());
    for round in 0..3 {
        for number in 0..STREAMS {
            let stream = messages(number, &schema);
            let arrival = NOW + round * 1_000_000_000 + i64::from(number);
            let stamps = Stamps { source: Some(arrival - 1_000), ..Stamps::arrived(arrival) };
            let corrected = clocks.correct(StreamId(number), &stream, &stamps);
            assert_eq!(corrected.measured, arrival - 1_000);
            if round == 1 {
                clocks.stamped_by(stream.name, format!("computer{number}"));
            }
        }
        assert_eq!(clocks.tick(NOW + (round + 1) * 1_000_000_000).len(), 0);
    }
    let (of_robots, of_computers) = (STREAMS as usize, STREAMS as usize);
    assert_eq!(clocks.at_work.len(), of_robots + of_computers);
    assert!((0..STREAMS).all(|number| clocks.state(StreamId(number)).is_some()));
}

#[test]
fn a_stream_keeps_its_clock_when_another_stream_s_is_reported() {
    let (mut clocks, schema) = (Clocks::default(), schema());
    let stamps = Stamps { source: Some(NOW), ..Stamps::arrived(NOW) };
    for number in 0..2 {
        clocks.correct(StreamId(number), &messages(number, &schema), &stamps);
    }
    clocks.stamped_by("/robot1/x".into(), "laptop".into());
    assert_eq!(clocks_of(&clocks), [Some(0), None]);
    clocks.correct(StreamId(1), &messages(1, &schema), &stamps);
    assert_eq!(clocks_of(&clocks), [Some(0), Some(2)]);
    assert_eq!(clocks.at_work[2].owner, Owner::Computer("laptop".into()));
}

/// A wave of a person's strap from another computer, stamped this long after it arrives [ns].
fn wave(clocks: &mut Clocks, arrival: i64, ahead_nanos: i64) -> Corrected {
    let person = Subject { about: crate::stream::About::Person, id: "p001".into() };
    let mut stream = Stream::raw("/humans/persons/p001/strap/ecg", person, Shape::Wave);
    (stream.device, stream.rate_hz) = ("strap".into(), 128.0);
    let source = Some(arrival + ahead_nanos);
    let stamps =
        Stamps { device: Some(7), source, stamp_of: StampOf::Measured, ..Stamps::arrived(arrival) };
    clocks.correct(StreamId(0), &stream, &stamps)
}

#[test]
fn our_messages_from_another_computer_keep_their_stamps_and_its_clock_is_unknown() {
    let mut clocks = Clocks::default();
    clocks.stamped_by("/humans/persons/p001/strap/ecg".into(), "laptop2".into());
    for k in 0..100 {
        let at = NOW + k * 100_000_000;
        assert_eq!(wave(&mut clocks, at, -300_000_000).measured, at - 300_000_000);
        clocks.tick(at);
    }
    let state = clocks.state(StreamId(0)).unwrap();
    assert_eq!(state.kind, ClockKind::Remote);
    assert!(state.offset_secs.is_nan() && state.uncertainty_secs.is_nan(), "{state:?}");
}

#[test]
fn our_messages_are_corrected_by_the_clock_of_the_computer_that_stamps_them() {
    for ahead_nanos in [600_000_000, -600_000_000] {
        let mut clocks = Clocks::default();
        clocks.stamped_by("/humans/persons/p001/strap/ecg".into(), "laptop2".into());
        let mut wrong_nanos = 0;
        for k in 0..200 {
            let at = NOW + k * 100_000_000;
            if k % 40 == 10 {
                let (offset_secs, round_trip_secs) = (ahead_nanos as f64 * 1e-9, 0.001);
                let probe = Probe { arrival: at, offset_secs, round_trip_secs };
                clocks.probed("laptop2".into(), &probe);
            }
            let measured = wave(&mut clocks, at, ahead_nanos - 70_000_000).measured;
            wrong_nanos = (measured - (at - 70_000_000)).abs();
            clocks.tick(at);
        }
        assert!(wrong_nanos < 1_000_000, "{wrong_nanos}");
        let state = clocks.state(StreamId(0)).unwrap();
        assert!((state.offset_secs - ahead_nanos as f64 * 1e-9).abs() < 0.001, "{state:?}");
    }
}

#[test]
fn messages_that_a_worker_made_of_others_keep_the_time_of_those_however_long_it_took() {
    let mut clocks = Clocks::default();
    let stream = Stream { inputs: vec!["/robot1/front".to_owned()], ..messages(1, &schema()) };
    for k in 0..200 {
        let at = NOW + k * 50_000_000;
        let took = 500_000_000 + k % 7 * 10_000_000;
        let stamps = Stamps { source: Some(at - took), ..Stamps::arrived(at) };
        assert_eq!(clocks.correct(StreamId(1), &stream, &stamps).measured, at - took);
        clocks.tick(at);
    }
    assert_eq!(clocks.state(StreamId(1)).unwrap().kind, ClockKind::Host);
}

#[test]
fn each_message_of_a_topic_is_by_the_clock_of_its_own_computer() {
    let (mut clocks, schema) = (Clocks::default(), schema());
    let stream = messages(1, &schema);
    let mut worst_nanos = 0;
    for k in 0..600 {
        let at = NOW + k * 50_000_000;
        let (computer, ahead) =
            if k % 2 == 0 { ("laptop1", 0) } else { ("laptop2", 1_500_000_000) };
        clocks.stamped_by(stream.name.clone(), computer.into());
        let stamps = Stamps { source: Some(at + ahead), ..Stamps::arrived(at + 3_000_000) };
        let measured = clocks.correct(StreamId(1), &stream, &stamps).measured;
        if k > 300 {
            worst_nanos = worst_nanos.max((measured - at).abs());
        }
        clocks.tick(at);
    }
    assert!(worst_nanos < 5_000_000, "{worst_nanos}");
}

#[test]
fn what_was_done_keeps_its_time_though_it_arrives_later_and_another_computer_stamps_the_topic() {
    const SEC: i64 = 1_000_000_000;
    let (mut clocks, events) = (Clocks::default(), crate::session_streams::session_events());
    clocks.stamped_by(events.name.clone(), "laptop".into());
    let mut placed = |stream: &Stream, device, source, arrival| {
        let stamps = Stamps { device, source, ..Stamps::arrived(arrival) };
        clocks.correct(StreamId(0), stream, &stamps).measured
    };
    // Another computer's event first, 300 s ahead of this one.
    assert_eq!(placed(&events, None, Some(NOW + 300 * SEC), NOW), NOW);
    for late_secs in [0, 5, 59, 659] {
        let at = NOW + 100 * SEC - late_secs * SEC;
        assert_eq!(placed(&events, Some(at), Some(at), NOW + 100 * SEC), at, "{late_secs}");
    }
    // Done at the very time of arrival: no other stamp is kept.
    assert_eq!(placed(&events, Some(NOW + 101 * SEC), None, NOW + 101 * SEC), NOW + 101 * SEC);
    // Neither longer ago, nor ahead of time, nor elsewhere.
    let arrival = NOW + 200 * SEC;
    let others = Stream { name: "/humans/persons/p1/events".into(), ..events.clone() };
    for (stream, at) in [
        (&events, arrival - 661 * SEC),
        (&events, arrival + 2 * SEC),
        (&others, arrival - 30 * SEC),
    ] {
        assert_ne!(placed(stream, Some(at), Some(at), arrival), at);
    }
}
