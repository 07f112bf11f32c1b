use std::sync::Arc;

use bytes::Bytes;
use teampulse_core::clock::Clock;
use teampulse_core::outlet::Queue;
use teampulse_core::sample::{Sample, Turn};
use teampulse_core::stream::Subject;
use teampulse_core::streams::Streams;
use teampulse_messages::catalogue::shipped_or_bare;
use teampulse_messages::cdr::Writer;
use teampulse_messages::standard::Message as _;
use teampulse_messages::standard::sensor_msgs::Image;
use teampulse_messages::standard::std_msgs::Header;

use super::*;

const POINTS: &str = "/humans/persons/p001/robot1_front/rtmpose";
const DEPTH: &str = "/robot1/depth/image_raw";
const INFO: &str = "/robot1/depth/camera_info";

/// A calibration for pictures of this size: fx, fy, cx and cy [px].
pub(super) fn info(size: [u32; 2], [fx, fy, cx, cy]: [f64; 4]) -> Bytes {
    let mut writer = Writer::new();
    writer.write(&Header::default());
    writer.write(&size[1]);
    writer.write(&size[0]);
    writer.text("plumb_bob");
    writer.write(&vec![0.0_f64; 5]);
    writer.write(&[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    writer.write(&[0.0_f64; 9]);
    writer.write(&[0.0_f64; 12]);
    writer.write(&[0_u32; 6]);
    writer.write(&false);
    writer.finish()
}

/// A picture of 40 × 30 pixels, all of them 2 m away.
fn depth() -> Bytes {
    let (encoding, data) = ("16UC1".to_owned(), 2000_u16.to_le_bytes().repeat(40 * 30));
    Image { encoding, width: 40, height: 30, step: 80, data, ..Image::default() }.encode()
}

fn points() -> Stream {
    let stream = Stream::raw(POINTS, Subject::person("p001"), Shape::Sample);
    stream.with_channels(&[("nose_x", "px"), ("nose_y", "px"), ("nose_score", "1")])
}

fn messages(name: &str, type_name: &str) -> Stream {
    Stream::raw(name, Subject::robot("robot1"), Shape::Message(shipped_or_bare(type_name)))
}

fn record(number: u32, stream: Stream, at_ms: i64, data: Data) -> Record {
    let at = Time::from_nanos(at_ms * 1_000_000);
    let sample = Sample {
        stream: StreamId(number),
        measured: at,
        log_time: at,
        device_time: None,
        source_time: Some(at),
        period_ns: 0.0,
        index: 0,
        turn: Turn::OnTime,
        data,
    };
    Record { stream: Arc::new(stream), sample, cdr: Bytes::new() }
}

fn settings() -> Pose3d {
    toml::from_str(&format!("points = ['{POINTS}']\ndepth = '{DEPTH}'")).unwrap()
}

/// What comes of a frame at 1 s after these records.
fn placed(records: &[Record]) -> Result<Vec<f64>, String> {
    let settings = settings();
    let outlet = Queue::new().outlet(Clock::settable(), Streams::default());
    let mut camera = Camera::new(&settings);
    let frame = record(1, points(), 1000, Data::Sample(Arc::new([9.5, 14.5, 0.75])));
    records.iter().chain([&frame]).for_each(|record| camera.take(record, &outlet));
    let settled = camera.pairs.settled(Time::from_nanos(i64::MAX), true);
    let [frame] = settled.as_slice() else { panic!("{settled:?}") };
    let layout = &camera.points[&StreamId(1)].layout;
    camera.placed(frame, layout).map(|numbers| numbers.to_vec()).map_err(|why| why.to_string())
}

fn depth_at(at_ms: i64) -> Record {
    record(2, messages(DEPTH, IMAGE), at_ms, Data::Message(depth()))
}

fn calibration(message: Bytes) -> Record {
    record(3, messages(INFO, CAMERA_INFO), 0, Data::Message(message))
}

fn calibrated() -> Record {
    calibration(info([40, 30], [40.0, 40.0, 19.5, 14.5]))
}

#[test]
fn a_frame_with_its_depth_picture_is_placed() {
    let seen = placed(&[calibrated(), depth_at(1020)]).unwrap();
    assert_eq!(seen, [-0.5, 0.0, 2.0, 0.75, 0.0, 0.0]);
}

#[test]
fn a_depth_picture_that_is_late_is_not_taken() {
    let why = placed(&[calibrated(), depth_at(900), depth_at(1060)]).unwrap_err();
    assert!(
        why.contains(DEPTH) && why.contains("within 0.05 s") && why.contains("within_secs"),
        "{why}"
    );
    assert!(placed(&[calibrated()]).is_err());
}

#[test]
fn without_a_calibration_what_to_publish_is_said() {
    let why = placed(&[depth_at(1000)]).unwrap_err();
    assert!(why.contains(INFO) && why.contains("publish the sensor_msgs/msg/CameraInfo"), "{why}");
    let why = placed(&[calibration(info([40, 30], [0.0; 4])), depth_at(1000)]).unwrap_err();
    assert!(why.contains("focal lengths 0 and 0") && why.contains(INFO), "{why}");
    let why = placed(&[calibration(Bytes::from_static(b"\0\x01\0\0")), depth_at(1000)]);
    assert!(why.unwrap_err().contains("read the calibration"));
}

#[test]
fn pictures_that_are_not_aligned_or_no_distances_are_named() {
    let wide = calibration(info([848, 480], [600.0, 600.0, 400.0, 200.0]));
    let why = placed(&[wide, depth_at(1000)]).unwrap_err();
    assert!(why.contains("40 × 30 px") && why.contains("848 × 480 px"), "{why}");
    let (encoding, data) = ("rgb8".into(), vec![0; 3]);
    let colour = Image { encoding, width: 1, height: 1, step: 3, data, ..Image::default() };
    let colour = record(2, messages(DEPTH, IMAGE), 1000, Data::Message(colour.encode()));
    let why = placed(&[calibrated(), colour]).unwrap_err();
    assert!(why.contains("pixels of `rgb8`") && why.contains(DEPTH), "{why}");
}

#[test]
fn only_points_in_pixels_of_those_asked_for_are_wanted() {
    let Wants::Only(wants) = settings().wants() else { panic!() };
    let mut in_space = points();
    in_space.channels.iter_mut().for_each(|channel| channel.unit = "m".into());
    assert!(
        wants(&points()) && wants(&messages(DEPTH, IMAGE)) && wants(&messages(INFO, CAMERA_INFO))
    );
    assert!(
        !wants(&in_space) && !wants(&messages(POINTS, IMAGE)) && !wants(&messages(INFO, IMAGE))
    );
}

#[test]
fn points_in_space_are_about_whom_the_points_are_about() {
    let layout = Layout::of(&points()).unwrap();
    let stream = settings().stream(&points(), &layout);
    assert_eq!(stream.name, format!("{POINTS}_3d"));
    assert_eq!(
        (stream.id.as_str(), stream.inputs),
        ("p001", vec![POINTS.into(), DEPTH.into(), INFO.into()])
    );
}

#[test]
fn settings_that_have_no_meaning_are_refused() {
    let build = |settings: Pose3d| {
        let context = WorkerContext { clock: Clock::host() };
        settings.build(&context).map(drop).map_err(|error| error.path)
    };
    assert!(build(settings()).is_ok());
    for (broken, at) in [
        (Pose3d { points: Vec::new(), ..settings() }, "points"),
        (Pose3d { depth: "depth".into(), ..settings() }, "depth"),
        (Pose3d { camera_info: Some("/a*".into()), ..settings() }, "camera_info"),
        (Pose3d { within_secs: f64::NAN, ..settings() }, "within_secs"),
        (Pose3d { patch_px: 1_000_000, ..settings() }, "patch_px"),
        (Pose3d { most_spread_m: 0.0, ..settings() }, "most_spread_m"),
    ] {
        assert_eq!(build(broken).unwrap_err(), at);
    }
}
