use proptest::prelude::*;
use teampulse_core::data::FeatureValues;
use teampulse_core::sample::Turn;
use teampulse_core::stream::Signal;
use teampulse_messages::catalogue::shipped;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::geometry_msgs::{Point, Pose, PoseStamped};
use teampulse_messages::standard::nav_msgs::Odometry;
use teampulse_messages::standard::std_msgs::Header;

use super::*;
use crate::drive::{alone, built, time};

fn stream(name: &str, subject: Subject, type_name: &str) -> Stream {
    Stream::raw(name, subject, Shape::Message(shipped(type_name).expect("it is shipped")))
}

fn person(id: &str) -> Stream {
    let name = format!("/humans/persons/{id}/hri/position");
    stream(&name, Subject::person(id), PoseStamped::NAME)
}

fn robot(id: &str) -> Stream {
    stream(&format!("/{id}/odom"), Subject::robot(id), Odometry::NAME)
}

fn header(frame: &str) -> Header {
    Header { frame_id: frame.to_owned(), ..Header::default() }
}

fn pose(x: f64, y: f64) -> Pose {
    Pose { position: Point { x, y, z: 1.7 }, ..Pose::default() }
}

fn standing(frame: &str, x: f64, y: f64) -> Data {
    Data::Message(PoseStamped { header: header(frame), pose: pose(x, y) }.encode())
}

fn driving(frame: &str, x: f64, y: f64) -> Data {
    let mut odometry = Odometry { header: header(frame), ..Odometry::default() };
    odometry.pose.pose = pose(x, y);
    Data::Message(odometry.encode())
}

fn sample(stream: u32, secs: f64, data: Data) -> Sample {
    Sample {
        stream: StreamId(stream),
        measured: time(secs),
        log_time: time(secs),
        device_time: None,
        source_time: None,
        period_ns: 0.0,
        index: 0,
        turn: Turn::OnTime,
        data,
    }
}

/// Runs a person and robots through some seconds, with one position per tick; returns the values of the last second
/// of a stream.
fn last(
    streams: &[Stream],
    secs: f64,
    at: impl Fn(usize, f64) -> Option<Data>,
    of: &str,
) -> Option<FeatureValues> {
    let feature = built::<Proximity>("");
    let mut extractor = alone(&*feature, &streams[0]);
    let mut out = Outputs::new();
    for (place, stream) in streams.iter().enumerate() {
        assert!(feature.accepts(stream), "{}", stream.name);
        extractor.join(StreamId(place as u32), stream, &mut out);
    }
    for tick in 0..=(secs * 10.0).round() as u32 {
        let now = f64::from(tick) / 10.0;
        for place in 0..streams.len() {
            if let Some(data) = at(place, now) {
                extractor.push(&sample(place as u32, now, data), &mut out);
            }
        }
        extractor.tick(time(now), &mut out);
    }
    let name = format!("/humans/persons/{of}");
    let output = out.streams().iter().position(|stream| stream.name == name)?;
    let id = {
        let stream = out.streams()[output].clone();
        out.declare(stream)
    };
    let values = out.samples().filter(|(stream, ..)| *stream == id).last();
    values.map(|(_, _, data)| match data {
        Data::Feature(values) => (**values).clone(),
        other => panic!("{other:?}"),
    })
}

#[test]
fn a_robot_that_comes_nearer_has_a_distance_and_an_approach() {
    let at = |place: usize, secs: f64| match place {
        0 => Some(standing("map", 1.0, 2.0)),
        _ => Some(driving("/map", 1.0 + 5.0 - 0.5 * secs, 2.0)),
    };
    let streams = [person("p001"), robot("r1")];
    let near = last(&streams, 9.0, at, "p001/proximity/r1").unwrap();
    // From 1.0 m at 8 s to 0.5 m at 9 s: all of the last second is within 1.2 m.
    assert!((near.values[0] - 0.5).abs() < 1e-9, "{near:?}");
    assert!((near.values[1] - 1.0).abs() < 1e-9 && (near.values[2] - 0.5).abs() < 1e-9);
    let far = last(&streams, 3.0, at, "p001/proximity").unwrap();
    assert!((far.values[0] - 3.5).abs() < 1e-9 && far.values[1] == 0.0, "{far:?}");
    assert_eq!(far.values[3], 1.0);
}

#[test]
fn positions_in_different_frames_have_a_reason_and_no_number() {
    let at = |place: usize, _: f64| match place {
        0 => Some(standing("map", 0.0, 0.0)),
        _ => Some(driving("r1/odom", 0.0, 0.0)),
    };
    let streams = [person("p001"), robot("r1")];
    for name in ["p001/proximity", "p001/proximity/r1"] {
        let values = last(&streams, 3.0, at, name).unwrap();
        assert!(values.values[..3].iter().all(|value| value.is_nan()), "{name}: {values:?}");
        assert_eq!(values.reasons[..3], [Reason::Undefined; 3], "{name}");
    }
}

#[test]
fn the_odometry_of_several_robots_is_no_common_frame() {
    let at = |place: usize, _: f64| match place {
        0 => Some(standing("odom", 0.0, 0.0)),
        _ => Some(driving("odom", 3.0, 4.0)),
    };
    let streams = [person("p001"), robot("r1"), robot("r2")];
    let one = last(&streams[..2], 3.0, at, "p001/proximity").unwrap();
    assert!((one.values[0] - 5.0).abs() < 1e-9);
    let two = last(&streams, 3.0, at, "p001/proximity").unwrap();
    assert_eq!(two.reasons[0], Reason::Undefined);
}

#[test]
fn a_position_that_is_old_is_missing() {
    let at = |place: usize, secs: f64| match place {
        0 => (secs < 1.0).then(|| standing("map", 0.0, 0.0)),
        _ => Some(driving("map", 1.0, 0.0)),
    };
    let streams = [person("p001"), robot("r1")];
    let values = last(&streams, 6.0, at, "p001/proximity").unwrap();
    assert_eq!(values.reasons[0], Reason::Missing, "{values:?}");
    assert_eq!(values.coverage, 0.0);
}

#[test]
fn the_nearest_of_several_robots_is_a_persons_and_a_goal_is_none() {
    let at = |place: usize, _: f64| match place {
        0 => Some(standing("map", 0.0, 0.0)),
        _ => Some(driving("map", place as f64, 0.0)),
    };
    let streams = [person("p001"), robot("r1"), robot("r2")];
    let values = last(&streams, 3.0, at, "p001/proximity").unwrap();
    assert_eq!((values.values[0], values.values[1], values.values[3]), (1.0, 1.0, 2.0));
    let goal = stream("/r1/goal_pose", Subject::robot("r1"), PoseStamped::NAME);
    let commanded = Stream { signal: Signal::Input, ..robot("r1") };
    let feature = built::<Proximity>("");
    assert!(!feature.accepts(&goal) && !feature.accepts(&commanded));
}

#[test]
fn a_crowd_has_a_bounded_number_of_pairs() {
    let people = (0..100).map(|id| person(&format!("p{id}")));
    let streams: Vec<Stream> = people.chain((0..100).map(|id| robot(&format!("r{id}")))).collect();
    let feature = built::<Proximity>("");
    let mut extractor = alone(&*feature, &streams[0]);
    let mut out = Outputs::new();
    for (place, stream) in streams.iter().enumerate() {
        extractor.join(StreamId(place as u32), stream, &mut out);
    }
    for tick in 0..=20 {
        extractor.tick(time(f64::from(tick) / 10.0), &mut out);
    }
    let pairs = out.streams().iter().filter(|stream| stream.channels.len() == 3).count();
    assert_eq!(pairs, MOST_PAIRS);
    let faults = out.streams().iter().filter(|stream| stream.shape == Shape::Event).count();
    assert_eq!(faults, 1);
}

#[test]
fn limits_that_make_no_sense_are_refused() {
    for settings in ["within_m = 0", "within_m = nan", "stale_secs = 0"] {
        let settings: Proximity = toml::from_str(settings).expect("settings that read");
        assert!(settings.build(&FeatureContext::default()).is_err(), "{settings:?}");
    }
}

proptest! {
    #[test]
    fn any_bytes_are_a_distance_or_a_reason(
        messages in prop::collection::vec((prop::collection::vec(any::<u8>(), 0..120), 0_u8..2), 0..20),
    ) {
        let at = |place: usize, secs: f64| {
            let (bytes, of) = messages.get((secs * 10.0).round() as usize)?;
            (usize::from(*of) == place).then(|| Data::Message(bytes.clone().into()))
        };
        let streams = [person("p001"), robot("r1")];
        let values = last(&streams, 2.0, at, "p001/proximity/r1").unwrap();
        for (value, reason) in values.values.iter().zip(&values.reasons) {
            prop_assert_eq!(value.is_nan(), *reason != Reason::Ok);
        }
    }
}
