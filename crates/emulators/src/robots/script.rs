//! The script: which robot changes, how and when.

use std::ops::Range;

use schemars::JsonSchema;
use serde::Deserialize;

use super::time::SimTime;
use super::topic::Topic;

/// One entry of the script: a robot behaves differently for a while.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// The robot: `robot4`.
    pub robot: String,
    /// The topic that changes; by default all. Ignored for changes to the robot as a whole: its clock, its battery and
    /// its consumption.
    pub topic: Option<Topic>,
    /// When the change begins, after the start [s of simulated time]. Default: 0.
    #[serde(default)]
    pub from_secs: f64,
    /// When the change ends, after the start [s of simulated time]; by default never.
    pub to_secs: Option<f64>,
    /// The change.
    pub what: Change,
}

/// A change to a robot.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(rename_all = "snake_case")]
pub enum Change {
    /// The topic falls silent; without a topic the whole robot is off and stops.
    Dead,
    /// The values stay unchanged while the stamps continue.
    Stuck,
    /// The messages are lost in transit while the robot continues.
    Outage,
    /// Every message arrives twice.
    Duplicate,
    /// Every other message arrives after the one that follows it.
    OutOfOrder,
    /// The rate is divided by this factor.
    SlowFactor(f64),
    /// The robot's clock runs this much too fast [ppm]; it is corrected at the end.
    ClockDriftPpm(f64),
    /// The robot's clock is ahead by this much [s]; it is corrected at the end.
    ClockJumpSecs(f64),
    /// The battery's voltage is lower by this much [V].
    BatterySagV(f64),
    /// The computer's consumption is multiplied by this factor.
    CpuFactor(f64),
}

impl Scene {
    fn secs(&self) -> Range<f64> {
        self.from_secs..self.to_secs.unwrap_or(f64::INFINITY)
    }

    fn concerns(&self, topic: Topic) -> bool {
        !topic.is_truth() && self.topic.is_none_or(|only| only == topic)
    }
}

/// The scenes of one robot.
#[derive(Clone, Debug)]
pub struct Script {
    scenes: Vec<Scene>,
}

impl Script {
    /// Selects the scenes of a robot.
    pub fn of(robot: &str, scenes: &[Scene]) -> Script {
        Script { scenes: scenes.iter().filter(|scene| scene.robot == robot).cloned().collect() }
    }

    /// Whether an on-off change applies to a topic now.
    pub fn has(&self, change: Change, topic: Topic, now: SimTime) -> bool {
        self.playing(now).any(|scene| scene.what == change && scene.concerns(topic))
    }

    /// Whether the whole robot is off.
    pub fn is_off(&self, now: SimTime) -> bool {
        self.playing(now).any(|scene| scene.what == Change::Dead && scene.topic.is_none())
    }

    /// Returns the divisor of a topic's rate.
    pub fn slow_factor(&self, topic: Topic, now: SimTime) -> f64 {
        let slows = |scene: &Scene| match scene.what {
            Change::SlowFactor(factor) if scene.concerns(topic) => Some(factor),
            _ => None,
        };
        self.playing(now).filter_map(slows).product()
    }

    /// Returns the factor of the computer's power.
    pub fn cpu_factor(&self, now: SimTime) -> f64 {
        let loads = |scene: &Scene| match scene.what {
            Change::CpuFactor(factor) => Some(factor),
            _ => None,
        };
        self.playing(now).filter_map(loads).product()
    }

    /// Returns the drop of the battery's voltage [V].
    pub fn sag_v(&self, now: SimTime) -> f64 {
        let sags = |scene: &Scene| match scene.what {
            Change::BatterySagV(sag_v) => Some(sag_v),
            _ => None,
        };
        self.playing(now).filter_map(sags).sum()
    }

    /// Returns how far the robot's clock is ahead [s].
    pub fn clock_ahead_secs(&self, now: SimTime) -> f64 {
        let shifts = |scene: &Scene| match scene.what {
            Change::ClockDriftPpm(ppm) => Some(ppm * 1e-6 * (now.secs() - scene.from_secs)),
            Change::ClockJumpSecs(secs) => Some(secs),
            _ => None,
        };
        self.playing(now).filter_map(shifts).sum()
    }

    fn playing(&self, now: SimTime) -> impl Iterator<Item = &Scene> {
        let now_secs = now.secs();
        self.scenes.iter().filter(move |scene| scene.secs().contains(&now_secs))
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn script(what: Change) -> Script {
        let scene = Scene {
            robot: "robot1".into(),
            topic: Some(Topic::Wifi),
            from_secs: 10.0,
            to_secs: Some(20.0),
            what,
        };
        Script::of("robot1", &[scene])
    }

    fn after(secs: f64) -> SimTime {
        SimTime::START + Duration::from_secs_f64(secs)
    }

    #[test]
    fn a_scene_lasts_from_its_begin_to_before_its_end() {
        let stuck = script(Change::Stuck);
        let at = |secs| stuck.has(Change::Stuck, Topic::Wifi, after(secs));
        assert_eq!([9.9, 10.0, 19.9, 20.0].map(at), [false, true, true, false]);
        assert!(!stuck.has(Change::Stuck, Topic::BatteryState, after(15.0)));
    }

    #[test]
    fn a_drifting_clock_is_ahead_in_proportion_and_set_right_at_the_end() {
        let drift = script(Change::ClockDriftPpm(200.0));
        assert!((drift.clock_ahead_secs(after(15.0)) - 0.001).abs() < 1e-12);
        assert!(drift.clock_ahead_secs(after(20.0)).abs() < 1e-12);
    }

    #[test]
    fn no_fault_touches_the_truth() {
        let scene = Scene { topic: None, ..script(Change::Outage).scenes.remove(0) };
        let script = Script::of("robot1", &[scene]);
        assert!(script.has(Change::Outage, Topic::Odom, after(15.0)));
        assert!(!script.has(Change::Outage, Topic::TruePose, after(15.0)));
    }
}
