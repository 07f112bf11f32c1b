//! The robot's computer: its power and temperature.

use crate::noise::{Correlated, Noise};

/// The relative swing of the power around its mean.
const SWING: f64 = 0.03;
/// The period of a swing [s].
const SWING_SECS: f64 = 5.0;
/// The temperature around the computer [°C].
const AMBIENT_C: f64 = 25.0;
/// The thermal resistance of the computer [K/W].
const WARMING_K_PER_W: f64 = 2.0;
/// The thermal time constant of the computer [s].
const WARMING_SECS: f64 = 40.0;

/// A computer with a given mean consumption.
#[derive(Clone, Debug)]
pub struct Computer {
    consumption_w: f64,
    power_w: f64,
    temperature_c: f64,
    swing: Correlated,
}

impl Computer {
    /// Creates a computer that has been running for a long time.
    pub fn new(consumption_w: f64, noise: Noise) -> Computer {
        let temperature_c = AMBIENT_C + WARMING_K_PER_W * consumption_w;
        let swing = Correlated::new(SWING_SECS, noise);
        Computer { consumption_w, power_w: consumption_w, temperature_c, swing }
    }

    /// Runs for a short time with the consumption multiplied by a factor, which is 0 if the computer is off.
    pub fn advance(&mut self, factor: f64, secs: f64) {
        let swing = (1.0 + SWING * self.swing.after(secs)).max(0.0);
        self.power_w = self.consumption_w * factor * swing;
        let heads_for_c = AMBIENT_C + WARMING_K_PER_W * self.power_w;
        self.temperature_c += (heads_for_c - self.temperature_c) * secs / WARMING_SECS;
    }

    /// The present power [W].
    pub fn power_w(&self) -> f64 {
        self.power_w
    }

    /// The present temperature [°C].
    pub fn temperature_c(&self) -> f64 {
        self.temperature_c
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_computer_that_works_harder_becomes_warmer() {
        let mut computer = Computer::new(10.0, Noise::seeded(1));
        (0..2000).for_each(|_| computer.advance(1.0, 0.1));
        assert!((computer.temperature_c() - 45.0).abs() < 2.0);
        (0..2000).for_each(|_| computer.advance(2.5, 0.1));
        assert!((computer.power_w() - 25.0).abs() < 4.0);
        assert!((computer.temperature_c() - 75.0).abs() < 4.0);
    }
}
