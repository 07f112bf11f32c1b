//! The team: all robots and obstacles in their arena, advanced together.
//!
//! In each tick every body takes its own turn, so that robots are no more synchronised than real ones.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::noise::Noise;

use super::arena::{Arena, Point, Rect};
use super::commands::{Command, Commands};
use super::drive::Pose;
use super::published::Published;
use super::robot::{RADIUS_M, Robot};
use super::script::Script;
use super::settings::Settings;
use super::surroundings::{Disc, Surroundings};
use super::telegram::{Body, Telegram};
use super::time::SimTime;
use super::topic::Topic;
use super::wanderer::Wanderer;

/// The radius of an obstacle [m].
const OBSTACLE_RADIUS_M: f64 = 0.25;
/// The top speed of an obstacle [m/s].
const OBSTACLE_MPS: f64 = 0.2;
/// The distance between bodies at the start [m].
const START_GAP_M: f64 = 0.3;
/// The side of the square in the upper right in which one robot starts [m]; for more robots its area grows with their
/// number.
const START_SIDE_M: f64 = 1.1;

/// The distance between a commanded goal and a wall [m].
const GOAL_MARGIN_M: f64 = 0.1;
/// Separates the random goals of commands from other random numbers of the same seed.
const COMMANDS_SALT: u64 = 0x0063_6f6d_6d61_6e64;

/// A simulated team. The same settings give the same telegrams.
#[derive(Debug)]
pub struct Team {
    arena: Arena,
    robots: Vec<Robot>,
    obstacles: Vec<Wanderer>,
    bodies: Vec<Disc>,
    published: Vec<Published>,
    tick_nanos: i64,
    turns: i64,
    sent: u64,
    on_their_way: BTreeMap<(SimTime, u64), Telegram>,
    commands: Commands,
    /// For each robot, the index of its commands in the published topics.
    commanded: Vec<usize>,
}

impl Team {
    /// Creates a team at the start. It must have robots, and room for all bodies in the arena.
    pub fn new(settings: &Settings) -> Team {
        let mut noise = Noise::seeded(settings.seed);
        let mut team = Team {
            arena: Arena::new(settings.arena_side_m, settings.boxes, &mut noise.fork()),
            robots: Vec::new(),
            obstacles: Vec::new(),
            bodies: Vec::new(),
            published: Vec::new(),
            tick_nanos: (1e9 / settings.tick_hz()).round() as i64,
            turns: 0,
            sent: 0,
            on_their_way: BTreeMap::new(),
            commands: Commands::of(settings, &mut Noise::seeded(settings.seed ^ COMMANDS_SALT)),
            commanded: Vec::new(),
        };
        for name in &settings.robots {
            team.add_robot(name, settings, noise.fork());
        }
        if settings.people > 0 {
            team.listen_to_commands(settings);
        }
        for _ in 0..settings.obstacles {
            team.add_obstacle(noise.fork());
        }
        team
    }

    /// The published topics, to which the index in a telegram refers.
    pub fn published(&self) -> &[Published] {
        &self.published
    }

    /// The arena.
    pub fn arena(&self) -> &Arena {
        &self.arena
    }

    /// The robots, in the order of their names.
    pub fn robots(&self) -> &[Robot] {
        &self.robots
    }

    /// Returns when something happens next.
    pub fn next(&self) -> SimTime {
        let arrives = self.on_their_way.keys().next().map(|(at, _)| *at);
        arrives.map_or(self.next_turn(), |at| at.min(self.next_turn()))
    }

    /// Advances to `until` and appends the telegrams sent by then to `out`, in order.
    pub fn advance(&mut self, until: SimTime, out: &mut Vec<Telegram>) {
        while self.next_turn() <= until {
            self.take_turn();
        }
        while let Some(first) = self.on_their_way.first_entry()
            && first.key().0 <= until
        {
            out.push(first.remove());
        }
    }

    fn add_robot(&mut self, name: &str, settings: &Settings, mut noise: Noise) {
        let side_m = START_SIDE_M * (settings.robots.len() as f64).sqrt();
        let body = self.any_place(side_m, RADIUS_M, &mut noise);
        let script = Script::of(name, &settings.script);
        let mut robot = Robot::new(body, settings, script, noise);
        for &(topic, rate_hz) in &settings.rates {
            robot.report(topic, self.published.len(), rate_hz);
            self.published.push(Published { robot: name.to_owned(), topic, rate_hz });
        }
        self.bodies.push(body);
        self.robots.push(robot);
    }

    fn listen_to_commands(&mut self, settings: &Settings) {
        for robot in settings.robots.iter().cloned() {
            self.commanded.push(self.published.len());
            self.published.push(Published { robot, topic: Topic::GoalPose, rate_hz: 0.0 });
        }
    }

    fn add_obstacle(&mut self, mut noise: Noise) {
        let side_m = self.arena.floor().high.x_m;
        let body = self.any_place(side_m, OBSTACLE_RADIUS_M, &mut noise);
        self.bodies.push(body);
        self.obstacles.push(Wanderer::new(body, OBSTACLE_MPS, noise));
    }

    /// Returns a free place in a square in the upper right, which grows until there is one.
    fn any_place(&self, side_m: f64, radius_m: f64, noise: &mut Noise) -> Disc {
        let corner = self.arena.floor().high;
        let mut side_m = side_m;
        loop {
            side_m = (1.01 * side_m).min(corner.x_m);
            let low = Point { x_m: corner.x_m - side_m, y_m: corner.y_m - side_m };
            let body = Disc { at: Rect { low, high: corner }.any_point(noise), radius_m };
            let is_alone = self.bodies.iter().all(|other| body.gap_m(*other) > START_GAP_M);
            if is_alone && self.arena.is_free(body.at, radius_m) {
                return body;
            }
        }
    }

    fn next_turn(&self) -> SimTime {
        let nanos = (self.turns + 1) * self.tick_nanos / self.bodies.len() as i64;
        SimTime::START + Duration::from_nanos(nanos.unsigned_abs())
    }

    /// Advances the body whose turn it is by a tick.
    fn take_turn(&mut self) {
        let now = self.next_turn();
        let own = self.turns as usize % self.bodies.len();
        self.turns += 1;
        let secs = self.tick_nanos as f64 / 1e9;
        self.take_commands(now);
        let around = Surroundings { arena: &self.arena, bodies: &self.bodies, own };
        if let Some(robot) = self.robots.get_mut(own) {
            robot.advance(now, secs, &around);
            self.bodies[own] = robot.body();
            self.hear(own, now);
        } else {
            let obstacle = &mut self.obstacles[own - self.robots.len()];
            obstacle.advance(secs, &around);
            self.bodies[own] = obstacle.body();
        }
    }

    /// Passes the commands that are due to the robots, and publishes them.
    fn take_commands(&mut self, now: SimTime) {
        let secs = now.secs();
        let room_m = RADIUS_M + GOAL_MARGIN_M;
        while let Some(command) = self.commands.next_until(secs, &self.arena, room_m) {
            let Command { at_secs, robot, goal } = command;
            let from = self.robots[robot].body().at;
            self.robots[robot].command(now, goal);
            let body = Body::Goal(Pose { at: goal, heading_rad: from.bearing_rad(goal) });
            let stamp = SimTime::START + Duration::from_secs_f64(at_secs);
            self.send(Telegram { stream: self.commanded[robot], at: now, stamp, body });
        }
    }

    fn hear(&mut self, robot: usize, now: SimTime) {
        let mut spoken = Vec::new();
        self.robots[robot].speak(now, &self.arena, &mut spoken);
        for telegram in spoken {
            self.send(telegram);
        }
    }

    fn send(&mut self, telegram: Telegram) {
        self.on_their_way.insert((telegram.at, self.sent), telegram);
        self.sent += 1;
    }
}
