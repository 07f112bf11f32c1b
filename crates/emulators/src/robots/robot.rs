//! A robot: a body that drives, its devices, and their reports.

use std::time::Duration;

use crate::noise::Noise;

use super::arena::{Arena, Point};
use super::battery::Pack;
use super::camera::picture;
use super::computer::Computer;
use super::drive::Twist;
use super::odometer::Odometer;
use super::radio::{Link, Reception};
use super::report::Report;
use super::script::{Change, Script};
use super::settings::Settings;
use super::surroundings::{Disc, Surroundings};
use super::telegram::{Body, Gauge, Health, Telegram};
use super::time::SimTime;
use super::topic::Topic;
use super::wanderer::Wanderer;

/// The radius of a robot [m].
pub const RADIUS_M: f64 = 0.18;
/// The power of the sensors [W].
const SENSORS_W: f64 = 2.0;
/// The power of the radio [W].
const RADIO_W: f64 = 0.75;
/// The power for driving, per m/s [W].
const DRIVING_W: f64 = 4.0;
/// The power for turning, per rad/s [W].
const TURNING_W: f64 = 0.8;
/// The standard deviations of the battery's sensors [V], [A].
const BATTERY_SIGMA: (f64, f64) = (0.005, 0.01);
/// The standard deviation of the thermometer [K].
const THERMOMETER_SIGMA_K: f64 = 0.1;

/// A simulated robot.
#[derive(Clone, Debug)]
pub struct Robot {
    wanderer: Wanderer,
    odometer: Odometer,
    link: Link,
    heard: Option<Reception>,
    computer: Computer,
    pack: Pack,
    script: Script,
    reports: Vec<Report>,
    noise: Noise,
}

impl Robot {
    /// Creates a robot at this place with a charged battery, which reports nothing yet.
    pub fn new(body: Disc, settings: &Settings, script: Script, mut noise: Noise) -> Robot {
        let wanderer = Wanderer::new(body, settings.top_speed_mps, noise.fork());
        Robot {
            odometer: Odometer::new(wanderer.pose(), noise.fork()),
            link: Link::new(body.at, noise.fork()),
            heard: None,
            computer: Computer::new(settings.cpu_consumption_w, noise.fork()),
            pack: Pack::new(settings.battery_capacity_ah, noise.uniform(0.95..1.0)),
            script,
            reports: Vec::new(),
            wanderer,
            noise,
        }
    }

    /// Begins to report a topic on a stream, at a random time in its first period.
    pub fn report(&mut self, topic: Topic, stream: usize, rate_hz: f64) {
        let phase_secs = self.noise.uniform(0.0..1.0 / rate_hz);
        let due = SimTime::START + Duration::from_secs_f64(phase_secs);
        self.reports.push(Report::new(topic, stream, rate_hz, due));
    }

    /// The area that the robot covers.
    pub fn body(&self) -> Disc {
        self.wanderer.body()
    }

    /// The battery of the robot.
    pub fn pack(&self) -> &Pack {
        &self.pack
    }

    /// Sends the robot to a place on a person's behalf; it drives there unless it is off or out of reach.
    pub fn command(&mut self, now: SimTime, goal: Point) {
        let hears = !self.pack.is_cut_off()
            && !self.script.is_off(now)
            && !self.script.has(Change::Outage, Topic::GoalPose, now);
        if hears {
            self.wanderer.drive_to(goal);
        }
    }

    /// Drives, computes and discharges for a short time.
    pub fn advance(&mut self, now: SimTime, secs: f64, around: &Surroundings<'_>) {
        let is_on = !self.pack.is_cut_off() && !self.script.is_off(now);
        if is_on {
            self.wanderer.advance(secs, around);
        } else {
            self.wanderer.halt();
        }
        self.odometer.advance(self.wanderer.twist(), secs);
        let cpu_factor = if is_on { self.script.cpu_factor(now) } else { 0.0 };
        self.computer.advance(cpu_factor, secs);
        let power_w = if is_on { self.power_w() } else { 0.0 };
        self.pack.draw(power_w, self.script.sag_v(now), secs);
    }

    fn power_w(&self) -> f64 {
        let Twist { speed_mps, turn_radps } = self.wanderer.twist();
        let motors_w = DRIVING_W * speed_mps.abs() + TURNING_W * turn_radps.abs();
        self.computer.power_w() + SENSORS_W + RADIO_W + motors_w
    }

    /// Appends the telegrams that are due to `out`.
    pub fn speak(&mut self, now: SimTime, arena: &Arena, out: &mut Vec<Telegram>) {
        for index in 0..self.reports.len() {
            let topic = self.reports[index].topic();
            if self.reports[index].falls_due(now, self.script.slow_factor(topic, now)) {
                let body = self.measured(topic, arena);
                if topic.is_truth() || !self.pack.is_cut_off() {
                    self.reports[index].report(body, now, &self.script, out);
                }
            }
        }
    }

    /// Returns the present report of a topic.
    fn measured(&mut self, topic: Topic, arena: &Arena) -> Body {
        match topic {
            Topic::Odom => Body::Motion(self.odometer.pose(), self.odometer.twist()),
            Topic::GoalPose => Body::Goal(self.wanderer.pose()),
            Topic::BatteryState => Body::Battery(self.measured_gauge()),
            Topic::Wifi => Body::Reception(self.listen(arena)),
            Topic::Diagnostics => Body::Health(self.health()),
            Topic::Temperature => Body::Temperature(
                self.computer.temperature_c() + THERMOMETER_SIGMA_K * self.noise.normal(),
            ),
            Topic::Camera => Body::Picture(picture(arena, self.wanderer.pose())),
            Topic::TruePose => Body::Motion(self.wanderer.pose(), self.wanderer.twist()),
            Topic::TruePower => Body::Battery(Gauge::of(&self.pack)),
        }
    }

    fn measured_gauge(&mut self) -> Gauge {
        let mut gauge = Gauge::of(&self.pack);
        gauge.reading.voltage_v += BATTERY_SIGMA.0 * self.noise.normal();
        gauge.reading.current_a += BATTERY_SIGMA.1 * self.noise.normal();
        gauge
    }

    fn listen(&mut self, arena: &Arena) -> Reception {
        let heard = self.link.heard(self.wanderer.pose().at, arena);
        self.heard = Some(heard);
        heard
    }

    fn health(&self) -> Health {
        Health {
            battery: Gauge::of(&self.pack),
            computer_c: self.computer.temperature_c(),
            computer_w: self.computer.power_w(),
            heard: self.heard,
        }
    }
}
