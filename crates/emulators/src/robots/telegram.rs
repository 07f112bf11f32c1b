//! Telegrams: the reports of a robot, before they are ROS messages.

use std::sync::Arc;

use super::battery::{Pack, Reading};
use super::drive::{Pose, Twist};
use super::radio::Reception;
use super::time::SimTime;

/// A report in transit.
#[derive(Clone, Debug, PartialEq)]
pub struct Telegram {
    /// The index of its topic among those of the team.
    pub stream: usize,
    /// When it arrives.
    pub at: SimTime,
    /// When it was measured, by the robot's own clock.
    pub stamp: SimTime,
    /// The report.
    pub body: Body,
}

/// The content of a report.
#[derive(Clone, Debug, PartialEq)]
pub enum Body {
    /// The robot's pose and motion.
    Motion(Pose, Twist),
    /// The state of its battery.
    Battery(Gauge),
    /// The reception of the router.
    Reception(Reception),
    /// Its health.
    Health(Health),
    /// The temperature of its computer [°C].
    Temperature(f64),
    /// Its camera picture.
    Picture(Arc<[u8]>),
    /// The goal that it is sent to.
    Goal(Pose),
}

/// The readings of a battery's gauge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gauge {
    /// The readings of its sensors.
    pub reading: Reading,
    /// The remaining charge [Ah].
    pub charge_ah: f64,
    /// The charge when full [Ah].
    pub capacity_ah: f64,
}

impl Gauge {
    /// The true state of a pack.
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
    /// Its battery.
    pub battery: Gauge,
    /// The temperature of its computer [°C].
    pub computer_c: f64,
    /// The power of its computer [W].
    pub computer_w: f64,
    /// The last reception of the router; `None` before the first.
    pub heard: Option<Reception>,
}
