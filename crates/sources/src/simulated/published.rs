//! The topics of a simulated robot as streams.

use teampulse_core::qos::Qos;
use teampulse_core::stream::{Shape, Signal, Stream, Subject};
use teampulse_emulators::robots::{Published, Topic};
use teampulse_messages::catalogue::shipped_or_bare;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::diagnostic_msgs::DiagnosticArray;
use teampulse_messages::standard::geometry_msgs::PoseStamped;
use teampulse_messages::standard::nav_msgs::Odometry;
use teampulse_messages::standard::sensor_msgs::{BatteryState, Image, Temperature};
use teampulse_messages::standard::wireless_msgs::Connection;

/// The prefix of the topics with the ground truth.
pub(crate) const TRUTH: &str = "/sim/truth/";

/// Returns the stream to declare for a topic. The ground truth has no signal, so that no feature runs on it.
pub(super) fn stream(published: &Published) -> Stream {
    let shape = Shape::Message(shipped_or_bare(type_name(published.topic)));
    let mut stream = Stream::raw(name(published), Subject::robot(&published.robot), shape);
    stream.signal = signal(published.topic);
    stream.device = "simulated".into();
    stream.rate_hz = published.rate_hz;
    stream.doc = doc(published.topic).into();
    stream.qos = vec![qos(published.topic)];
    stream.with_channels(channels(published.topic))
}

/// Returns the frame of the poses in a topic.
pub(super) fn frame(published: &Published) -> String {
    let on_map = published.topic.is_truth() || published.topic == Topic::GoalPose;
    if on_map { "map".into() } else { format!("{}/odom", published.robot) }
}

fn name(published: &Published) -> String {
    let robot = &published.robot;
    match published.topic {
        Topic::Odom => format!("/{robot}/odom"),
        Topic::BatteryState => format!("/{robot}/battery_state"),
        Topic::Wifi => format!("/{robot}/wifi"),
        Topic::Diagnostics => format!("/{robot}/diagnostics"),
        Topic::Temperature => format!("/{robot}/temperature"),
        Topic::Camera => format!("/{robot}/camera/image_raw"),
        Topic::GoalPose => format!("/{robot}/goal_pose"),
        Topic::TruePose => format!("{TRUTH}{robot}"),
        Topic::TruePower => format!("{TRUTH}{robot}/battery_state"),
    }
}

fn type_name(topic: Topic) -> &'static str {
    match topic {
        Topic::Odom | Topic::TruePose => Odometry::NAME,
        Topic::BatteryState | Topic::TruePower => BatteryState::NAME,
        Topic::Wifi => Connection::NAME,
        Topic::Diagnostics => DiagnosticArray::NAME,
        Topic::Temperature => Temperature::NAME,
        Topic::Camera => Image::NAME,
        Topic::GoalPose => PoseStamped::NAME,
    }
}

fn signal(topic: Topic) -> Signal {
    match topic {
        Topic::Odom => Signal::Odometry,
        Topic::BatteryState => Signal::Battery,
        Topic::Wifi => Signal::Link,
        Topic::Diagnostics => Signal::Diagnostics,
        Topic::Temperature => Signal::Temperature,
        Topic::Camera => Signal::Image,
        Topic::GoalPose => Signal::Input,
        Topic::TruePose | Topic::TruePower => Signal::Other,
    }
}

fn channels(topic: Topic) -> &'static [(&'static str, &'static str)] {
    match topic {
        Topic::Odom | Topic::TruePose => &[
            ("pose.pose.position.x", "m"),
            ("pose.pose.position.y", "m"),
            ("twist.twist.linear.x", "m/s"),
            ("twist.twist.angular.z", "rad/s"),
        ],
        Topic::BatteryState | Topic::TruePower => {
            &[("percentage", "1"), ("voltage", "V"), ("current", "A")]
        }
        Topic::Wifi => &[("signal_level", "dBm"), ("link_quality", "1")],
        Topic::Temperature => &[("temperature", "degC")],
        Topic::GoalPose => &[("pose.position.x", "m"), ("pose.position.y", "m")],
        Topic::Diagnostics | Topic::Camera => &[],
    }
}

fn qos(topic: Topic) -> Qos {
    match topic {
        Topic::Wifi | Topic::Camera => Qos::best_effort(5),
        _ => Qos::reliable(10),
    }
}

fn doc(topic: Topic) -> &'static str {
    match topic {
        Topic::Odom => "estimated pose of a simulated robot",
        Topic::BatteryState => "the battery of a simulated robot",
        Topic::Wifi => "signal level of a simulated robot's radio link",
        Topic::Diagnostics => "diagnostics of a simulated robot",
        Topic::Temperature => "the temperature of a simulated robot's computer",
        Topic::Camera => "a simulated robot in its arena, from above",
        Topic::GoalPose => "goals that simulated people send to a simulated robot",
        Topic::TruePose => "true pose of a simulated robot",
        Topic::TruePower => "true power of a simulated robot's battery",
    }
}
