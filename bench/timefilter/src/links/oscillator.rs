//! Clocks as they run: off by some ppm, warming up, drifting with temperature, and set now and then.

use std::f64::consts::TAU;

use super::random::Random;

/// How long the swing of the temperature takes [s]: 20 minutes up, 20 down.
const SWING_SECS: f64 = 2400.0;
/// How fast a device warms up: nearly done in five minutes [s].
const WARM_UP_SECS: f64 = 100.0;

/// A clock.
#[derive(Clone, Debug)]
pub struct Oscillator {
    /// What it shows at the start [s].
    pub start_secs: f64,
    /// How much too fast it runs.
    pub skew: f64,
    /// The amplitude of what temperature does to that.
    pub swing: f64,
    /// Where in its swing the temperature begins [cycles].
    pub phase: f64,
    /// By how much it still runs too fast when it was just switched on.
    pub warm_up: f64,
    /// When it was set, and by how much [s].
    pub sets: Vec<(f64, f64)>,
}

impl Oscillator {
    /// A quartz of a wearable: off by up to 50 ppm, 3 ppm of temperature, 20 ppm of warm-up.
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

    /// A quartz of a computer or a camera: no warm-up, 1 ppm of temperature.
    pub fn computer(random: &mut Random) -> Oscillator {
        Oscillator { swing: 1e-6, warm_up: 0.0, ..Oscillator::wearable(random) }
    }

    /// A clock without fault.
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

    /// What it shows at a time [s].
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
