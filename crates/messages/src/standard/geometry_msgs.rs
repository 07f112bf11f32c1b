//! `geometry_msgs`: what odometry and commands are made of.

use super::message;
use super::std_msgs::Header;

/// A place [m].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Forward.
    pub x: f64,
    /// To the left.
    pub y: f64,
    /// Up.
    pub z: f64,
}

message!(Point { x, y, z } = "geometry_msgs/msg/Point");

/// A direction with a length, in the unit of what it stands for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vector3 {
    /// Forward, or about the forward axis.
    pub x: f64,
    /// To the left, or about the left axis.
    pub y: f64,
    /// Up, or about the vertical axis.
    pub z: f64,
}

message!(Vector3 { x, y, z } = "geometry_msgs/msg/Vector3");

/// An orientation, as a unit quaternion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quaternion {
    /// Imaginary part along x.
    pub x: f64,
    /// Imaginary part along y.
    pub y: f64,
    /// Imaginary part along z.
    pub z: f64,
    /// Real part.
    pub w: f64,
}

message!(Quaternion { x, y, z, w } = "geometry_msgs/msg/Quaternion");

impl Quaternion {
    /// The orientation of something on the ground that looks to `yaw_rad` [rad].
    pub fn from_yaw(yaw_rad: f64) -> Quaternion {
        let (z, w) = (yaw_rad / 2.0).sin_cos();
        Quaternion { x: 0.0, y: 0.0, z, w }
    }

    /// The angle about the vertical axis [rad], from −π to π.
    pub fn yaw_rad(&self) -> f64 {
        let Quaternion { x, y, z, w } = *self;
        (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z))
    }
}

impl Default for Quaternion {
    fn default() -> Quaternion {
        Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }
    }
}

/// A place and an orientation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Where [m].
    pub position: Point,
    /// Which way round.
    pub orientation: Quaternion,
}

message!(Pose { position, orientation } = "geometry_msgs/msg/Pose");

/// A pose at a time, in a frame: the goal of a robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseStamped {
    /// When, and in which frame.
    pub header: Header,
    /// The pose.
    pub pose: Pose,
}

message!(PoseStamped { header, pose } = "geometry_msgs/msg/PoseStamped");

/// A pose and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseWithCovariance {
    /// The pose.
    pub pose: Pose,
    /// Row by row, of x, y, z [m] and the rotations about x, y, z [rad].
    pub covariance: [f64; 36],
}

message!(PoseWithCovariance { pose, covariance } = "geometry_msgs/msg/PoseWithCovariance");

impl Default for PoseWithCovariance {
    fn default() -> PoseWithCovariance {
        PoseWithCovariance { pose: Pose::default(), covariance: [0.0; 36] }
    }
}

/// A speed and a rate of turning.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Twist {
    /// Speed [m/s].
    pub linear: Vector3,
    /// Rate of turning [rad/s].
    pub angular: Vector3,
}

message!(Twist { linear, angular } = "geometry_msgs/msg/Twist");

/// A twist and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwistWithCovariance {
    /// The twist.
    pub twist: Twist,
    /// Row by row, of the speeds [m/s] and the rates of turning [rad/s].
    pub covariance: [f64; 36],
}

message!(TwistWithCovariance { twist, covariance } = "geometry_msgs/msg/TwistWithCovariance");

impl Default for TwistWithCovariance {
    fn default() -> TwistWithCovariance {
        TwistWithCovariance { twist: Twist::default(), covariance: [0.0; 36] }
    }
}
