//! The temperature of the skin.

use super::state::State;
use super::step::STEP_SECS;
use super::traits::Traits;
use crate::noise::{Drift, Noise};

/// The time constant with which skin temperature follows workload [s].
const LAG_SECS: f64 = 90.0;
/// The random drift of skin temperature [K], and its time constant [s].
const DRIFT_K: f64 = 0.05;
const DRIFT_SECS: f64 = 180.0;

/// The temperature of the skin: under workload vessels narrow, and the skin cools.
#[derive(Clone, Debug)]
pub struct Warmth {
    rest_c: f64,
    cooling_k: f64,
    cooled_k: f64,
    drift: Drift,
    wandered_k: f64,
}

impl Warmth {
    /// Creates skin with its temperature at rest.
    pub fn new(traits: &Traits, noise: Noise) -> Warmth {
        let Traits { skin_temperature_c: rest_c, cooling_k, .. } = *traits;
        let drift = Drift::new(DRIFT_SECS, noise);
        Warmth { rest_c, cooling_k, cooled_k: 0.0, drift, wandered_k: 0.0 }
    }

    /// Advances by one step.
    pub fn advance(&mut self, state: State) {
        let target_k = self.cooling_k * state.workload;
        self.cooled_k += (target_k - self.cooled_k) * (1.0 - (-STEP_SECS / LAG_SECS).exp());
        self.wandered_k = DRIFT_K * self.drift.after(STEP_SECS);
    }

    /// The present temperature [°C].
    pub fn temperature_c(&self) -> f64 {
        self.rest_c - self.cooled_k + self.wandered_k
    }
}
