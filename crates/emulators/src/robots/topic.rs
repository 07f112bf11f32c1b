//! The topics of a simulated robot.

use schemars::JsonSchema;
use serde::Deserialize;

/// One of the topics that a robot publishes.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Topic {
    /// The robot's pose and speed from wheel odometry.
    Odom,
    /// The robot's battery.
    BatteryState,
    /// The robot's link to the router.
    Wifi,
    /// The robot's report on its own health.
    Diagnostics,
    /// The temperature of the robot's computer.
    Temperature,
    /// The robot's camera.
    Camera,
    /// The goals that people send.
    #[serde(skip)]
    GoalPose,
    /// The robot's true pose and motion.
    #[serde(skip)]
    TruePose,
    /// The true state of the robot's battery.
    #[serde(skip)]
    TruePower,
}

impl Topic {
    /// Whether the topic is ground truth, which no fault affects.
    pub fn is_truth(self) -> bool {
        matches!(self, Topic::TruePose | Topic::TruePower)
    }
}
