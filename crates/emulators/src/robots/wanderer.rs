//! A wanderer: a body that drives to one random place after another and avoids obstacles.

use std::f64::consts::TAU;

use crate::noise::Noise;

use super::arena::{Arena, Point};
use super::drive::{MOST_MPS2, Pose, Twist, wrapped_rad};
use super::goals::Goals;
use super::surroundings::{Disc, Surroundings};

/// The distance over which a wanderer looks for a free path [m].
const REACH_M: f64 = 1.5;
/// The time between two searches for a free path [s].
const LOOK_SECS: f64 = 0.2;
/// The number of directions that are compared.
const DIRECTIONS: u32 = 16;
/// The distance that a wanderer keeps from obstacles [m].
const MARGIN_M: f64 = 0.08;
/// The distance from the goal at which a wanderer has arrived [m].
const THERE_M: f64 = 0.3;
/// The heading error above which a wanderer turns on the spot [rad].
const SPOT_RAD: f64 = 0.9;
/// The fastest turn [rad/s].
const TOP_TURN_RADPS: f64 = 1.8;

/// A body with a goal.
#[derive(Clone, Debug)]
pub struct Wanderer {
    pose: Pose,
    twist: Twist,
    radius_m: f64,
    top_speed_mps: f64,
    goal: Point,
    patience_secs: f64,
    wanted_rad: f64,
    until_look_secs: f64,
    goals: Goals,
}

impl Wanderer {
    /// Creates a body at rest with a random heading.
    pub fn new(body: Disc, top_speed_mps: f64, mut noise: Noise) -> Wanderer {
        let heading_rad = wrapped_rad(noise.uniform(0.0..TAU));
        Wanderer {
            pose: Pose { at: body.at, heading_rad },
            twist: Twist::default(),
            radius_m: body.radius_m,
            top_speed_mps,
            goal: body.at,
            patience_secs: 0.0,
            wanted_rad: heading_rad,
            until_look_secs: 0.0,
            goals: Goals::new(&mut noise),
        }
    }

    /// The pose of the body.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// The motion of the body.
    pub fn twist(&self) -> Twist {
        self.twist
    }

    /// The area that the body covers.
    pub fn body(&self) -> Disc {
        Disc { at: self.pose.at, radius_m: self.radius_m }
    }

    /// Drives for a short time.
    pub fn advance(&mut self, secs: f64, around: &Surroundings<'_>) {
        self.patience_secs -= secs;
        self.until_look_secs -= secs;
        if self.patience_secs <= 0.0 || self.pose.at.distance_m(self.goal) < THERE_M {
            self.choose_goal(around.arena);
        }
        if self.until_look_secs <= 0.0 {
            self.until_look_secs += LOOK_SECS;
            self.wanted_rad = self.best_way_rad(around);
        }
        self.twist = self.twist.toward(self.wanted_twist(around), secs);
        self.roll(secs, around);
    }

    /// Drives to a commanded place, with more patience than to one chosen by itself.
    pub fn drive_to(&mut self, goal: Point) {
        self.goal = goal;
        self.patience_secs = 2.0 * self.usual_patience_secs();
        self.until_look_secs = 0.0;
    }

    /// Stops, as when the robot is switched off.
    pub fn halt(&mut self) {
        self.twist = Twist::default();
    }

    /// Chooses the next free place as the goal.
    fn choose_goal(&mut self, arena: &Arena) {
        self.goal = self.goals.next_free(arena, self.radius_m + MARGIN_M);
        self.patience_secs = self.usual_patience_secs();
    }

    /// Returns the time after which a goal is given up [s]: a multiple of the time for the straight path.
    fn usual_patience_secs(&self) -> f64 {
        let straight_secs = self.pose.at.distance_m(self.goal) / self.top_speed_mps;
        5.0 + 2.0 * straight_secs
    }

    /// Returns the direction with the least cost: directions far from the goal, far from the heading or blocked cost
    /// most.
    fn best_way_rad(&self, around: &Surroundings<'_>) -> f64 {
        let goal_rad = self.pose.at.bearing_rad(self.goal);
        let reach_m = REACH_M.min(self.pose.at.distance_m(self.goal));
        let cost = |way_rad: f64| {
            let free_m = around.clearance_m(self.body(), way_rad, reach_m) - MARGIN_M;
            wrapped_rad(way_rad - goal_rad).abs()
                + 0.4 * wrapped_rad(way_rad - self.pose.heading_rad).abs()
                + 3.0 * (1.0 - free_m.max(0.0) / reach_m)
                + if free_m < self.radius_m { 10.0 } else { 0.0 }
        };
        let ways = (0..DIRECTIONS).map(|k| goal_rad + TAU * f64::from(k) / f64::from(DIRECTIONS));
        let costs = ways.map(|way_rad| (cost(way_rad), way_rad));
        let best = costs.min_by(|one, other| one.0.total_cmp(&other.0));
        best.map_or(goal_rad, |(_, way_rad)| way_rad)
    }

    fn wanted_twist(&self, around: &Surroundings<'_>) -> Twist {
        let off_rad = wrapped_rad(self.wanted_rad - self.pose.heading_rad);
        let free_m = around.clearance_m(self.body(), self.pose.heading_rad, REACH_M) - MARGIN_M;
        let stoppable_mps = (MOST_MPS2 * free_m.max(0.0)).sqrt();
        let eager_mps = self.top_speed_mps * (1.0 - off_rad.abs() / SPOT_RAD).max(0.0);
        Twist {
            speed_mps: eager_mps.min(stoppable_mps),
            turn_radps: (2.5 * off_rad).clamp(-TOP_TURN_RADPS, TOP_TURN_RADPS),
        }
    }

    /// Moves if that is possible; otherwise only turns, and searches again at once.
    fn roll(&mut self, secs: f64, around: &Surroundings<'_>) {
        let next = self.pose.moved(self.twist, secs);
        if around.admits(self.body(), Disc { at: next.at, radius_m: self.radius_m }) {
            self.pose = next;
        } else {
            self.pose.heading_rad = next.heading_rad;
            self.twist.speed_mps = 0.0;
            self.until_look_secs = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wanderer_sees_all_quarters_of_the_arena_and_never_leaves_it() {
        for seed in 0..10 {
            let mut noise = Noise::seeded(seed);
            let arena = Arena::new(10.0, 5, &mut noise);
            let body = Disc { at: Goals::new(&mut noise).next_free(&arena, 0.2), radius_m: 0.2 };
            let mut wanderer = Wanderer::new(body, 0.35, noise);
            let mut seen = [0; 4];
            for _ in 0..600 * 20 {
                wanderer.advance(0.05, &Surroundings { arena: &arena, bodies: &[body], own: 0 });
                let at = wanderer.pose().at;
                assert!(arena.is_free(at, 0.2), "seed {seed}: {at:?}");
                seen[usize::from(at.x_m > 5.0) + 2 * usize::from(at.y_m > 5.0)] += 1;
            }
            assert!(seen.iter().all(|ticks| *ticks > 20 * 20), "seed {seed}: {seen:?}");
        }
    }
}
