//! The heart: when it beats.

use std::f64::consts::{PI, TAU};

use super::state::State;
use super::step::{STEP_SECS, Step};
use super::traits::Traits;
use crate::noise::{Correlated, Noise};

/// The reduction of respiratory sinus arrhythmia at full workload [0..1].
const RSA_LOSS: f64 = 0.65;
/// The reduction of the 10 s rhythm at full workload [0..1].
const MAYER_LOSS: f64 = 0.4;
/// The frequency of the 10 s rhythm of blood pressure [Hz], the frequency's variation, and its time constant [s].
const MAYER_HZ: f64 = 0.095;
const MAYER_SIGMA: f64 = 0.1;
const MAYER_SECS: f64 = 20.0;
/// The random jitter of a beat [s].
const JITTER_SECS: f64 = 0.004;
/// The share of a cycle after which a ventricular beat occurs; the next regular beat comes when it is due.
const ECTOPIC_CYCLES: f64 = 0.65;
/// The shortest cycle [s].
const LEAST_CYCLE_SECS: f64 = 0.3;

/// The origin of a beat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The sinus node, as normal.
    Sinus,
    /// A ventricle: the beat is early, wide, and followed by a pause.
    Ventricle,
}

/// A heartbeat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beat {
    /// When the R wave peaks, after the start [s].
    pub secs: f64,
    /// The origin of the beat.
    pub origin: Origin,
}

/// The cardiac cycle during a step, or part of one.
#[derive(Clone, Copy, Debug)]
struct CycleStep {
    from_secs: f64,
    place: f64,
    per_sec: f64,
    last: Origin,
    next: Origin,
}

/// The position in the cardiac cycle at a time.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The phase of the cycle: 0 at one beat, 2π at the next.
    pub angle: f64,
    /// The heart rate at this time [Hz].
    pub rate_hz: f64,
    /// The origin of the previous beat.
    pub last: Origin,
    /// The origin of the next beat.
    pub next: Origin,
}

/// The heart of a body: an integral pulse frequency model.
///
/// The rate is integrated, and a beat occurs whenever the integral has grown by one cycle (Mateo & Laguna 2000,
/// doi:10.1109/10.844232). The RR interval swings with breathing and with the 10 s rhythm of blood pressure, both less
/// under workload; jitter moves single beats.
#[derive(Clone, Debug)]
pub struct Heart {
    traits: Traits,
    mayer_angle: f64,
    mayer: Correlated,
    noise: Noise,
    /// The fraction of a cycle from the last beat to the next.
    cycles: f64,
    steps: [CycleStep; 2],
    rate_hz: f64,
}

impl Heart {
    /// Creates a heart at a random position in its cycle.
    pub fn new(traits: &Traits, mut noise: Noise) -> Heart {
        let start = CycleStep {
            from_secs: 0.0,
            place: noise.uniform(0.0..1.0),
            per_sec: 0.0,
            last: Origin::Sinus,
            next: Origin::Sinus,
        };
        Heart {
            traits: traits.clone(),
            mayer_angle: noise.uniform(0.0..TAU),
            mayer: Correlated::new(MAYER_SECS, noise.fork()),
            noise,
            cycles: 1.0,
            steps: [start; 2],
            rate_hz: traits.heart_rate_bpm / 60.0,
        }
    }

    /// Advances by one step at a given chest expansion, and returns the beat in it, if there is one.
    pub fn advance(&mut self, step: Step, state: State, volume: f64) -> Option<Beat> {
        let cycle_secs = self.cycle_secs(state, volume);
        self.rate_hz = 1.0 / cycle_secs;
        let [_, last] = self.steps;
        let place = last.place + last.per_sec * (step.from_secs - last.from_secs);
        let per_sec = self.rate_hz / self.cycles;
        let cycle = CycleStep { from_secs: step.from_secs, place, per_sec, ..last };
        self.steps = [cycle; 2];
        if place + per_sec * STEP_SECS < 1.0 {
            return None;
        }
        let secs = step.from_secs + (1.0 - place) / per_sec;
        let next = self.next_origin(cycle.next, cycle_secs);
        let per_sec = self.rate_hz / self.cycles;
        self.steps[1] = CycleStep { from_secs: secs, place: 0.0, per_sec, last: cycle.next, next };
        Some(Beat { secs, origin: cycle.next })
    }

    /// The heart rate in the present step, including its oscillations [1/min].
    pub fn rate_bpm(&self) -> f64 {
        60.0 * self.rate_hz
    }

    /// Returns the position in the cycle at a time of the present step.
    pub fn place(&self, secs: f64) -> Place {
        let [before, after] = &self.steps;
        let cycle = if secs < after.from_secs { before } else { after };
        let share = cycle.place + cycle.per_sec * (secs - cycle.from_secs);
        Place { angle: TAU * share, rate_hz: self.rate_hz, last: cycle.last, next: cycle.next }
    }

    fn cycle_secs(&mut self, State { workload, .. }: State, volume: f64) -> f64 {
        let traits = &self.traits;
        let rate_bpm = traits.heart_rate_bpm + traits.heart_rate_rise_bpm * workload;
        // Inhaling makes the heart beat faster.
        let rsa_secs = traits.rsa_secs * (1.0 - RSA_LOSS * workload) * (1.0 - 2.0 * volume);
        let faster = (MAYER_SIGMA * self.mayer.after(STEP_SECS)).exp();
        self.mayer_angle = (self.mayer_angle + TAU * MAYER_HZ * faster * STEP_SECS) % TAU;
        let swing = (self.mayer_angle - PI).sin();
        let mayer_secs = traits.mayer_secs * (1.0 - MAYER_LOSS * workload) * swing;
        (60.0 / rate_bpm + rsa_secs + mayer_secs).max(LEAST_CYCLE_SECS)
    }

    /// Chooses the origin of the next beat, and the fraction of a cycle until then.
    fn next_origin(&mut self, this: Origin, cycle_secs: f64) -> Origin {
        let jitter = 1.0 + JITTER_SECS / cycle_secs * self.noise.normal().clamp(-4.0, 4.0);
        let is_early = self.noise.chance(self.traits.ectopic_share);
        let (cycles, next) = match this {
            Origin::Ventricle => (2.0 - ECTOPIC_CYCLES, Origin::Sinus),
            Origin::Sinus if is_early => (ECTOPIC_CYCLES, Origin::Ventricle),
            Origin::Sinus => (1.0, Origin::Sinus),
        };
        self.cycles = cycles * jitter;
        next
    }
}
