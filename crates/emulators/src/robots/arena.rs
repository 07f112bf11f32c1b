//! The arena: a square floor with boxes on it.
//!
//! The lower left corner is the origin; x points right and y up, as on a map.

use crate::noise::Noise;

/// The position of the router, in the lower left corner [m].
pub const ROUTER: Point = Point { x_m: 0.3, y_m: 0.3 };
/// The smallest gap between boxes, and between a box and a wall [m].
const GAP_M: f64 = 0.8;
/// The radius around the router without boxes [m].
const ROUTER_CLEAR_M: f64 = 1.5;
/// The number of attempts to find a place for an object.
const TRIES: usize = 1000;

/// A point on the floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// The distance to the right of the lower left corner [m].
    pub x_m: f64,
    /// The distance above the lower left corner [m].
    pub y_m: f64,
}

impl Point {
    /// The distance to another point [m].
    pub fn distance_m(self, other: Point) -> f64 {
        (other.x_m - self.x_m).hypot(other.y_m - self.y_m)
    }

    /// The direction to another point, counter-clockwise from x [rad].
    pub fn bearing_rad(self, other: Point) -> f64 {
        (other.y_m - self.y_m).atan2(other.x_m - self.x_m)
    }

    /// Returns the point at this distance in this direction.
    #[must_use]
    pub fn toward(self, bearing_rad: f64, distance_m: f64) -> Point {
        let (sin, cos) = bearing_rad.sin_cos();
        Point { x_m: self.x_m + distance_m * cos, y_m: self.y_m + distance_m * sin }
    }
}

/// An axis-aligned rectangle: a box, or the floor itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// The lower left corner.
    pub low: Point,
    /// The upper right corner.
    pub high: Point,
}

impl Rect {
    /// Returns the rectangle with every side moved outwards, or inwards if `by_m` is negative.
    #[must_use]
    pub fn grown(self, by_m: f64) -> Rect {
        Rect {
            low: Point { x_m: self.low.x_m - by_m, y_m: self.low.y_m - by_m },
            high: Point { x_m: self.high.x_m + by_m, y_m: self.high.y_m + by_m },
        }
    }

    /// Whether a point is strictly inside.
    pub fn contains(self, at: Point) -> bool {
        self.low.x_m < at.x_m
            && at.x_m < self.high.x_m
            && self.low.y_m < at.y_m
            && at.y_m < self.high.y_m
    }

    /// Returns a uniformly distributed point inside.
    pub fn any_point(self, noise: &mut Noise) -> Point {
        Point {
            x_m: noise.uniform(self.low.x_m..self.high.x_m),
            y_m: noise.uniform(self.low.y_m..self.high.y_m),
        }
    }

    fn overlaps(self, other: Rect) -> bool {
        self.low.x_m < other.high.x_m
            && other.low.x_m < self.high.x_m
            && self.low.y_m < other.high.y_m
            && other.low.y_m < self.high.y_m
    }

    /// Returns where a straight line from `from` enters and leaves [m], negative behind `from`; `None` if it misses.
    fn crossing_m(self, from: Point, bearing_rad: f64) -> Option<(f64, f64)> {
        let (sin, cos) = bearing_rad.sin_cos();
        let slab = |low: f64, high: f64, slope: f64| {
            let (one, other) = (low / slope, high / slope);
            (one.min(other), one.max(other))
        };
        let x = slab(self.low.x_m - from.x_m, self.high.x_m - from.x_m, cos);
        let y = slab(self.low.y_m - from.y_m, self.high.y_m - from.y_m, sin);
        let (enters, leaves) = (x.0.max(y.0), x.1.min(y.1));
        (enters < leaves && leaves > 0.0).then_some((enters, leaves))
    }
}

/// A square floor with boxes.
#[derive(Clone, Debug)]
pub struct Arena {
    floor: Rect,
    boxes: Vec<Rect>,
}

impl Arena {
    /// Creates an arena with boxes at random places; with fewer if no more fit.
    pub fn new(side_m: f64, boxes: u32, noise: &mut Noise) -> Arena {
        let low = Point { x_m: 0.0, y_m: 0.0 };
        let floor = Rect { low, high: Point { x_m: side_m, y_m: side_m } };
        let mut arena = Arena { floor, boxes: Vec::new() };
        for _ in 0..boxes {
            let place = (0..TRIES).map(|_| arena.any_box(noise)).find(|each| arena.has_room(*each));
            arena.boxes.extend(place);
        }
        arena
    }

    /// The floor.
    pub fn floor(&self) -> Rect {
        self.floor
    }

    /// The boxes.
    pub fn boxes(&self) -> &[Rect] {
        &self.boxes
    }

    /// Whether a disc of this radius fits at a point without touching a wall or a box.
    pub fn is_free(&self, at: Point, radius_m: f64) -> bool {
        self.floor.grown(-radius_m).contains(at)
            && !self.boxes.iter().any(|each| each.grown(radius_m).contains(at))
    }

    /// Returns the distance that a disc can roll in a direction before it touches a wall or a box [m], at most
    /// `reach_m`.
    pub fn clearance_m(&self, from: Point, bearing_rad: f64, radius_m: f64, reach_m: f64) -> f64 {
        let inside = self.floor.grown(-radius_m);
        let wall_m = inside.crossing_m(from, bearing_rad).map_or(0.0, |(_, leaves)| leaves);
        let boxes = self.boxes.iter().map(|each| each.grown(radius_m));
        let hits = boxes.filter_map(|each| each.crossing_m(from, bearing_rad));
        hits.map(|(enters, _)| enters.max(0.0)).fold(wall_m.min(reach_m), f64::min)
    }

    /// Returns the number of boxes between two points.
    pub fn boxes_between(&self, from: Point, to: Point) -> usize {
        let (bearing_rad, distance_m) = (from.bearing_rad(to), from.distance_m(to));
        let hits = self.boxes.iter().filter_map(|each| each.crossing_m(from, bearing_rad));
        hits.filter(|(enters, _)| *enters < distance_m).count()
    }

    fn any_box(&self, noise: &mut Noise) -> Rect {
        let low = self.floor.any_point(noise);
        let x_m = low.x_m + noise.uniform(0.4..1.2);
        let y_m = low.y_m + noise.uniform(0.4..1.2);
        Rect { low, high: Point { x_m, y_m } }
    }

    fn has_room(&self, new: Rect) -> bool {
        let floor = self.floor.grown(-GAP_M);
        floor.contains(new.low)
            && floor.contains(new.high)
            && new.low.distance_m(ROUTER) > ROUTER_CLEAR_M
            && !self.boxes.iter().any(|each| each.overlaps(new.grown(GAP_M)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn arena() -> Arena {
        let low = Point { x_m: 4.0, y_m: 4.0 };
        let boxes = vec![Rect { low, high: Point { x_m: 6.0, y_m: 6.0 } }];
        Arena { boxes, ..Arena::new(10.0, 0, &mut Noise::seeded(1)) }
    }

    #[test]
    fn a_disc_rolls_until_it_touches_a_box_or_a_wall() {
        let from = Point { x_m: 2.0, y_m: 5.0 };
        let clear = |bearing_rad, reach_m| arena().clearance_m(from, bearing_rad, 0.2, reach_m);
        assert!((clear(0.0, 20.0) - 1.8).abs() < 1e-9);
        assert!((clear(PI, 20.0) - 1.8).abs() < 1e-9);
        assert!((clear(FRAC_PI_2, 20.0) - 4.8).abs() < 1e-9);
        assert!((clear(FRAC_PI_2, 1.0) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_box_is_between_two_places_only_when_the_line_crosses_it() {
        let at = |x_m, y_m| Point { x_m, y_m };
        assert_eq!(arena().boxes_between(at(1.0, 5.0), at(9.0, 5.0)), 1);
        assert_eq!(arena().boxes_between(at(1.0, 5.0), at(3.0, 5.0)), 0);
        assert_eq!(arena().boxes_between(at(1.0, 1.0), at(9.0, 1.0)), 0);
    }

    #[test]
    fn every_pair_of_boxes_leaves_a_way_open() {
        for seed in 0..20 {
            let arena = Arena::new(10.0, 8, &mut Noise::seeded(seed));
            assert!(arena.boxes.len() >= 5, "seed {seed}: {} boxes", arena.boxes.len());
            for (k, each) in arena.boxes.iter().enumerate() {
                assert!(arena.boxes[..k].iter().all(|other| !other.overlaps(each.grown(0.79))));
            }
        }
    }
}
