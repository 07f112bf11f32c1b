//! The odometer: where a robot believes it is, from the rotation of its wheels.

use crate::noise::Noise;

use super::drive::{Pose, Twist};

/// The standard deviation of the error of the wheels' size between robots [1].
const WHEEL_SIGMA: f64 = 0.005;
/// The standard deviation of a speed reading, per m/s [1].
const SPEED_SIGMA: f64 = 0.02;
/// The standard deviation of a turn rate reading, per m/s or rad/s [rad/s].
const TURN_SIGMA_RADPS: f64 = 0.02;

/// Dead reckoning from noisy wheels.
#[derive(Clone, Debug)]
pub struct Odometer {
    pose: Pose,
    twist: Twist,
    wheel_scale: f64,
    noise: Noise,
}

impl Odometer {
    /// Creates an odometer with a known start.
    pub fn new(pose: Pose, mut noise: Noise) -> Odometer {
        let wheel_scale = 1.0 + WHEEL_SIGMA * noise.normal();
        Odometer { pose, twist: Twist::default(), wheel_scale, noise }
    }

    /// Advances the dead reckoning by the wheels' motion over a short time.
    pub fn advance(&mut self, true_twist: Twist, secs: f64) {
        let Twist { speed_mps, turn_radps } = true_twist;
        let slip = speed_mps.abs() + turn_radps.abs();
        self.twist = Twist {
            speed_mps: speed_mps * (self.wheel_scale + SPEED_SIGMA * self.noise.normal()),
            turn_radps: turn_radps + TURN_SIGMA_RADPS * slip * self.noise.normal(),
        };
        self.pose = self.pose.moved(self.twist, secs);
    }

    /// Where the robot believes it is.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// How it believes it is moving.
    pub fn twist(&self) -> Twist {
        self.twist
    }
}

#[cfg(test)]
mod tests {
    use super::super::arena::Point;
    use super::*;

    #[test]
    fn a_robot_at_rest_stays_where_it_believes_to_be() {
        let pose = Pose { at: Point { x_m: 1.0, y_m: 2.0 }, heading_rad: 0.5 };
        let mut odometer = Odometer::new(pose, Noise::seeded(1));
        (0..1000).for_each(|_| odometer.advance(Twist::default(), 0.05));
        assert_eq!(odometer.pose(), pose);
    }

    #[test]
    fn the_belief_drifts_by_about_a_hundredth_of_the_way() {
        let pose = Pose { at: Point { x_m: 0.0, y_m: 0.0 }, heading_rad: 0.0 };
        let mut odometer = Odometer::new(pose, Noise::seeded(1));
        let twist = Twist { speed_mps: 0.35, turn_radps: 0.0 };
        (0..2000).for_each(|_| odometer.advance(twist, 0.05));
        let error_m = odometer.pose().at.distance_m(Point { x_m: 35.0, y_m: 0.0 });
        assert!((0.001..1.5).contains(&error_m), "{error_m}");
    }
}
