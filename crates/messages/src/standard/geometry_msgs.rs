//! `geometry_msgs`: the parts of odometry and commands.

use super::message;
use super::std_msgs::Header;

/// A position [m].
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

/// A vector, in the unit of the quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vector3 {
    /// The component along the forward axis, or about it.
    pub x: f64,
    /// The component along the left axis, or about it.
    pub y: f64,
    /// The component along the vertical axis, or about it.
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
    /// The orientation of an object on the ground with heading `yaw_rad` [rad].
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

/// A position and an orientation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// The position [m].
    pub position: Point,
    /// The orientation.
    pub orientation: Quaternion,
}

message!(Pose { position, orientation } = "geometry_msgs/msg/Pose");

/// A pose at a time, in a frame, such as the goal of a robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseStamped {
    /// The time and the frame.
    pub header: Header,
    /// The pose.
    pub pose: Pose,
}

message!(PoseStamped { header, pose } = "geometry_msgs/msg/PoseStamped");

/// A pose with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseWithCovariance {
    /// The pose.
    pub pose: Pose,
    /// The covariance, row by row, of x, y, z [m] and the rotations about x, y, z [rad].
    pub covariance: [f64; 36],
}

message!(PoseWithCovariance { pose, covariance } = "geometry_msgs/msg/PoseWithCovariance");

impl Default for PoseWithCovariance {
    fn default() -> PoseWithCovariance {
        PoseWithCovariance { pose: Pose::default(), covariance: [0.0; 36] }
    }
}

/// A linear and an angular velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Twist {
    /// The linear velocity [m/s].
    pub linear: Vector3,
    /// The angular velocity [rad/s].
    pub angular: Vector3,
}

message!(Twist { linear, angular } = "geometry_msgs/msg/Twist");

/// A twist with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwistWithCovariance {
    /// The twist.
    pub twist: Twist,
    /// The covariance, row by row, of the linear [m/s] and the angular velocity [rad/s].
    pub covariance: [f64; 36],
}

message!(TwistWithCovariance { twist, covariance } = "geometry_msgs/msg/TwistWithCovariance");

impl Default for TwistWithCovariance {
    fn default() -> TwistWithCovariance {
        TwistWithCovariance { twist: Twist::default(), covariance: [0.0; 36] }
    }
}
