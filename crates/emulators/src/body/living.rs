//! The body as a whole.

use schemars::JsonSchema;
use serde::Deserialize;

use super::muscle::{Contraction, shared};
use super::organs::Organs;
use super::probe::Probe;
use super::rates::{RateError, Rates};
use super::record::{Record, Truth};
use super::script::{Scene, movement_g};
use super::sensor::Sensor;
use super::state::State;
use super::step::{STEPS_HZ, Step};
use super::traits::Traits;
use crate::noise::Noise;

/// The longest time that a body is simulated in one call [s].
const MOST_SECS: f64 = 3600.0;
/// How long before a key press the finger's flexors contract, and for how long [s].
const PRESS_AHEAD_SECS: f64 = 0.06;
const PRESS_SECS: f64 = 0.18;
/// The strength of that contraction [µV RMS].
const PRESS_UV: f64 = 45.0;

/// The sensors of a body, and their faults.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema, PartialEq)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// The sampling rates of the sensors [Hz].
    pub rates: Rates,
    /// Faults, with their sensors and times.
    pub script: Vec<Scene>,
}

/// A simulated body of one person, with sensors on it.
///
/// It has no clock: the caller decides until when to simulate, in whole steps of 1/64 s. The same traits, seed,
/// settings and calls at the same simulated times give the same record, bit for bit, however the time is divided.
#[derive(Clone, Debug)]
pub struct Body {
    organs: Organs,
    probes: [Probe; Sensor::ALL.len()],
    script: Vec<Scene>,
    steps: u64,
    record: Record,
}

impl Body {
    /// Creates a body at rest with all sensors at their usual rates.
    pub fn new(traits: &Traits, seed: u64) -> Body {
        let body = Body::wearing(traits, seed, &Settings::default());
        body.expect("the usual rates can be simulated")
    }

    /// Creates a body at rest with sensors configured by these settings.
    pub fn wearing(traits: &Traits, seed: u64, settings: &Settings) -> Result<Body, RateError> {
        let Settings { rates, script } = settings;
        rates.check()?;
        let mut noise = Noise::seeded(seed);
        let organs = Organs::new(traits, rates, &mut noise);
        let probe = |sensor| Probe::new(sensor, rates.of(sensor), script, noise.fork());
        let probes = Sensor::ALL.map(probe);
        let waves = probes.each_ref().map(Probe::wave);
        let record = Record { waves, truth: Truth::default() };
        Ok(Body { organs, probes, script: script.clone(), steps: 0, record })
    }

    /// The simulated time so far [s].
    pub fn secs(&self) -> f64 {
        self.steps as f64 / STEPS_HZ
    }

    /// The person's present state.
    pub fn now(&self) -> State {
        self.organs.transition.now()
    }

    /// Moves the person towards another state, each part from 0 to 1.
    pub fn state(&mut self, workload: f64, arousal: f64, valence: f64) {
        self.organs.transition.aim_at(State { workload, arousal, valence });
    }

    /// Triggers an event at a time [s] to which the skin responds 1.5 to 3 s later, at a multiple of the usual
    /// strength.
    pub fn startle(&mut self, at_secs: f64, strength: f64) {
        if at_secs.is_finite() && strength.is_finite() {
            self.organs.skin.startle(at_secs, strength);
        }
    }

    /// Presses a key at a time [s]; the finger's muscles contract 60 ms earlier, but not before now.
    pub fn press(&mut self, at_secs: f64) {
        let from_secs = (at_secs - PRESS_AHEAD_SECS).max(self.secs());
        if at_secs.is_finite() {
            self.organs.muscles.contract(Contraction {
                from_secs,
                to_secs: from_secs + PRESS_SECS,
                strength_uv: PRESS_UV,
                flexes: true,
                shared: shared(self.now()),
            });
        }
    }

    /// Closes the eyes.
    pub fn close_eyes(&mut self) {
        self.organs.eyes.close();
    }

    /// Opens the eyes.
    pub fn open_eyes(&mut self) {
        self.organs.eyes.open();
    }

    /// Simulates up to a time [s], in whole steps and at most an hour per call, and returns the recording since the
    /// previous call.
    pub fn until(&mut self, secs: f64) -> &Record {
        self.turn_over();
        self.live(secs);
        &self.record
    }

    /// Returns the time up to which a call for a time [s] simulates [s].
    pub(crate) fn most_until(&self, secs: f64) -> f64 {
        if secs.is_nan() { self.secs() } else { secs.min(self.secs() + MOST_SECS) }
    }

    /// The recording since the previous call.
    pub(crate) fn record(&self) -> &Record {
        &self.record
    }

    /// Begins a new record.
    pub(crate) fn turn_over(&mut self) {
        for (wave, probe) in self.record.waves.iter_mut().zip(&self.probes) {
            wave.samples.clear();
            wave.first = probe.taken();
        }
        self.record.truth.clear();
    }

    /// Simulates until a time, and adds to the record.
    pub(crate) fn live(&mut self, secs: f64) {
        let until = Step::whole_until(self.most_until(secs));
        while self.steps < until {
            let step = Step::nth(self.steps);
            self.steps += 1;
            self.live_through(step);
        }
    }

    fn live_through(&mut self, step: Step) {
        let Record { waves, truth } = &mut self.record;
        self.organs.advance(step, movement_g(&self.script, step.from_secs), truth);
        for (probe, wave) in self.probes.iter_mut().zip(waves) {
            while let Some(secs) = probe.due_before(step.to_secs) {
                let sensor = probe.sensor();
                let given = self.organs.give(sensor, secs);
                let given = &given[..sensor.channels().len()];
                probe.take(secs, given, self.organs.shake_g(secs), wave);
            }
        }
        if step.to_secs.fract() == 0.0 {
            truth.moments.push(self.organs.moment(step));
        }
    }
}
