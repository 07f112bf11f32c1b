//! The obstacles around one body: the arena and the other bodies.

use super::arena::{Arena, Point};

/// A round body on the floor.
#[derive(Clone, Copy, Debug)]
pub struct Disc {
    /// The centre of the body.
    pub at: Point,
    /// The radius of the body [m].
    pub radius_m: f64,
}

impl Disc {
    /// The distance between two bodies [m]; negative if they overlap.
    pub fn gap_m(self, other: Disc) -> f64 {
        self.at.distance_m(other.at) - self.radius_m - other.radius_m
    }

    /// Returns the distance that this body can roll in a direction before it touches another [m]; `None` if it misses.
    fn roll_m(self, bearing_rad: f64, other: Disc) -> Option<f64> {
        let (distance_m, touch_m) = (self.at.distance_m(other.at), self.radius_m + other.radius_m);
        let off_rad = self.at.bearing_rad(other.at) - bearing_rad;
        let (ahead_m, aside_m) = (distance_m * off_rad.cos(), distance_m * off_rad.sin());
        let meets = ahead_m > 0.0 && aside_m.abs() < touch_m;
        meets.then(|| (ahead_m - (touch_m * touch_m - aside_m * aside_m).sqrt()).max(0.0))
    }
}

/// The surroundings of the body with the index `own`.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// The arena.
    pub arena: &'a Arena,
    /// All bodies on the floor.
    pub bodies: &'a [Disc],
    /// The index of the body itself in `bodies`.
    pub own: usize,
}

impl Surroundings<'_> {
    /// Returns the distance that the body can roll in a direction [m], at most `reach_m`.
    pub fn clearance_m(&self, from: Disc, bearing_rad: f64, reach_m: f64) -> f64 {
        let still = self.arena.clearance_m(from.at, bearing_rad, from.radius_m, reach_m);
        let near = self.others().filter(|other| from.gap_m(*other) < reach_m);
        near.filter_map(|other| from.roll_m(bearing_rad, other)).fold(still, f64::min)
    }

    /// Whether the body may move: it stays clear of walls and boxes, and does not get closer to a body that it would
    /// touch.
    pub fn admits(&self, from: Disc, to: Disc) -> bool {
        let blocked = |other: Disc| to.gap_m(other) < 0.0 && to.gap_m(other) < from.gap_m(other);
        self.arena.is_free(to.at, to.radius_m) && !self.others().any(blocked)
    }

    fn others(&self) -> impl Iterator<Item = Disc> {
        let own = self.own;
        self.bodies.iter().enumerate().filter(move |(k, _)| *k != own).map(|(_, body)| *body)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(x_m: f64, y_m: f64) -> Disc {
        Disc { at: Point { x_m, y_m }, radius_m: 0.2 }
    }

    #[test]
    fn a_body_rolls_until_it_touches_another() {
        assert!((disc(0.0, 0.0).roll_m(0.0, disc(2.0, 0.0)).unwrap() - 1.6).abs() < 1e-9);
        assert_eq!(disc(0.0, 0.0).roll_m(0.0, disc(2.0, 0.5)), None);
        assert_eq!(disc(0.0, 0.0).roll_m(0.0, disc(-2.0, 0.0)), None);
    }

    #[test]
    fn bodies_that_touch_may_part_but_not_press() {
        let arena = Arena::new(10.0, 0, &mut crate::noise::Noise::seeded(1));
        let bodies = [disc(5.0, 5.0), disc(5.3, 5.0)];
        let around = Surroundings { arena: &arena, bodies: &bodies, own: 0 };
        assert!(around.admits(bodies[0], disc(4.9, 5.0)));
        assert!(!around.admits(bodies[0], disc(5.05, 5.0)));
    }
}
