//! The settings of a simulated team.

use crate::task::{Plan, Skill, Task};

use super::script::Scene;
use super::topic::Topic;

/// The slowest rate at which the simulation advances [Hz].
const LEAST_TICK_HZ: f64 = 20.0;

/// A team of robots in an arena, and the people who command them.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The names of the robots.
    pub robots: Vec<String>,
    /// The seed of all random numbers.
    pub seed: u64,
    /// The side of the square arena [m].
    pub arena_side_m: f64,
    /// The number of boxes in the arena.
    pub boxes: u32,
    /// The number of obstacles that move in the arena.
    pub obstacles: u32,
    /// The top speed of a robot [m/s].
    pub top_speed_mps: f64,
    /// The mean consumption of a robot's computer [W].
    pub cpu_consumption_w: f64,
    /// The capacity of a robot's battery [Ah].
    pub battery_capacity_ah: f64,
    /// The topics that each robot publishes, with their rates above 0 [Hz].
    pub rates: Vec<(Topic, f64)>,
    /// The number of people.
    pub people: u32,
    /// The task that each person performs.
    pub task: Plan,
    /// The script: which robot changes, how and when.
    pub script: Vec<Scene>,
}

impl Default for Settings {
    /// Returns five robots that publish the common topics, without people who command them.
    fn default() -> Settings {
        Settings {
            robots: (1..=5).map(|number| format!("robot{number}")).collect(),
            seed: 1,
            arena_side_m: 10.0,
            boxes: 5,
            obstacles: 3,
            top_speed_mps: 0.35,
            cpu_consumption_w: 10.0,
            battery_capacity_ah: 1.8,
            rates: vec![
                (Topic::Odom, 20.0),
                (Topic::BatteryState, 2.0),
                (Topic::Wifi, 5.0),
                (Topic::Diagnostics, 1.0),
                (Topic::TruePose, 1.0),
                (Topic::TruePower, 1.0),
            ],
            people: 0,
            task: Plan::default(),
            script: Vec::new(),
        }
    }
}

impl Settings {
    /// The rate at which the simulation advances [Hz].
    pub(super) fn tick_hz(&self) -> f64 {
        self.rates.iter().map(|(_, rate_hz)| *rate_hz).fold(LEAST_TICK_HZ, f64::max)
    }

    /// Returns the seed of a person, numbered from 1.
    pub fn seed_of_person(&self, number: u32) -> u64 {
        self.seed.wrapping_add(u64::from(number - 1))
    }

    /// Returns the task of a person, numbered from 1.
    pub fn task_of_person(&self, number: u32) -> Task {
        let seed = self.seed_of_person(number);
        let robots = u32::try_from(self.robots.len()).unwrap_or(u32::MAX);
        Task::new(Plan { robots, ..self.task.clone() }, Skill::of_seed(seed), seed)
    }
}
