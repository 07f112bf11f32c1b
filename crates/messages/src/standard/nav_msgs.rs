//! `nav_msgs`: odometry.

use super::geometry_msgs::{PoseWithCovariance, TwistWithCovariance};
use super::message;
use super::std_msgs::Header;

/// The pose and the velocity of a robot by odometry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Odometry {
    /// The time, and the frame of `pose`.
    pub header: Header,
    /// The frame of `twist`: the robot's own.
    pub child_frame_id: String,
    /// The pose.
    pub pose: PoseWithCovariance,
    /// The velocity.
    pub twist: TwistWithCovariance,
}

message!(Odometry { header, child_frame_id, pose, twist } = "nav_msgs/msg/Odometry");
