//! Messages written by an independent implementation are read, and written again byte for byte.

use std::fmt::Debug;

use teampulse_core::time::Time;
use teampulse_messages::catalogue::shipped;
use teampulse_messages::definition::Definition;
use teampulse_messages::fields::{Fields, header_stamp, starts_with_header};
use teampulse_messages::standard::Message;
use teampulse_messages::standard::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use teampulse_messages::standard::geometry_msgs::{
    Point, Pose, PoseWithCovariance, Quaternion, Twist, TwistWithCovariance, Vector3,
};
use teampulse_messages::standard::nav_msgs::Odometry;
use teampulse_messages::standard::sensor_msgs::{BatteryState, Image, Temperature};
use teampulse_messages::standard::std_msgs::Header;
use teampulse_messages::standard::teampulse_msgs as msgs;
use teampulse_messages::standard::wireless_msgs::Connection;
use teampulse_messages::value::flatten;

const STAMP: Time = Time::from_stamp(1_700_000_000, 123_456_789);

/// The little-endian and the big-endian form of the message of a type.
fn vectors(type_name: &str) -> [Vec<u8>; 2] {
    let lines = include_str!("vectors.txt").lines().filter_map(|line| line.split_once(' '));
    let of_type = lines.filter(|(name, _)| *name == type_name).map(|(_, hex)| from_hex(hex));
    of_type.collect::<Vec<_>>().try_into().expect("each message in two forms")
}

fn from_hex(hex: &str) -> Vec<u8> {
    let digit = |k: usize| u8::from_str_radix(&hex[k..k + 2], 16).expect("a byte");
    (0..hex.len()).step_by(2).map(digit).collect()
}

fn header() -> Header {
    Header { stamp: STAMP, frame_id: "odom".into() }
}

fn check<T: Message + Debug + PartialEq>(expected: &T) {
    let [little, big] = vectors(T::NAME);
    assert_eq!(T::decode(&little).as_ref(), Ok(expected));
    assert_eq!(T::decode(&big).as_ref(), Ok(expected));
    assert_eq!(expected.encode(), little);
}

fn definition(type_name: &str) -> Definition {
    let schema = shipped(type_name).expect("it is shipped");
    Definition::of(&schema).expect("it is a definition")
}

fn numbers(type_name: &str, paths: &[&str]) -> [Vec<f64>; 2] {
    let fields = Fields::compile(&definition(type_name), paths).expect("paths that there are");
    vectors(type_name).map(|cdr| {
        let mut numbers = Vec::new();
        fields.read(&cdr, &mut numbers).expect("a whole message");
        numbers
    })
}

#[test]
fn odometry_is_read_and_written() {
    let position = Point { x: 1.0, y: 2.0, z: 3.0 };
    let twist = Twist {
        linear: Vector3 { x: 0.5, ..Default::default() },
        angular: Vector3 { z: -0.25, ..Default::default() },
    };
    check(&Odometry {
        header: header(),
        child_frame_id: "base_link".into(),
        pose: PoseWithCovariance {
            pose: Pose { position, orientation: Quaternion::default() },
            covariance: std::array::from_fn(|k| k as f64),
        },
        twist: TwistWithCovariance { twist, ..Default::default() },
    });
}

#[test]
fn a_battery_state_is_read_and_written() {
    check(&BatteryState {
        header: header(),
        voltage: 12.5,
        temperature: 25.0,
        current: -1.5,
        charge: 2.0,
        capacity: 3.0,
        design_capacity: 3.5,
        percentage: 0.75,
        power_supply_status: BatteryState::STATUS_DISCHARGING,
        power_supply_health: BatteryState::HEALTH_GOOD,
        power_supply_technology: BatteryState::TECHNOLOGY_LION,
        present: true,
        cell_voltage: vec![4.0, 4.25, 4.5],
        cell_temperature: vec![],
        location: "slot 1".into(),
        serial_number: "42".into(),
    });
}

#[test]
fn diagnostics_are_read_and_written() {
    let pair = |key: &str, value: &str| KeyValue { key: key.into(), value: value.into() };
    let motor = DiagnosticStatus {
        level: DiagnosticStatus::WARN,
        name: "motor".into(),
        message: "warm".into(),
        hardware_id: "m1".into(),
        values: vec![pair("temp", " 61.5 "), pair("mode", "auto")],
    };
    let lidar = DiagnosticStatus { name: "lidar".into(), ..Default::default() };
    check(&DiagnosticArray { header: header(), status: vec![motor, lidar] });
}

#[test]
fn images_and_temperatures_are_read_and_written() {
    check(&Image {
        header: header(),
        height: 2,
        width: 3,
        encoding: "mono8".into(),
        is_bigendian: 0,
        step: 3,
        data: vec![0, 1, 2, 3, 4, 5],
    });
    check(&Temperature { header: header(), temperature: 36.5, variance: 0.01 });
}

#[test]
fn a_wireless_link_is_read_and_written() {
    check(&Connection {
        bitrate: 54.0,
        txpower: 20,
        link_quality_raw: "57/70".into(),
        link_quality: 0.75,
        signal_level: -53,
        noise_level: -95,
        essid: "lab".into(),
        bssid: "00:11:22:33:44:55".into(),
        frequency: 2.437,
    });
}

#[test]
fn samples_waves_and_features_are_read_and_written() {
    let header = Header::at(STAMP);
    check(&msgs::Sample {
        header: header.clone(),
        device_time: -5,
        index: 7,
        values: vec![1.5, 2.5],
    });
    check(&msgs::Wave {
        header: header.clone(),
        device_time: 123_456_789_012,
        index: 8,
        period_ns: 7_692_307.75,
        channels: 2,
        samples: vec![1.0, 2.0, 3.0, 4.0],
    });
    check(&msgs::Feature {
        header,
        window_secs: 60.0,
        coverage: 0.75,
        quality: 0.5,
        values: vec![42.0, f64::INFINITY],
        sigmas: vec![],
        reasons: vec![0, 5],
    });
}

#[test]
fn events_descriptions_and_statuses_are_read_and_written() {
    let header = Header::at(STAMP);
    check(&msgs::Event {
        header: header.clone(),
        device_time: msgs::NO_DEVICE_TIME,
        kind: "marker".into(),
        label: "go".into(),
        value: 3.0,
        duration_secs: 0.0,
    });
    check(&msgs::StreamDescription {
        header: header.clone(),
        name: "/humans/persons/p001/polar_h10/ecg".into(),
        r#type: msgs::Wave::NAME.into(),
        signal: "ecg".into(),
        about: 0,
        id: "p001".into(),
        device: "polar_h10".into(),
        origin: 1,
        inputs: vec!["/a".into(), "/b".into()],
        method: "m".into(),
        channels: vec!["ecg".into()],
        units: vec!["V".into()],
        rate_hz: 130.0,
        scales: vec![1e-6],
        doc: "d.".into(),
        family: "heart".into(),
        window_secs: 30.0,
        beside: "/b".into(),
    });
    check(&msgs::StreamStatus {
        header,
        name: "/a".into(),
        state: 3,
        reason: "late".into(),
        rate_hz: 1.0,
        age_secs: 2.0,
        received: 3,
        lost_source: msgs::StreamStatus::LOST_UNKNOWN,
        lost_queue: 4,
        late: 5,
        duplicates: 6,
        clock: 7,
        epoch: 8,
        offset_secs: 9.0,
        skew_ppm: 10.0,
        jitter_secs: 11.0,
        sigma_secs: 12.0,
        latency_secs: 13.0,
    });
}

#[test]
fn fields_are_read_in_the_order_in_which_they_were_asked_for() {
    let paths = ["twist.twist.angular.z", "pose.pose.position.x", "pose.covariance[35]"];
    for read in numbers(Odometry::NAME, &paths) {
        assert_eq!(read, [-0.25, 1.0, 35.0]);
    }
}

#[test]
fn a_text_is_the_number_that_it_spells() {
    let paths = ["serial_number", "cell_voltage[2]", "present", "location", "cell_voltage[3]"];
    for read in numbers(BatteryState::NAME, &paths) {
        assert_eq!(read[..3], [42.0, 4.5, 1.0]);
        assert!(read[3].is_nan() && read[4].is_nan());
    }
}

#[test]
fn fields_are_found_inside_sequences_of_messages() {
    let paths = [
        "status[0].values[0].value",
        "status[1].level",
        "status[0].level",
        "status[1].values[0].key",
    ];
    for read in numbers(DiagnosticArray::NAME, &paths) {
        assert_eq!(read[..3], [61.5, 0.0, 1.0]);
        assert!(read[3].is_nan());
    }
}

#[test]
fn a_field_may_be_asked_for_twice() {
    for read in numbers(Temperature::NAME, &["temperature", "variance", "temperature"]) {
        assert_eq!(read, [36.5, 0.01, 36.5]);
    }
}

#[test]
fn a_header_gives_the_stamp() {
    for cdr in vectors(Odometry::NAME) {
        assert_eq!(header_stamp(&cdr), Some(STAMP));
    }
    let with_header = |name| starts_with_header(&definition(name));
    assert!(with_header("nav_msgs/msg/Odometry"));
    assert!(with_header("foxglove_msgs/msg/CompressedVideo"));
    assert!(!with_header("builtin_interfaces/msg/Time") && !with_header("rosgraph_msgs/msg/Clock"));
    assert!(!with_header("wireless_msgs/msg/Connection"));
    assert_eq!(header_stamp(&Odometry::default().encode()), None, "a stamp that was never set");
}

#[test]
fn any_message_is_a_list_of_its_values() {
    let definition = definition(Image::NAME);
    for cdr in vectors(Image::NAME) {
        let values = flatten(&definition, &cdr, 5).unwrap();
        let lines: Vec<_> = values.iter().map(|(path, value)| format!("{path} {value}")).collect();
        let expected = [
            "header.stamp.sec 1700000000",
            "header.stamp.nanosec 123456789",
            "header.frame_id odom",
            "height 2",
            "width 3",
            "encoding mono8",
            "is_bigendian 0",
            "step 3",
            "data [6 values]",
        ];
        assert_eq!(lines, expected);
        let values = flatten(&definition, &cdr, 6).unwrap();
        assert_eq!(values.last().map(|(path, _)| path.as_str()), Some("data[5]"));
    }
}
