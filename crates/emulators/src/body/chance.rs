//! Events that happen by chance.

use super::step::{STEP_SECS, Step};
use crate::noise::Noise;

/// Events at random times with a rate that may change: a Poisson process, driven by its integrated rate.
#[derive(Clone, Debug)]
pub struct Chance {
    left: f64,
    noise: Noise,
}

impl Chance {
    /// Creates events from a stream of noise.
    pub fn new(mut noise: Noise) -> Chance {
        Chance { left: noise.exponential(), noise }
    }

    /// Returns when the next event happens [s], if it is in this step. There is at most one per step.
    pub fn within(&mut self, step: Step, per_min: f64) -> Option<f64> {
        let expected = per_min / 60.0 * STEP_SECS;
        if self.left >= expected {
            self.left -= expected;
            return None;
        }
        let at_secs = step.from_secs + STEP_SECS * self.left / expected;
        self.left = self.noise.exponential();
        Some(at_secs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_come_as_often_as_they_should_and_in_their_steps() {
        let mut chance = Chance::new(Noise::seeded(2));
        let mut count = 0;
        for step in (0..64 * 60 * 200).map(Step::nth) {
            if let Some(at_secs) = chance.within(step, 10.0) {
                assert!((step.from_secs..step.to_secs).contains(&at_secs));
                count += 1;
            }
        }
        assert!((1900..2100).contains(&count), "{count}");
        assert_eq!(chance.within(Step::nth(0), 0.0), None);
    }
}
