//! Telegrams: the reports of a robot, before they are ROS messages.

use std::sync::Arc;

use super::battery::{Pack, Reading};
use super::drive::{Pose, Twist};
use super::radio::Reception;
use super::time::SimTime;

/// A report on its way.
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
    /// Where the robot is and how it moves.
    Motion(Pose, Twist),
    /// The state of its battery.
    Battery(Gauge),
    /// How well it hears the router.
    Reception(Reception),
    /// How it is.
    Health(Health),
    /// The temperature of its computer [°C].
    Temperature(f64),
    /// What its camera shows.
    Picture(Arc<[u8]>),
    /// The place that it is sent to.
    Goal(Pose),
}

/// The readings of a battery's gauge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gauge {
    /// What its sensors read.
    pub reading: Reading,
    /// The charge that is left [Ah].
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

/// How a robot is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Health {
    /// Its battery.
    pub battery: Gauge,
    /// The temperature of its computer [°C].
    pub computer_c: f64,
    /// What its computer consumes [W].
    pub computer_w: f64,
    /// How well it last heard the router; `None` before it first listened.
    pub heard: Option<Reception>,
}
