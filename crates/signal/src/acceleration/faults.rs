//! Accelerometer faults.

use super::magnitude::magnitude;
use super::motion::Moved;
use super::tilt::GRAVITY_G;
use super::unit::checked_rate;
use crate::error::SignalError;

/// The longest time for which a worn sensor gives exactly the same reading [s]: breathing and heartbeat show in the
/// last digit.
const FLAT_SECS: f64 = 10.0;
/// The third and later equal readings in a row at the end of the range seen so far are clipped, if they exceed what a
/// sensor at rest can read [g]: the smallest common range is ±2 g.
const CLIPPED_RUN: usize = 3;
const LEAST_RANGE_G: f64 = 1.9;
/// Readings clipped at a smaller range than ±2 g must stay equal for longer, as the top of a swing does not [s].
const LEAST_SMALL_RANGE_G: f64 = 1.3;
const LEAST_CLIPPED_SECS: f64 = 0.1;
/// A sensor is at rest when its motion is below this share of its reading.
const REST_SHARE: f64 = 0.05;
/// The mean acceleration over a second is at least this long, unless the device has removed gravity [g]: falls are
/// shorter.
const LEAST_GRAVITY_G: f64 = 0.3;
/// The highest reading plausible on a body [g]; a wrong unit exceeds it constantly.
const MOST_G: f64 = 20.0;

/// The fault of a sample.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Fault {
    /// An axis is clipped at the end of its range.
    Saturated,
    /// All axes have been constant for more than 10 s: the sensor is stuck or not worn.
    Flat,
    /// The sensor does not read 0.8 to 1.2 g at rest, less than 0.3 g in the mean of a second in motion, or more than
    /// 20 g: a wrong unit, a broken sensor, or gravity removed by the device.
    Implausible,
}

/// Judges samples one by one. Independent of chunking; no sample allocates.
#[derive(Clone, Debug)]
pub struct Faults {
    axes: [Axis; 3],
    clipped_run: usize,
    flat_run: usize,
    run: usize,
    last: [f64; 3],
}

impl Faults {
    /// Creates a judge for a rate of 8 Hz to 10 kHz; an error for others.
    pub fn new(rate_hz: f64) -> Result<Faults, SignalError> {
        let rate_hz = checked_rate(rate_hz)?;
        let flat_run = (FLAT_SECS * rate_hz) as usize;
        let clipped_run = CLIPPED_RUN.max((LEAST_CLIPPED_SECS * rate_hz) as usize);
        Ok(Faults { axes: [Axis::NEW; 3], clipped_run, flat_run, run: 0, last: [f64::NAN; 3] })
    }

    /// The fault of the next sample [g], given its [motion](super::Motion); `None` when it has none or a
    /// value is missing.
    pub fn push(&mut self, axes_g: [f64; 3], moved: Moved) -> Option<Fault> {
        let length_g = magnitude(axes_g);
        if length_g.is_nan() {
            return None;
        }
        let is_same =
            self.last.iter().zip(&axes_g).all(|(last, axis)| last.total_cmp(axis).is_eq());
        self.run = if is_same { self.run + 1 } else { 1 };
        self.last = axes_g;
        let mut is_cut_off = false;
        for (axis, value) in self.axes.iter_mut().zip(axes_g) {
            is_cut_off |= axis.push(value, self.clipped_run);
        }
        let is_at_rest = moved.level_g <= REST_SHARE * moved.gravity_g;
        let is_implausible = is_at_rest && !GRAVITY_G.contains(&moved.gravity_g);
        if is_implausible || moved.gravity_g < LEAST_GRAVITY_G || length_g > MOST_G {
            Some(Fault::Implausible)
        } else if self.run > self.flat_run {
            Some(Fault::Flat)
        } else {
            is_cut_off.then_some(Fault::Saturated)
        }
    }
}

/// An axis and its range so far.
#[derive(Clone, Copy, Debug)]
struct Axis {
    most: f64,
    last: f64,
    run: usize,
}

impl Axis {
    const NEW: Axis = Axis { most: 0.0, last: f64::NAN, run: 0 };

    /// Takes in a value; returns whether it is clipped, which at a small range takes this many equal samples.
    fn push(&mut self, value: f64, of_small: usize) -> bool {
        self.run = if self.last.total_cmp(&value).is_eq() { self.run + 1 } else { 1 };
        self.last = value;
        self.most = self.most.max(value.abs());
        // A range reaches one step further down than up.
        let is_at_an_end = value.abs() >= 0.98 * self.most && value.abs() >= LEAST_SMALL_RANGE_G;
        let is_small = value.abs() < LEAST_RANGE_G;
        is_at_an_end && self.run >= if is_small { of_small } else { CLIPPED_RUN }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Motion;
    use super::*;

    /// Which faults the samples have, in their order, each once for a run.
    fn faults(samples: impl Iterator<Item = [f64; 3]>) -> Vec<Option<Fault>> {
        let (mut motion, mut faults) =
            (Motion::new(32.0, 0.1).unwrap(), Faults::new(32.0).unwrap());
        let mut found: Vec<_> =
            samples.map(|axes_g| faults.push(axes_g, motion.push(axes_g))).collect();
        found.dedup();
        found
    }

    fn noise(k: u32) -> f64 {
        f64::from(k * k % 97) / 97.0
    }

    #[test]
    fn a_moving_hand_has_no_faults() {
        let hand = |k: u32| [0.3 * noise(k), 0.1, 0.9 + 0.5 * noise(k + 7)];
        assert_eq!(faults((0..3200).map(hand)), [None]);
        let resting = |k: u32| [0.0, 1.0 / 64.0 * f64::from(k / 200 % 2), 1.0];
        assert_eq!(faults((0..3200).map(resting)), [None]);
    }

    #[test]
    fn a_stuck_sensor_is_flat() {
        assert_eq!(faults((0..640).map(|_| [0.0, 0.0, 1.0])), [None, Some(Fault::Flat)]);
    }

    #[test]
    fn a_wrong_unit_is_implausible() {
        for one_g in [64.0, 9.81, 1.0 / 64.0, 0.0] {
            let rest = |k: u32| [0.0, 0.01 * one_g * noise(k), one_g];
            assert!(faults((10..100).map(rest)).contains(&Some(Fault::Implausible)), "{one_g}");
        }
    }

    #[test]
    fn readings_at_the_end_of_the_range_are_saturated() {
        let cut = |k: u32| [(3.0 * (f64::from(k) * 0.2).sin()).clamp(-2.0, 1.984_375), 0.1, 0.2];
        let found = faults((0..400).map(cut));
        assert!(found.contains(&Some(Fault::Saturated)) && found.contains(&None));
        let cut = |k: u32| [0.1, 0.2, (1.0 + 1.8 * (f64::from(k) * 0.5).sin()).clamp(-1.5, 1.5)];
        assert!(faults((0..400).map(cut)).contains(&Some(Fault::Saturated)));
        let swung = |k: u32| [0.1, 0.2, 1.0 + 0.6 * (f64::from(k) * 0.37).sin()];
        assert_eq!(faults((0..400).map(swung)), [None]);
    }

    #[test]
    fn steps_without_gravity_are_implausible() {
        let steps = |gravity_g: f64| {
            move |k: u32| [0.0, 0.05, gravity_g + 0.15 * (f64::from(k) * 0.35).sin()]
        };
        assert!(faults((0..400).map(steps(0.0))).contains(&Some(Fault::Implausible)));
        assert_eq!(faults((0..400).map(steps(1.0))), [None]);
    }
}
