//! Telegrams: the reports of a robot, before they become ROS messages.

use std::sync::Arc;

use super::battery::{Pack, Reading};
use super::drive::{Pose, Twist};
use super::radio::Reception;
use super::time::SimTime;

/// A report in transit.
#[derive(Clone, Debug, PartialEq)]
pub struct Telegram {
    /// The index of the topic among the team's published topics.
    pub stream: usize,
    /// When the telegram arrives.
    pub at: SimTime,
    /// When the report was measured, by the robot's clock.
    pub stamp: SimTime,
    /// The report.
    pub body: Body,
}

/// The content of a report.
#[derive(Clone, Debug, PartialEq)]
pub enum Body {
    /// The robot's pose and motion.
    Motion(Pose, Twist),
    /// The state of the robot's battery.
    Battery(Gauge),
    /// The reception of the router.
    Reception(Reception),
    /// The health of the robot.
    Health(Health),
    /// The temperature of the robot's computer [°C].
    Temperature(f64),
    /// The picture of the robot's camera.
    Picture(Arc<[u8]>),
    /// The goal that the robot is sent to.
    Goal(Pose),
}

/// The readings of a battery's gauge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gauge {
    /// The readings of the battery's sensors.
    pub reading: Reading,
    /// The remaining charge [Ah].
    pub charge_ah: f64,
    /// The charge when full [Ah].
    pub capacity_ah: f64,
}

impl Gauge {
    /// Returns the true state of a pack.
    pub fn of(pack: &Pack) -> Gauge {
        let (charge_ah, capacity_ah) = (pack.charge_ah(), pack.capacity_ah());
        Gauge { reading: pack.reading(), charge_ah, capacity_ah }
    }

    /// The state of charge [0..1].
    pub fn fraction(&self) -> f64 {
        self.charge_ah / self.capacity_ah
    }
}

/// The health of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Health {
    /// The state of the robot's battery.
    pub battery: Gauge,
    /// The temperature of the robot's computer [°C].
    pub computer_c: f64,
    /// The power of the robot's computer [W].
    pub computer_w: f64,
    /// The last reception of the router; `None` before the first.
    pub heard: Option<Reception>,
}
