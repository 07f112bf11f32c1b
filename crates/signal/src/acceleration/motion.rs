//! The current motion of a sensor, and whether it spoils co-located signals.

use super::magnitude::magnitude;
use super::unit::checked_rate;
use crate::error::{SignalError, checked};
use crate::sliding::SlidingMoments;

/// The window of the motion level [s].
const LEVEL_SECS: f64 = 1.0;

/// Measures the level of motion: the standard deviation of the acceleration over the last second, √(σx² + σy² + σz²)
/// [g].
///
/// It needs no filter to separate gravity from motion; turning in place counts as motion. A level above the
/// limit marks an artefact in a pulse wave or skin conductance measured at the same place. Independent of
/// chunking; no sample allocates.
#[derive(Clone, Debug)]
pub struct Motion {
    axes: [SlidingMoments; 3],
    limit_g: f64,
}

/// Motion at a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    /// The level of motion in the last second [g]; NaN with fewer than two usable samples.
    pub level_g: f64,
    /// Whether the level is above the limit.
    pub is_artefact: bool,
    /// The magnitude of the mean acceleration over the last second [g]: gravity, at rest. NaN without a
    /// usable sample.
    pub gravity_g: f64,
}

impl Motion {
    /// Creates the measure for a rate of 8 Hz to 10 kHz and a limit of the level [g]; an error for another rate, or a
    /// limit that is negative or not a number.
    pub fn new(rate_hz: f64, limit_g: f64) -> Result<Motion, SignalError> {
        let length = (LEVEL_SECS * checked_rate(rate_hz)?).round() as usize;
        let limit_g = checked("limit of motion [g]", limit_g, (0.0, f64::MAX))?;
        let axis = SlidingMoments::new(length)?;
        Ok(Motion { axes: [axis.clone(), axis.clone(), axis], limit_g })
    }

    /// The number of samples in the motion window.
    pub(super) fn length(rate_hz: f64) -> usize {
        (LEVEL_SECS * rate_hz).round() as usize
    }

    /// Takes in the next sample [g].
    pub fn push(&mut self, axes_g: [f64; 3]) -> Moved {
        let is_whole = !magnitude(axes_g).is_nan();
        for (axis, value) in self.axes.iter_mut().zip(axes_g) {
            axis.push(if is_whole { value } else { f64::NAN });
        }
        let variances = self.axes.iter().map(|axis| axis.variance().unwrap_or(f64::NAN));
        let level_g = variances.sum::<f64>().max(0.0).sqrt();
        let level_g = if self.axes[0].count() > 1 { level_g } else { f64::NAN };
        let [x, y, z] = &self.axes;
        let gravity_g = magnitude([x, y, z].map(|axis| axis.mean().unwrap_or(f64::NAN)));
        Moved { level_g, is_artefact: level_g > self.limit_g, gravity_g }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sensor_that_lies_still_does_not_move() {
        let mut motion = Motion::new(32.0, 0.1).unwrap();
        for _ in 0..100 {
            let moved = motion.push([0.1, 0.2, 0.97]);
            assert!(!moved.is_artefact && (moved.level_g.is_nan() || moved.level_g == 0.0));
        }
    }

    #[test]
    fn the_level_of_an_oscillation_is_its_spread() {
        let mut motion = Motion::new(100.0, 0.1).unwrap();
        let wave = |k: u32| 1.0 + 0.5 * (std::f64::consts::TAU * f64::from(k) / 20.0).sin();
        let moved = (0..500).map(|k| motion.push([0.0, wave(k), 0.0])).last().unwrap();
        assert!((moved.level_g - 0.5 / 2f64.sqrt()).abs() < 0.01 && moved.is_artefact);
        assert!((moved.gravity_g - 1.0).abs() < 1e-9);
    }

    #[test]
    fn it_is_over_a_second_after_the_last_movement() {
        let mut motion = Motion::new(50.0, 0.1).unwrap();
        (0..100).for_each(|k| _ = motion.push([f64::from(k % 2), 0.0, 1.0]));
        let after: Vec<bool> = (0..51).map(|_| motion.push([0.0, 0.0, 1.0]).is_artefact).collect();
        assert!(after[0] && !after[50]);
    }

    #[test]
    fn a_limit_that_is_none_is_refused() {
        for limit_g in [-0.1, f64::NAN, f64::INFINITY] {
            assert!(Motion::new(50.0, limit_g).is_err());
        }
    }
}
