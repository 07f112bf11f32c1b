//! The orientation of a sensor.

use super::magnitude::magnitude;

/// The readings of a sensor at rest [g]: gravity, within a tolerance.
pub(super) const GRAVITY_G: std::ops::RangeInclusive<f64> = 0.8..=1.2;

/// The angle between the z axis and the vertical [°, 0..180], from the mean acceleration [g].
///
/// acos(z / |a|): 0 when the sensor lies on its back, 90 on its edge, 180 on its face. `None` unless the
/// mean has the length of gravity, 0.8 to 1.2 g: during a movement that continues in one direction the
/// angle is meaningless.
pub fn tilt_deg(mean_g: [f64; 3]) -> Option<f64> {
    let length = magnitude(mean_g);
    let is_gravity = GRAVITY_G.contains(&length);
    is_gravity.then(|| (mean_g[2] / length).clamp(-1.0, 1.0).acos().to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_three_ways_to_lie_are_reported() {
        let cases = [([0.0, 0.0, 1.0], 0.0), ([0.0, -1.1, 0.0], 90.0), ([0.0, 0.0, -0.9], 180.0)];
        for (mean_g, angle_deg) in cases {
            assert!((tilt_deg(mean_g).unwrap() - angle_deg).abs() < 1e-9);
        }
        assert!((tilt_deg([0.5, 0.5, 0.5f64.sqrt()]).unwrap() - 45.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_not_gravity_has_no_direction() {
        for mean_g in [[0.0; 3], [0.0, 0.0, 9.8], [f64::NAN, 0.0, 1.0]] {
            assert_eq!(tilt_deg(mean_g), None);
        }
    }
}
