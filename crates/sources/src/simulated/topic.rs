//! The topics of a simulated robot.

use schemars::JsonSchema;
use serde::Deserialize;

/// One of the topics that a robot publishes.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Topic {
    /// Its pose and speed as its wheels tell them.
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
    /// Where people tell it to drive to.
    #[serde(skip)]
    GoalPose,
    /// Where it truly is and how it truly moves.
    #[serde(skip)]
    TruePose,
    /// What its battery truly gives.
    #[serde(skip)]
    TruePower,
}

impl Topic {
    /// Whether it tells the truth, which no fault can touch.
    pub fn is_truth(self) -> bool {
        matches!(self, Topic::TruePose | Topic::TruePower)
    }
}
