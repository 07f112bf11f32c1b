//! Goals: places to drive to that cover the floor evenly.

use std::f64::consts::FRAC_PI_2;

use crate::noise::Noise;

use super::arena::{Arena, Point};

/// The steps of the sequence along x and y: the plastic number to the powers -1 and -2.
const STEPS: (f64, f64) = (0.754_877_666_246_693, 0.569_840_290_998_053);

/// A sequence of places, which depends on the seed.
///
/// An additive recurrence (Roberts 2018) fills the floor more evenly than independent random numbers do. Places near
/// the walls are more likely, by the arcsine law: paths between uniformly distributed places would mostly cross the
/// middle.
#[derive(Clone, Debug)]
pub struct Goals {
    x: f64,
    y: f64,
}

impl Goals {
    /// Creates a sequence with a random start.
    pub fn new(noise: &mut Noise) -> Goals {
        Goals { x: noise.uniform(0.0..1.0), y: noise.uniform(0.0..1.0) }
    }

    /// Returns the next place that is free for a disc.
    pub fn next_free(&mut self, arena: &Arena, radius_m: f64) -> Point {
        loop {
            self.x = (self.x + STEPS.0).fract();
            self.y = (self.y + STEPS.1).fract();
            let along_m = |part: f64| arena.floor().high.x_m * (FRAC_PI_2 * part).sin().powi(2);
            let place = Point { x_m: along_m(self.x), y_m: along_m(self.y) };
            if arena.is_free(place, radius_m) {
                return place;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dozen_goals_visit_all_quarters_of_the_floor() {
        let arena = Arena::new(10.0, 5, &mut Noise::seeded(1));
        for seed in 0..100 {
            let mut goals = Goals::new(&mut Noise::seeded(seed));
            let mut visits = [0; 4];
            for _ in 0..12 {
                let goal = goals.next_free(&arena, 0.2);
                visits[usize::from(goal.x_m > 5.0) + 2 * usize::from(goal.y_m > 5.0)] += 1;
            }
            assert!(visits.iter().all(|count| *count > 0), "seed {seed}: {visits:?}");
        }
    }
}
