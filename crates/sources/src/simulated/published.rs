//! What is published: a topic of a robot as a stream.

use std::sync::Arc;

use teampulse_core::qos::Qos;
use teampulse_core::stream::{Schema, Shape, Signal, Stream, Subject};
use teampulse_messages::catalogue::shipped;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::diagnostic_msgs::DiagnosticArray;
use teampulse_messages::standard::geometry_msgs::PoseStamped;
use teampulse_messages::standard::nav_msgs::Odometry;
use teampulse_messages::standard::sensor_msgs::{BatteryState, Image, Temperature};
use teampulse_messages::standard::wireless_msgs::Connection;

use super::topic::Topic;

/// A topic of a robot.
#[derive(Clone, Debug)]
pub struct Published {
    /// The robot's name.
    pub robot: String,
    /// Which topic.
    pub topic: Topic,
    /// Its rate [Hz]; 0 where it comes now and then.
    pub rate_hz: f64,
}

impl Published {
    /// The stream to declare. The ground truth has no signal, so that no feature runs on it.
    pub fn stream(&self) -> Stream {
        let shape = Shape::Message(schema(self.type_name()));
        let mut stream = Stream::raw(self.name(), Subject::robot(&self.robot), shape);
        stream.signal = self.signal();
        stream.device = "simulated".into();
        stream.rate_hz = self.rate_hz;
        stream.doc = self.doc().into();
        stream.qos = vec![self.qos()];
        stream.with_channels(self.channels())
    }

    /// The frame of the poses in it.
    pub fn frame(&self) -> String {
        let on_map = self.topic.is_truth() || self.topic == Topic::GoalPose;
        if on_map { "map".into() } else { format!("{}/odom", self.robot) }
    }

    fn name(&self) -> String {
        let robot = &self.robot;
        match self.topic {
            Topic::Odom => format!("/{robot}/odom"),
            Topic::BatteryState => format!("/{robot}/battery_state"),
            Topic::Wifi => format!("/{robot}/wifi"),
            Topic::Diagnostics => format!("/{robot}/diagnostics"),
            Topic::Temperature => format!("/{robot}/temperature"),
            Topic::Camera => format!("/{robot}/camera/image_raw"),
            Topic::GoalPose => format!("/{robot}/goal_pose"),
            Topic::TruePose => format!("/sim/truth/{robot}"),
            Topic::TruePower => format!("/sim/truth/{robot}/battery_state"),
        }
    }

    fn type_name(&self) -> &'static str {
        match self.topic {
            Topic::Odom | Topic::TruePose => Odometry::NAME,
            Topic::BatteryState | Topic::TruePower => BatteryState::NAME,
            Topic::Wifi => Connection::NAME,
            Topic::Diagnostics => DiagnosticArray::NAME,
            Topic::Temperature => Temperature::NAME,
            Topic::Camera => Image::NAME,
            Topic::GoalPose => PoseStamped::NAME,
        }
    }

    fn signal(&self) -> Signal {
        match self.topic {
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

    fn channels(&self) -> &'static [(&'static str, &'static str)] {
        match self.topic {
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

    fn qos(&self) -> Qos {
        match self.topic {
            Topic::Wifi | Topic::Camera => Qos::best_effort(5),
            _ => Qos::reliable(10),
        }
    }

    fn doc(&self) -> &'static str {
        match self.topic {
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
}

/// The schema of a standard type; without its definition where none is shipped.
fn schema(type_name: &str) -> Arc<Schema> {
    let bare = || Schema {
        name: type_name.into(),
        encoding: "ros2msg".into(),
        text: String::new(),
        hash: String::new(),
    };
    shipped(type_name).unwrap_or_else(|| Arc::new(bare()))
}
