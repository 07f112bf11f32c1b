//! Clocks with realistic errors: off by some ppm, warming up, drifting with temperature, and set now and then.

use std::f64::consts::TAU;

use super::random::Random;

/// The period of the temperature swing [s]: 20 minutes up, 20 down.
const SWING_SECS: f64 = 2400.0;
/// The time constant of a device's warm-up [s], which is nearly complete in five minutes.
const WARM_UP_SECS: f64 = 100.0;

/// A clock.
#[derive(Clone, Debug)]
pub struct Oscillator {
    /// The reading at the start [s].
    pub start_secs: f64,
    /// How much too fast the clock runs.
    pub skew: f64,
    /// The amplitude of the rate error due to temperature.
    pub swing: f64,
    /// The phase of the temperature swing at the start [cycles].
    pub phase: f64,
    /// How much faster the clock runs when it has just been switched on.
    pub warm_up: f64,
    /// When the clock was set, and by how much [s].
    pub sets: Vec<(f64, f64)>,
}

impl Oscillator {
    /// Makes a quartz of a wearable: off by up to 50 ppm, with 3 ppm due to temperature and 20 ppm of warm-up.
    pub fn wearable(random: &mut Random) -> Oscillator {
        Oscillator {
            start_secs: random.between(5.0, 5000.0),
            skew: random.between(-50e-6, 50e-6),
            swing: 3e-6,
            phase: random.unit(),
            warm_up: if random.chance(0.5) { 20e-6 } else { -20e-6 },
            sets: Vec::new(),
        }
    }

    /// Makes a quartz of a computer or a camera: no warm-up, 1 ppm due to temperature.
    pub fn computer(random: &mut Random) -> Oscillator {
        Oscillator { swing: 1e-6, warm_up: 0.0, ..Oscillator::wearable(random) }
    }

    /// Makes a perfect clock.
    pub fn perfect() -> Oscillator {
        Oscillator {
            start_secs: 5.0,
            skew: 0.0,
            swing: 0.0,
            phase: 0.0,
            warm_up: 0.0,
            sets: Vec::new(),
        }
    }

    /// Returns the reading at a time [s].
    pub fn at(&self, secs: f64) -> f64 {
        let swing = |secs: f64| -(TAU * (secs / SWING_SECS + self.phase)).cos() * SWING_SECS / TAU;
        let warm = self.warm_up * WARM_UP_SECS * (1.0 - (-secs / WARM_UP_SECS).exp());
        let set: f64 = self.sets.iter().filter(|(at, _)| *at <= secs).map(|(_, by)| by).sum();
        self.start_secs
            + secs * (1.0 + self.skew)
            + self.swing * (swing(secs) - swing(0.0))
            + warm
            + set
    }
}
