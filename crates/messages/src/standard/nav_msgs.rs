//! `nav_msgs`: odometry.

use super::geometry_msgs::{PoseWithCovariance, TwistWithCovariance};
use super::message;
use super::std_msgs::Header;

/// Where a robot is and how it moves, by its own reckoning.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Odometry {
    /// When, and the frame of `pose`.
    pub header: Header,
    /// The frame of `twist`: the robot's own.
    pub child_frame_id: String,
    /// Where it is.
    pub pose: PoseWithCovariance,
    /// How it moves.
    pub twist: TwistWithCovariance,
}

message!(Odometry { header, child_frame_id, pose, twist } = "nav_msgs/msg/Odometry");
