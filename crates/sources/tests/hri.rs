//! Faces and bodies that other nodes see, on a bus in memory, heard by a whole session.

mod keeper;
mod watching;

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use teampulse_core::data::Data;
use teampulse_core::sample::Record;
use teampulse_core::stream::{About, Origin, Signal};
use teampulse_core::time::Time;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::geometry_msgs::PoseStamped;
use teampulse_messages::standard::hri_msgs::{
    Expression, FacialLandmarks, NormalizedPointOfInterest2D, Skeleton2D,
};
use teampulse_messages::standard::std_msgs::Header;
use teampulse_ros::bus::Publisher;
use teampulse_ros::memory::MemoryBus;
use teampulse_sources::hri::Hri;

use watching::{faults, of, publisher, subscribed, watch};

const LANDMARKS: &str = "/humans/persons/p001/hri/landmarks";

/// Points of a face in a frame of 640 × 480, the outer corner of the right eye at this place.
fn face(x: f32) -> Bytes {
    let mut face = FacialLandmarks { width: 640, height: 480, ..FacialLandmarks::default() };
    face.landmarks[36] = NormalizedPointOfInterest2D { x, y: 0.5, c: 0.9 };
    face.encode()
}

fn id(text: &str) -> Vec<u8> {
    let length = u32::try_from(text.len() + 1).expect("it is short").to_le_bytes();
    [&[0, 1, 0, 0], &length[..], text.as_bytes(), &[0]].concat()
}

fn face_publisher(bus: &MemoryBus, id: &str) -> Box<dyn Publisher> {
    publisher(bus, &format!("/humans/faces/{id}/landmarks"), FacialLandmarks::NAME)
}

/// The first x of each record of a stream.
fn xs(records: &[Record], channel: &str) -> Vec<f64> {
    let x = |record: &Record| match &record.sample.data {
        Data::Sample(values) => values[record.stream.place_of(channel).expect("a channel")],
        other => panic!("{other:?}"),
    };
    of(records, LANDMARKS).into_iter().map(x).collect()
}

async fn pause(millis: u64) {
    tokio::time::sleep(Duration::from_millis(millis)).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_person_goes_on_when_the_face_has_another_id() {
    let settings = "person = \"p001\"\nface = \"*\"";
    let records = watch::<Hri>(settings, async |bus: Arc<MemoryBus>| {
        let first = face_publisher(&bus, "a");
        subscribed(&*first).await;
        first.publish(&face(0.25)).expect("published");
        let second = face_publisher(&bus, "b");
        subscribed(&*second).await;
        second.publish(&face(0.75)).expect("published");
        drop(first);
        pause(1200).await;
        second.publish(&face(0.5)).expect("published");
        pause(100).await;
    })
    .await;
    assert_eq!(xs(&records, "right_eye_outside_x"), [160.0, 320.0]);
    let stream = &of(&records, LANDMARKS)[0].stream;
    assert_eq!(
        (stream.about, stream.origin, stream.id.as_str()),
        (About::Person, Origin::Raw, "p001")
    );
    assert_eq!((stream.signal, stream.channels[0].unit.as_str()), (Signal::Face, "px"));
    assert!(!stream.qos.is_empty());
    let two = faults(&records).iter().filter(|label| label.contains("two at once")).count();
    assert_eq!(two, 1, "{:?}", faults(&records));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_person_manager_says_whose_face_it_is() {
    let records = watch::<Hri>("person = \"p001\"\nid = \"gvbec\"", async |bus: Arc<MemoryBus>| {
        let matched = publisher(&bus, "/humans/persons/gvbec/face_id", "std_msgs/msg/String");
        let (ours, other) = (face_publisher(&bus, "a"), face_publisher(&bus, "b"));
        for each in [&matched, &ours, &other] {
            subscribed(&**each).await;
        }
        matched.publish(&id("a")).expect("published");
        pause(50).await;
        ours.publish(&face(0.25)).expect("published");
        other.publish(&face(0.75)).expect("published");
        pause(50).await;
        matched.publish(&id("b")).expect("published");
        pause(50).await;
        other.publish(&face(0.5)).expect("published");
        pause(100).await;
    })
    .await;
    assert_eq!(xs(&records, "right_eye_outside_x"), [160.0, 320.0]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_can_not_be_read_is_named_once_and_hurts_nobody() {
    let records = watch::<Hri>("person = \"p001\"", async |bus: Arc<MemoryBus>| {
        let seen = face_publisher(&bus, "a");
        let body = publisher(&bus, "/humans/bodies/a/skeleton2d", Skeleton2D::NAME);
        let says = publisher(&bus, "/humans/faces/a/expression", Expression::NAME);
        for each in [&seen, &body, &says] {
            subscribed(&**each).await;
        }
        let unsized_frame = FacialLandmarks::default().encode();
        for broken in [&b""[..], &[0, 1, 0, 0, 7], &[255; 40], &unsized_frame, &unsized_frame] {
            seen.publish(broken).expect("published");
        }
        seen.publish(&face(f32::NAN)).expect("published");
        body.publish(&Skeleton2D::default().encode()).expect("published");
        let glad = Expression { expression: "glad".into(), ..Expression::default() };
        says.publish(&glad.encode()).expect("published");
        pause(300).await;
    })
    .await;
    assert!(xs(&records, "right_eye_outside_x")[0].is_nan());
    let labels = faults(&records);
    let said = |words: &str| labels.iter().filter(|label| label.contains(words)).count();
    assert_eq!(said("frame = [640, 480]"), 2, "of the face, and of the skeleton: {labels:?}");
    assert_eq!(said("the expression `glad`"), 1, "{labels:?}");
    let body = &of(&records, "/humans/persons/p001/hri/skeleton2d")[0].stream;
    assert_eq!((body.signal, body.channels[0].unit.as_str()), (Signal::Other, "1"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_position_is_kept_as_it_came_with_its_frame() {
    let settings = "person = \"p001\"\nposition = \"/mocap/p001\"";
    let pose = PoseStamped {
        header: Header { stamp: Time::from_stamp(1_700_000_000, 0), frame_id: "map".into() },
        ..PoseStamped::default()
    };
    let message = pose.encode();
    let records = watch::<Hri>(settings, async |bus: Arc<MemoryBus>| {
        let mocap = publisher(&bus, "/mocap/p001", PoseStamped::NAME);
        subscribed(&*mocap).await;
        mocap.publish(&message).expect("published");
        pause(100).await;
    })
    .await;
    let [record] = of(&records, "/humans/persons/p001/hri/position")[..] else { panic!() };
    assert!(matches!(&record.sample.data, Data::Message(bytes) if *bytes == pose.encode()));
    assert_eq!(record.stream.channels[0].name, "pose.position.x");
    assert_eq!(record.stream.channels[0].unit, "m");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn topics_that_are_gone_are_no_longer_followed() {
    let records = watch::<Hri>("person = \"p001\"", async |bus: Arc<MemoryBus>| {
        for number in 0..50 {
            let face = face_publisher(&bus, &format!("f{number}"));
            subscribed(&*face).await;
        }
        let body = publisher(&bus, "/humans/faces/last/landmarks", FacialLandmarks::NAME);
        subscribed(&*body).await;
        body.publish(&face(0.5)).expect("published");
        pause(100).await;
    })
    .await;
    assert_eq!(xs(&records, "frame_width"), [640.0]);
}
