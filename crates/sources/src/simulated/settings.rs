//! The settings of the simulation.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::registry::SettingsError;
use teampulse_emulators::body;
use teampulse_emulators::robots::{self, Change, RADIUS_M, Scene, Topic};
use teampulse_emulators::task::Plan;

use crate::emulated::EmulatedWearable;

/// A team of simulated robots that drive through an arena, discharge, and have better or worse reception of a router.
///
/// Every robot publishes its odometry, battery, Wi-Fi and diagnostics, and on request its temperature and camera, below
/// its own name: `/robot1/odom`. The ground truth is published on `/sim/truth/robot1`. The same seed gives the same
/// team, byte for byte.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SimulatedTeam {
    /// The number of robots. Default: 5.
    pub robots: u32,
    /// The prefix of the robots' names; they are numbered from 1. Default: `robot`.
    pub prefix: String,
    /// The seed of all random numbers. Default: 1.
    pub seed: u64,
    /// How much faster than real time [1], from 0.01 to 1000. Default: 1.
    pub speed: f64,
    /// The length of the simulation in steps of one second [s of simulated time]; by default endless.
    pub steps: Option<u32>,
    /// The side of the square arena [m]. Default: 10.
    pub arena_side_m: f64,
    /// The number of boxes in the arena. Default: 5.
    pub boxes: u32,
    /// The number of moving obstacles in the arena. Default: 3.
    pub obstacles: u32,
    /// The top speed of a robot [m/s]. Default: 0.35.
    pub top_speed_mps: f64,
    /// The power of a robot's computer [W], like Webots' `cpuConsumption`. Default: 10.
    pub cpu_consumption_w: f64,
    /// The capacity of a robot's battery, three lithium-ion cells in series [Ah]. Default: 1.8.
    pub battery_capacity_ah: f64,
    /// The rate of `odom` [Hz]; 0 for none. Default: 20.
    pub odometry_hz: f64,
    /// The rate of `battery_state` [Hz]; 0 for none. Default: 2.
    pub battery_hz: f64,
    /// The rate of `wifi` [Hz]; 0 for none. Default: 5.
    pub wifi_hz: f64,
    /// The rate of `diagnostics` [Hz]; 0 for none. Default: 1.
    pub diagnostics_hz: f64,
    /// The rate of `temperature` [Hz]; 0 for none. Default: 0.
    pub temperature_hz: f64,
    /// The rate of `camera/image_raw`, pictures of 64 × 48 pixels [Hz]; 0 for none. Default: 0.
    pub camera_hz: f64,
    /// The rate of `/sim/truth` [Hz]; 0 for none. Default: 1.
    pub truth_hz: f64,
    /// The number of people who work with the robots: `p001` and so on. Each wears sensors and performs a task. Their
    /// signals are published below `/humans/persons/<id>/simulated`, as they do not belong to a real person, and the
    /// ground truth below `/humans/persons/<id>/truth`. Their commands to a robot are published on
    /// `/<robot>/goal_pose`, as for Nav2; the robot drives there unless it is off or out of reach. Default: 0.
    pub people: u32,
    /// The task that the people perform.
    pub task: Plan,
    /// The sensors that the people wear: their rates and artefacts.
    pub body: body::Settings,
    /// The script of changes to robots, each with its time: faults, and the load of computers.
    pub script: Vec<Scene>,
    /// Wearables on their own transports, which `teampulse emulate` and `simulate --wearables` serve; they publish
    /// nothing on ROS.
    pub wearables: Vec<EmulatedWearable>,
}

impl Default for SimulatedTeam {
    fn default() -> SimulatedTeam {
        SimulatedTeam {
            robots: 5,
            prefix: "robot".into(),
            seed: 1,
            speed: 1.0,
            steps: None,
            arena_side_m: 10.0,
            boxes: 5,
            obstacles: 3,
            top_speed_mps: 0.35,
            cpu_consumption_w: 10.0,
            battery_capacity_ah: 1.8,
            odometry_hz: 20.0,
            battery_hz: 2.0,
            wifi_hz: 5.0,
            diagnostics_hz: 1.0,
            temperature_hz: 0.0,
            camera_hz: 0.0,
            truth_hz: 1.0,
            people: 0,
            task: Plan::default(),
            body: body::Settings::default(),
            script: Vec::new(),
            wearables: Vec::new(),
        }
    }
}

/// The highest rate of a topic [Hz].
const MOST_HZ: f64 = 1000.0;
/// The floor area that a robot needs, as a multiple of the area it covers.
const ROOM: f64 = 6.0;

impl SimulatedTeam {
    /// The names of the robots.
    pub fn names(&self) -> Vec<String> {
        (1..=self.robots).map(|k| format!("{}{k}", self.prefix)).collect()
    }

    /// The settings of the model, without those about its speed and wearables.
    pub(crate) fn model(&self) -> robots::Settings {
        let rates = self.rates().into_iter().filter(|(_, rate_hz)| *rate_hz > 0.0);
        robots::Settings {
            robots: self.names(),
            seed: self.seed,
            arena_side_m: self.arena_side_m,
            boxes: self.boxes,
            obstacles: self.obstacles,
            top_speed_mps: self.top_speed_mps,
            cpu_consumption_w: self.cpu_consumption_w,
            battery_capacity_ah: self.battery_capacity_ah,
            rates: rates.collect(),
            people: self.people,
            task: self.task.clone(),
            script: self.script.clone(),
        }
    }

    /// Returns an error for settings that cannot be simulated.
    pub fn check(&self) -> Result<(), SettingsError> {
        for (key, rate_hz) in [
            ("odometry_hz", self.odometry_hz),
            ("battery_hz", self.battery_hz),
            ("wifi_hz", self.wifi_hz),
            ("diagnostics_hz", self.diagnostics_hz),
            ("temperature_hz", self.temperature_hz),
            ("camera_hz", self.camera_hz),
            ("truth_hz", self.truth_hz),
        ] {
            within(key, rate_hz, 0.0, MOST_HZ)?;
        }
        within("speed", self.speed, 0.01, 1000.0)?;
        within("robots", f64::from(self.robots), 1.0, 1000.0)?;
        within("people", f64::from(self.people), 0.0, 100.0)?;
        within("obstacles", f64::from(self.obstacles), 0.0, 1000.0)?;
        within("boxes", f64::from(self.boxes), 0.0, 1000.0)?;
        self.body.rates.check().map_err(|error| {
            SettingsError::new(error.to_string()).with_hint("0 for none").at("body.rates")
        })?;
        within("arena_side_m", self.arena_side_m, 3.0, 1000.0)?;
        within("top_speed_mps", self.top_speed_mps, 0.01, 5.0)?;
        within("cpu_consumption_w", self.cpu_consumption_w, 0.0, 200.0)?;
        within("battery_capacity_ah", self.battery_capacity_ah, 0.1, 1000.0)?;
        self.check_room()?;
        self.script.iter().enumerate().try_for_each(|(place, scene)| {
            self.check_scene(scene).map_err(|error| {
                let path = format!("script.{place}.{}", error.path);
                error.at(path)
            })
        })
    }

    fn check_room(&self) -> Result<(), SettingsError> {
        let bodies = f64::from(self.robots + self.obstacles);
        let needed_m2 = bodies * (ROOM * RADIUS_M).powi(2);
        if needed_m2 <= self.arena_side_m.powi(2) {
            return Ok(());
        }
        let least_m = needed_m2.sqrt().ceil();
        let message = format!("{bodies} bodies don't fit in an arena of {} m", self.arena_side_m);
        let hint = format!("set arena_side_m to {least_m} or more");
        Err(SettingsError::new(message).with_hint(hint).at("robots"))
    }

    fn check_scene(&self, scene: &Scene) -> Result<(), SettingsError> {
        if !self.names().contains(&scene.robot) {
            let message = format!("the script names a robot {:?} that does not exist", scene.robot);
            let hint = format!("the robots are {0}1 to {0}{1}", self.prefix, self.robots);
            return Err(SettingsError::new(message).with_hint(hint).at("robot"));
        }
        let checked = match scene.what {
            Change::SlowFactor(factor) => within("slow_factor", factor, 1.0, 1e6),
            Change::CpuFactor(factor) => within("cpu_factor", factor, 0.0, 1000.0),
            Change::ClockDriftPpm(ppm) => within("clock_drift_ppm", ppm, -1e5, 1e5),
            Change::ClockJumpSecs(secs) => within("clock_jump_secs", secs, -1e9, 1e9),
            Change::BatterySagV(sag_v) => within("battery_sag_v", sag_v, 0.0, 100.0),
            _ => Ok(()),
        };
        checked.map_err(|error| {
            let path = format!("what.{}", error.path);
            error.at(path)
        })
    }

    fn rates(&self) -> [(Topic, f64); 8] {
        [
            (Topic::Odom, self.odometry_hz),
            (Topic::BatteryState, self.battery_hz),
            (Topic::Wifi, self.wifi_hz),
            (Topic::Diagnostics, self.diagnostics_hz),
            (Topic::Temperature, self.temperature_hz),
            (Topic::Camera, self.camera_hz),
            (Topic::TruePose, self.truth_hz),
            (Topic::TruePower, self.truth_hz),
        ]
    }
}

fn within(what: &str, value: f64, least: f64, most: f64) -> Result<(), SettingsError> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    let error = SettingsError::new(format!("{what} is {value}; expected {least} to {most}"));
    Err(error.with_hint(format!("give a number from {least} to {most}")).at(what))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The simulation's part of a study.
    fn simulate(study: &str) -> SimulatedTeam {
        #[derive(Deserialize)]
        struct Study {
            simulate: SimulatedTeam,
        }
        toml::from_str::<Study>(study).unwrap().simulate
    }

    #[test]
    fn the_studies_that_are_shipped_can_be_simulated() {
        let five = simulate(include_str!("../../../../studies/five_robots.toml"));
        let demo = simulate(include_str!("../../../../studies/demo.toml"));
        let hundred = simulate(include_str!("../../../../studies/hundred_robots.toml"));
        let operator = simulate(include_str!("../../../../studies/one_operator.toml"));
        [&five, &demo, &hundred, &operator].into_iter().try_for_each(SimulatedTeam::check).unwrap();
        assert_eq!([five.robots, hundred.robots], [5, 100]);
        assert_eq!([five.people, operator.people], [0, 1]);
        assert_eq!(five.steps, Some(600));
    }

    #[test]
    fn what_can_not_be_simulated_is_reported() {
        let wrong = |study: &str| {
            let settings: SimulatedTeam = toml::from_str(study).unwrap();
            settings.check().unwrap_err().message
        };
        let fast = "body = { rates = { ecg_hz = 5000 } }";
        assert!(wrong(fast).starts_with("the rate of Ecg is 5000 Hz"), "{}", wrong(fast));
        assert_eq!(wrong("speed = 0"), "speed is 0; expected 0.01 to 1000");
        assert_eq!(wrong("robots = 100"), "103 bodies don't fit in an arena of 10 m");
        assert_eq!(
            wrong(r#"script = [{ robot = "robot9", what = "dead" }]"#),
            r#"the script names a robot "robot9" that does not exist"#
        );
    }

    #[test]
    fn a_number_that_can_not_be_simulated_is_reported_by_its_key() {
        for (study, path) in [
            ("robots = 0", "robots"),
            ("people = 100000", "people"),
            ("robots = 3\nobstacles = 4294967295", "obstacles"),
            ("wifi_hz = -1", "wifi_hz"),
            ("speed = nan", "speed"),
            (r#"script = [{ robot = "robot9", what = "dead" }]"#, "script.0.robot"),
            (
                r#"script = [{ robot = "robot1", what = { slow_factor = 0 } }]"#,
                "script.0.what.slow_factor",
            ),
        ] {
            let settings: SimulatedTeam = toml::from_str(study).unwrap();
            let error = settings.check().unwrap_err();
            assert_eq!(error.path, path, "{error}");
            assert!(!error.hint.is_empty(), "{error}");
        }
    }

    #[test]
    fn an_unknown_change_is_reported_with_those_that_there_are() {
        let study = r#"script = [{ robot = "robot1", what = "deed" }]"#;
        let error = toml::from_str::<SimulatedTeam>(study).unwrap_err();
        assert!(error.message().contains("`dead`"), "{error}");
    }
}
