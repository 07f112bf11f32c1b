use std::sync::Mutex;

use teampulse_core::sample::Sample;
use teampulse_core::sink::{Batch, queue};
use teampulse_core::stream::{Channel, Signal, Subject};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_messages::standard::Message as _;
use teampulse_messages::standard::hri_msgs::{
    Expression, FacialActionUnits, FacialLandmarks, Gaze, IdsList, LANDMARKS,
    NormalizedRegionOfInterest2D, Skeleton2D,
};
use teampulse_messages::standard::std_msgs::Text;
use teampulse_ros::BusId;
use teampulse_ros::bus::{Arrival, Asked, Subscription};
use teampulse_ros::buses::Buses;
use teampulse_ros::memory::MemoryBus;

use super::*;
use crate::RosContext;

const AT: Time = Time::from_nanos(1_700_000_000_000_000_000);

fn stream(leaf: &str, signal: Signal, channels: &[&str]) -> Stream {
    let unit = |name: &str| if ["yaw", "pitch"].contains(&name) { "rad" } else { "px" };
    let name = format!("/humans/persons/p001/robot1_front/{leaf}");
    Stream {
        signal,
        inputs: vec!["/robot1/front/compressed".into()],
        channels: channels.iter().map(|name| Channel::new(*name, unit(name))).collect(),
        ..Stream::raw(name, Subject::person("p001"), Shape::Sample)
    }
}

/// Runs a sink on samples; gives what was published, by topic.
fn published(settings: &str, samples: &[(Stream, Vec<f64>)]) -> BTreeMap<String, Vec<Bytes>> {
    let ours = MemoryBus::new("/teampulse");
    let theirs = ours.join("/viewer");
    let bus: Arc<dyn Bus> = ours;
    let mut context = SinkContext::new("bag", "test", Clock::host());
    context.ros = RosContext { buses: Arc::new(Buses::holding([(0, bus)])), ..context.ros };
    context.ros.bus = BusId::from(0);
    let settings: Hri = toml::from_str(settings).expect("settings");
    let sink = settings.build(&context).expect("a sink");
    let heard = Arc::<Mutex<BTreeMap<String, Vec<Bytes>>>>::default();
    let topics = [
        ("faces/p001/landmarks", FacialLandmarks::NAME),
        ("faces/p001/roi", NormalizedRegionOfInterest2D::NAME),
        ("faces/p001/expression", Expression::NAME),
        ("faces/p001/facs", FacialActionUnits::NAME),
        ("bodies/p001/skeleton2d", Skeleton2D::NAME),
        ("interactions/gazing", Gaze::NAME),
        ("faces/tracked", IdsList::NAME),
        ("bodies/tracked", IdsList::NAME),
        ("persons/tracked", IdsList::NAME),
        ("persons/known", IdsList::NAME),
        ("persons/p001/face_id", Text::NAME),
        ("persons/p001/body_id", Text::NAME),
    ];
    let listen = |(topic, type_name): (&str, &str)| -> Subscription {
        let (heard, topic) = (Arc::clone(&heard), topic.to_owned());
        let name = format!("/humans/{topic}");
        let deliver = Arc::new(move |arrival: Arrival| {
            let mut heard = heard.lock().unwrap();
            heard.entry(topic.clone()).or_default().push(arrival.bytes);
        });
        theirs.subscribe(&name, type_name, Asked::Adaptive { depth: 100 }, deliver).unwrap()
    };
    let _listening = topics.map(listen);
    let streams = Streams::default();
    let (post, inbox) = queue(Delivery::Fresh, streams.clone());
    let record = |(stream, numbers): &(Stream, Vec<f64>)| {
        let id = streams.declare(stream.clone()).id;
        let sample = Sample {
            stream: id,
            measured: AT,
            log_time: AT,
            device_time: None,
            source_time: None,
            period_ns: 0.0,
            index: 0,
            turn: Turn::OnTime,
            data: Data::Sample(numbers.as_slice().into()),
        };
        Record { stream: streams.get(id), sample, cdr: Bytes::new() }
    };
    let batch: Batch = samples.iter().map(record).collect();
    post.deliver(&batch);
    drop(post);
    sink.run(inbox).expect("it runs");
    std::mem::take(&mut *heard.lock().unwrap())
}

const ALL: &str = r#"streams = ["/humans/persons/p001/*/*"]"#;

fn first<M: teampulse_messages::standard::Message>(
    heard: &BTreeMap<String, Vec<Bytes>>,
    topic: &str,
) -> M {
    let messages = heard.get(topic).unwrap_or_else(|| panic!("nothing on {topic}: {heard:?}"));
    M::decode(&messages[0]).expect("a message")
}

fn ids(heard: &BTreeMap<String, Vec<Bytes>>, topic: &str) -> Vec<String> {
    first::<IdsList>(heard, topic).ids
}

/// What YuNet gives of a frame of 640 × 480.
fn yunet() -> (Stream, Vec<f64>) {
    let channels = [
        "left",
        "top",
        "width",
        "height",
        "score",
        "count",
        "right_eye_x",
        "right_eye_y",
        "left_eye_x",
        "left_eye_y",
        "frame_width",
        "frame_height",
    ];
    let numbers =
        vec![64.0, 48.0, 320.0, 240.0, 0.75, 1.0, 160.0, 120.0, 320.0, 120.0, 640.0, 480.0];
    (stream("yunet", Signal::Face, &channels), numbers)
}

#[test]
fn a_face_is_published_with_its_region_and_its_person() {
    let heard = published(ALL, &[yunet()]);
    let face: FacialLandmarks = first(&heard, "faces/p001/landmarks");
    assert_eq!((face.width, face.height, face.header.stamp), (640, 480, AT));
    let pupil = face.landmarks[68];
    assert_eq!((LANDMARKS[68], pupil.x, pupil.y, pupil.c), ("right_pupil", 0.25, 0.25, 0.75));
    assert!(face.landmarks[36].c.abs() < f32::EPSILON, "it was not looked for");
    let region: NormalizedRegionOfInterest2D = first(&heard, "faces/p001/roi");
    let sides = [region.xmin, region.ymin, region.xmax, region.ymax, region.c];
    assert!(sides.iter().zip([0.1, 0.1, 0.6, 0.6, 0.75]).all(|(is, of)| (is - of).abs() < 1e-6));
    assert_eq!(ids(&heard, "faces/tracked"), ["p001"]);
    assert_eq!(ids(&heard, "persons/tracked"), ["p001"]);
    assert_eq!(ids(&heard, "persons/known"), ["p001"]);
    assert!(ids(&heard, "bodies/tracked").is_empty());
    assert_eq!(first::<Text>(&heard, "persons/p001/face_id").data, "p001");
    assert!(!heard.contains_key("persons/p001/body_id"));
}

#[test]
fn nobody_in_view_is_not_published() {
    let (stream, numbers) = yunet();
    let nothing = (0..numbers.len()).map(|place| if place > 9 { numbers[place] } else { f64::NAN });
    assert_eq!(published(ALL, &[(stream, nothing.collect())]), BTreeMap::new());
}

#[test]
fn a_body_has_a_neck_between_its_shoulders() {
    let channels = [
        "right_shoulder_x",
        "right_shoulder_y",
        "right_shoulder_score",
        "left_shoulder_x",
        "left_shoulder_y",
        "left_shoulder_score",
    ];
    let body = stream("pose", Signal::Body, &channels);
    let numbers = vec![160.0, 240.0, 0.9, 320.0, 240.0, 0.5];
    let sized = format!("{ALL}\nframe = [640, 480]");
    let heard = published(&sized, &[(body.clone(), numbers.clone())]);
    let skeleton: Skeleton2D = first(&heard, "bodies/p001/skeleton2d");
    let [neck, nose] = [1, 0].map(|place| skeleton.skeleton[place]);
    assert_eq!((neck.x, neck.y, neck.c, nose.c), (0.375, 0.5, 0.5, 0.0));
    assert_eq!(first::<Text>(&heard, "persons/p001/body_id").data, "p001");
    assert_eq!(published(ALL, &[(body, numbers)]), BTreeMap::new(), "its frame has no size");
}

#[test]
fn expressions_units_and_gaze_have_the_words_and_codes_of_hri_msgs() {
    let expression =
        stream("fer", Signal::Expression, &["neutral", "Anger", "contempt", "valence"]);
    let units = stream("units", Signal::Other, &["AU01_r", "AU12", "AU12_score"]);
    let gaze = stream("gaze", Signal::Other, &["yaw", "pitch"]);
    let away = stream("gaze2", Signal::Other, &["yaw", "pitch"]);
    let heard = published(
        ALL,
        &[
            (expression.clone(), vec![0.25, 0.5, 0.25, -0.5]),
            (units, vec![2.5, 0.5, 0.75]),
            (gaze, vec![0.1, -0.1]),
            (away, vec![0.5, 0.0]),
        ],
    );
    let seen: Expression = first(&heard, "faces/p001/expression");
    assert_eq!((seen.expression.as_str(), seen.confidence, seen.valence), ("angry", 0.5, -0.5));
    let seen: FacialActionUnits = first(&heard, "faces/p001/facs");
    assert_eq!((seen.intensity[1], seen.confidence[1]), (2.5, 1.0));
    assert_eq!((seen.intensity[12], seen.confidence[12]), (0.5, 0.75));
    let seen: Gaze = first(&heard, "interactions/gazing");
    assert_eq!((seen.sender.as_str(), seen.receiver.as_str()), ("p001", ""));
    assert_eq!(heard["interactions/gazing"].len(), 1, "0.5 rad are not at the robot");
    // A word that hri_msgs has not is no other one.
    let contempt = published(ALL, &[(expression, vec![0.25, 0.25, 0.5, f64::NAN])]);
    assert!(!contempt.contains_key("faces/p001/expression"));
}

#[test]
fn people_are_published_only_where_they_are_named() {
    let wanted = |text: &str| {
        let hri: Hri = toml::from_str(&format!("streams = [\"{text}\"]")).expect("settings");
        hri.wanted().map_err(|error| error.to_string())
    };
    assert!(wanted("/humans/persons/p001/**").is_ok());
    assert!(wanted("/**").is_err() && wanted("/*/persons/p001/*/yunet").is_err());
    assert_eq!(published(r#"streams = ["/humans/persons/p002/**"]"#, &[]), BTreeMap::new());
}

#[test]
fn who_was_seen_is_in_view_for_a_second() {
    let mut tracked = Tracked::default();
    let at = |secs: f64| Time::from_nanos((secs * 1e9) as i64);
    assert!(tracked.look(at(0.0)).is_empty(), "nobody was ever seen");
    tracked.see(view::Part::Face, "p001", "p001", at(0.0));
    let topics = |messages: Vec<Message>| -> Vec<String> {
        messages.into_iter().map(|message| message.topic).collect()
    };
    let first = topics(tracked.look(at(0.0)));
    assert_eq!(first.len(), 6, "{first:?}");
    assert!(tracked.look(at(0.5)).is_empty());
    assert_eq!(tracked.look(at(1.0)).len(), 4, "the lists once a second");
    let lost = tracked.look(at(1.1));
    let faces = lost.iter().find(|message| message.topic == "faces/tracked").unwrap();
    assert!(IdsList::decode(&faces.cdr).unwrap().ids.is_empty());
    let matched = lost.iter().find(|message| message.topic == "persons/p001/face_id").unwrap();
    assert_eq!((Text::decode(&matched.cdr).unwrap().data.as_str(), matched.is_latched), ("", true));
}

#[test]
fn a_second_camera_has_faces_of_its_own() {
    let mut ids = Ids::default();
    let of = |ids: &mut Ids, camera: &str| ids.of("p001", camera);
    assert_eq!(["/a", "/b", "/a"].map(|camera| of(&mut ids, camera)), ["p001", "p001_2", "p001"]);
}
