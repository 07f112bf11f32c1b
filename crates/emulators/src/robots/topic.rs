//! The topics of a simulated robot.

use schemars::JsonSchema;
use serde::Deserialize;

/// One of the topics that a robot publishes.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Topic {
    /// Its pose and speed from wheel odometry.
    Odom,
    /// Its battery.
    BatteryState,
    /// Its link to the router.
    Wifi,
    /// Its own report on its health.
    Diagnostics,
    /// The temperature of its computer.
    Temperature,
    /// Its camera.
    Camera,
    /// The goals that people send.
    #[serde(skip)]
    GoalPose,
    /// Its true pose and motion.
    #[serde(skip)]
    TruePose,
    /// The true state of its battery.
    #[serde(skip)]
    TruePower,
}

impl Topic {
    /// Whether it is the ground truth, which no fault affects.
    pub fn is_truth(self) -> bool {
        matches!(self, Topic::TruePose | Topic::TruePower)
    }
}
