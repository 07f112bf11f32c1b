//! Encodes the output of the simulation as ROS messages.

use bytes::Bytes;
use teampulse_core::time::Time;
use teampulse_emulators::robots::{
    Body, CELLS, FREQUENCY_HZ, Gauge, HEIGHT_PX, Health, NOISE_DBM, Pose, Published, Reception,
    SENT_DBM, Twist, WIDTH_PX,
};
use teampulse_messages::standard::Message;
use teampulse_messages::standard::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use teampulse_messages::standard::geometry_msgs as geometry;
use teampulse_messages::standard::nav_msgs::Odometry;
use teampulse_messages::standard::sensor_msgs::{BatteryState, Image, Temperature};
use teampulse_messages::standard::std_msgs::Header;
use teampulse_messages::standard::wireless_msgs::Connection;

use super::published::frame;

/// The variances of the pose and the twist along x, along y and about z [m², rad²].
const POSE_VARIANCES: [f64; 3] = [0.01, 0.01, 0.01];
const TWIST_VARIANCES: [f64; 3] = [1e-4, 1e-9, 1e-3];

/// Encodes a topic's data as a ROS message with a stamp: CDR with its four-byte header.
pub(super) fn encode(body: &Body, stamp: Time, published: &Published) -> Bytes {
    let robot = published.robot.as_str();
    let header = |frame_id: String| Header { stamp, frame_id };
    let base = format!("{robot}/base_link");
    match body {
        Body::Motion(pose, twist) => {
            odometry(header(frame(published)), base, *pose, *twist).encode()
        }
        Body::Battery(gauge) => battery_state(header(base), robot, gauge).encode(),
        Body::Reception(reception) => connection(*reception).encode(),
        Body::Health(health) => diagnostics(Header::at(stamp), robot, health).encode(),
        Body::Temperature(celsius) => {
            Temperature { header: header(base), temperature: *celsius, variance: 0.01 }.encode()
        }
        Body::Goal(pose) => {
            let (header, pose) = (header(frame(published)), pose_of(*pose));
            geometry::PoseStamped { header, pose }.encode()
        }
        Body::Picture(rgb) => image(header(format!("{robot}/camera")), rgb).encode(),
    }
}

fn pose_of(pose: Pose) -> geometry::Pose {
    let position = geometry::Point { x: pose.at.x_m, y: pose.at.y_m, z: 0.0 };
    geometry::Pose { position, orientation: geometry::Quaternion::from_yaw(pose.heading_rad) }
}

fn odometry(header: Header, child_frame_id: String, pose: Pose, twist: Twist) -> Odometry {
    let linear = geometry::Vector3 { x: twist.speed_mps, ..Default::default() };
    let angular = geometry::Vector3 { z: twist.turn_radps, ..Default::default() };
    Odometry {
        header,
        child_frame_id,
        pose: geometry::PoseWithCovariance {
            pose: pose_of(pose),
            covariance: covariance(POSE_VARIANCES),
        },
        twist: geometry::TwistWithCovariance {
            twist: geometry::Twist { linear, angular },
            covariance: covariance(TWIST_VARIANCES),
        },
    }
}

fn covariance(variances: [f64; 3]) -> [f64; 36] {
    let mut matrix = [0.0; 36];
    for (axis, variance) in [0, 1, 5].into_iter().zip(variances) {
        matrix[7 * axis] = variance;
    }
    matrix
}

fn battery_state(header: Header, robot: &str, gauge: &Gauge) -> BatteryState {
    let cell_v = gauge.reading.voltage_v / f64::from(CELLS);
    BatteryState {
        header,
        voltage: gauge.reading.voltage_v as f32,
        temperature: gauge.reading.temperature_c as f32,
        current: -gauge.reading.current_a as f32,
        charge: gauge.charge_ah as f32,
        capacity: gauge.capacity_ah as f32,
        design_capacity: gauge.capacity_ah as f32,
        percentage: gauge.fraction() as f32,
        power_supply_status: BatteryState::STATUS_DISCHARGING,
        power_supply_health: BatteryState::HEALTH_GOOD,
        power_supply_technology: BatteryState::TECHNOLOGY_LION,
        present: true,
        cell_voltage: vec![cell_v as f32; CELLS as usize],
        cell_temperature: Vec::new(),
        location: "base".into(),
        serial_number: format!("sim-{robot}"),
    }
}

fn connection(reception: Reception) -> Connection {
    Connection {
        bitrate: reception.bitrate_mbitps as f32,
        txpower: SENT_DBM as i16,
        link_quality_raw: format!("{:.0}/70", reception.quality()),
        link_quality: (reception.quality() / 70.0) as f32,
        signal_level: reception.signal_dbm as i16,
        noise_level: NOISE_DBM as i16,
        essid: "arena".into(),
        bssid: "02:00:00:00:00:01".into(),
        frequency: FREQUENCY_HZ / 1e9,
    }
}

fn image(header: Header, rgb: &[u8]) -> Image {
    Image {
        header,
        height: HEIGHT_PX,
        width: WIDTH_PX,
        encoding: "rgb8".into(),
        is_bigendian: 0,
        step: 3 * WIDTH_PX,
        data: rgb.to_vec(),
    }
}

fn diagnostics(header: Header, robot: &str, health: &Health) -> DiagnosticArray {
    let part = |name: &str, level: u8, values: Vec<KeyValue>| DiagnosticStatus {
        level,
        name: format!("{robot}: {name}"),
        message: ["ok", "unusual", "failing"][usize::from(level)].into(),
        hardware_id: robot.into(),
        values,
    };
    let percent = 100.0 * health.battery.fraction();
    let battery = vec![
        value("charge [%]", percent),
        value("voltage [V]", health.battery.reading.voltage_v),
        value("temperature [degC]", health.battery.reading.temperature_c),
    ];
    let computer =
        vec![value("power [W]", health.computer_w), value("temperature [degC]", health.computer_c)];
    let mut status = vec![
        part("battery", level(-percent, -20.0, -10.0), battery),
        part("computer", level(health.computer_c, 70.0, 90.0), computer),
    ];
    if let Some(heard) = health.heard {
        let values = vec![value("signal [dBm]", heard.signal_dbm)];
        status.push(part("wifi", level(-heard.signal_dbm, 75.0, 85.0), values));
    }
    DiagnosticArray { header, status }
}

fn level(value: f64, warn_above: f64, error_above: f64) -> u8 {
    match value {
        value if value > error_above => DiagnosticStatus::ERROR,
        value if value > warn_above => DiagnosticStatus::WARN,
        _ => DiagnosticStatus::OK,
    }
}

fn value(key: &str, value: f64) -> KeyValue {
    KeyValue { key: key.into(), value: format!("{value:.2}") }
}
