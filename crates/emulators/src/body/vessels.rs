//! The vessels: the pulse that follows each heartbeat, as measured at a finger.

use std::collections::VecDeque;

use super::heart::{Beat, Origin};
use super::state::State;
use super::step::Step;
use super::traits::Traits;
use crate::noise::Noise;

/// The reduction of the pulse arrival time at full workload [s].
const ARRIVAL_GAIN_SECS: f64 = 0.02;
/// The reduction of the pulse height at full workload [0..1], as vessels narrow.
const HEIGHT_LOSS: f64 = 0.35;
/// The modulation of the pulse height and the baseline by breathing, relative to the usual height.
const HEIGHT_SWING: f64 = 0.08;
const BASE_SWING: f64 = 0.15;
/// The random variation of pulses: the standard deviation of the arrival [s], and of the height.
const ARRIVAL_SIGMA_SECS: f64 = 0.002;
const HEIGHT_SIGMA: f64 = 0.02;
/// The relative height of the pulse after an early beat, which pumps less.
const ECTOPIC_HEIGHT: f64 = 0.55;
/// The times from the foot to the two peaks of a pulse, and their widths [s].
const SYSTOLE_SECS: f64 = 0.14;
const SYSTOLE_WIDTH_SECS: f64 = 0.055;
const DIASTOLE_SECS: f64 = 0.36;
const DIASTOLE_WIDTH_SECS: f64 = 0.09;
/// The height of the second peak, as a share of the first.
const DIASTOLE_SHARE: f64 = 0.4;
/// The duration of a pulse [s].
const LAST_SECS: f64 = 1.0;

/// A pulse at the finger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulse {
    /// The time of the beat that it follows, after the start [s].
    pub beat_secs: f64,
    /// When the foot of the pulse arrives [s].
    pub foot_secs: f64,
    /// When the pulse peaks [s].
    pub peak_secs: f64,
    /// The height above the foot [1].
    pub amplitude: f64,
}

/// The vessels of a body.
#[derive(Clone, Debug)]
pub struct Vessels {
    arrival_secs: f64,
    amplitude: f64,
    pulses: VecDeque<Pulse>,
    noise: Noise,
}

impl Vessels {
    /// Creates vessels before their first pulse.
    pub fn new(traits: &Traits, noise: Noise) -> Vessels {
        let Traits { pulse_arrival_secs: arrival_secs, pulse_amplitude: amplitude, .. } = *traits;
        Vessels { arrival_secs, amplitude, pulses: VecDeque::new(), noise }
    }

    /// Adds the pulse of a beat at a given chest expansion.
    pub fn beat(&mut self, beat: Beat, state: State, volume: f64) {
        let late_secs = ARRIVAL_SIGMA_SECS * self.noise.normal();
        let foot_secs =
            beat.secs + self.arrival_secs - ARRIVAL_GAIN_SECS * state.workload + late_secs;
        let pumped = if beat.origin == Origin::Sinus { 1.0 } else { ECTOPIC_HEIGHT };
        let swing = 1.0 + HEIGHT_SWING * (0.5 - volume);
        let narrowed = 1.0 - HEIGHT_LOSS * state.workload;
        let amplitude =
            self.amplitude * pumped * swing * narrowed * self.noise.factor(HEIGHT_SIGMA);
        let peak_secs = foot_secs + SYSTOLE_SECS;
        self.pulses.push_back(Pulse { beat_secs: beat.secs, foot_secs, peak_secs, amplitude });
    }

    /// Advances by one step, and returns the pulse that peaks in it.
    pub fn advance(&mut self, step: Step) -> Option<Pulse> {
        let is_over = |pulse: &Pulse| step.from_secs > pulse.foot_secs + LAST_SECS;
        while self.pulses.front().is_some_and(is_over) {
            self.pulses.pop_front();
        }
        let within = step.from_secs..step.to_secs;
        self.pulses.iter().find(|pulse| within.contains(&pulse.peak_secs)).copied()
    }

    /// The blood volume in the finger at a time of the present step, as a photoplethysmogram shows it [1].
    pub fn at(&self, secs: f64, volume: f64) -> f64 {
        let pulses: f64 = self.pulses.iter().map(|pulse| pulse.at(secs)).sum();
        pulses - BASE_SWING * self.amplitude * (volume - 0.5)
    }
}

impl Pulse {
    fn at(&self, secs: f64) -> f64 {
        let after_secs = secs - self.foot_secs;
        let bump = |at_secs: f64, width_secs: f64| {
            (-0.5 * ((after_secs - at_secs) / width_secs).powi(2)).exp()
        };
        let systole = bump(SYSTOLE_SECS, SYSTOLE_WIDTH_SECS);
        let diastole = bump(DIASTOLE_SECS, DIASTOLE_WIDTH_SECS);
        self.amplitude * (systole + DIASTOLE_SHARE * diastole)
    }
}
