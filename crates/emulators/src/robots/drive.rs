//! The differential drive: a pose, and how it moves.

use std::f64::consts::{PI, TAU};

use super::arena::Point;

/// The position and heading of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The centre of the body.
    pub at: Point,
    /// The heading of the body, counter-clockwise from x [rad].
    pub heading_rad: f64,
}

/// The motion of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Twist {
    /// The forward speed [m/s].
    pub speed_mps: f64,
    /// The turn rate, counter-clockwise [rad/s].
    pub turn_radps: f64,
}

impl Pose {
    /// Returns the pose after a short time of motion, along the chord of the arc.
    #[must_use]
    pub fn moved(self, twist: Twist, secs: f64) -> Pose {
        let turn_rad = twist.turn_radps * secs;
        let at = self.at.toward(self.heading_rad + turn_rad / 2.0, twist.speed_mps * secs);
        Pose { at, heading_rad: wrapped_rad(self.heading_rad + turn_rad) }
    }
}

impl Twist {
    /// Returns the twist after changing towards another for a short time, as fast as the motors allow.
    #[must_use]
    pub fn toward(self, wanted: Twist, secs: f64) -> Twist {
        let slewed = |from: f64, to: f64, most: f64| from + (to - from).clamp(-most, most);
        Twist {
            speed_mps: slewed(self.speed_mps, wanted.speed_mps, MOST_MPS2 * secs),
            turn_radps: slewed(self.turn_radps, wanted.turn_radps, MOST_RADPS2 * secs),
        }
    }
}

/// The greatest acceleration and deceleration [m/s²].
pub const MOST_MPS2: f64 = 0.8;
/// The greatest angular acceleration [rad/s²].
const MOST_RADPS2: f64 = 6.0;

/// Returns the same angle in (-π, π] [rad].
pub fn wrapped_rad(angle_rad: f64) -> f64 {
    PI - (PI - angle_rad).rem_euclid(TAU)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_circle_ends_where_it_began() {
        let start = Pose { at: Point { x_m: 3.0, y_m: 2.0 }, heading_rad: 1.0 };
        let twist = Twist { speed_mps: 0.5, turn_radps: TAU / 10.0 };
        let end = (0..200).fold(start, |pose, _| pose.moved(twist, 0.05));
        assert!(end.at.distance_m(start.at) < 1e-9);
        assert!((end.heading_rad - start.heading_rad).abs() < 1e-9);
    }

    #[test]
    fn angles_wrap_to_half_a_turn_on_either_side() {
        assert!((wrapped_rad(1.5 * PI) + 0.5 * PI).abs() < 1e-12);
        assert!((wrapped_rad(-1.5 * PI) - 0.5 * PI).abs() < 1e-12);
        assert!((wrapped_rad(PI) - PI).abs() < 1e-12);
    }
}
