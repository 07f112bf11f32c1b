//! A sensor on the body, which takes its samples when they are due.

use std::f64::consts::TAU;

use super::electronics::Electronics;
use super::record::Wave;
use super::script::{Contact, Scene};
use super::sensor::Sensor;
use crate::noise::{Drift, Noise};

/// The frequency of the mains [Hz].
const MAINS_HZ: f64 = 50.0;
/// The time constant of a sensor's baseline wander [s].
const WANDER_SECS: f64 = 5.0;
/// The largest number of channels of a sensor.
pub const MOST_CHANNELS: usize = 8;

/// A worn sensor.
#[derive(Clone, Debug)]
pub struct Probe {
    sensor: Sensor,
    rate_hz: f64,
    taken: u64,
    electronics: Electronics,
    drift: Drift,
    noise: Noise,
    contact: Contact,
}

impl Probe {
    /// Creates a sensor that is read at a rate [Hz]; at 0 it is never read.
    pub fn new(sensor: Sensor, rate_hz: f64, script: &[Scene], mut noise: Noise) -> Probe {
        Probe {
            sensor,
            rate_hz,
            taken: 0,
            electronics: Electronics::of(sensor),
            drift: Drift::new(WANDER_SECS, noise.fork()),
            contact: Contact::new(sensor, script, noise.fork()),
            noise,
        }
    }

    /// The kind of sensor.
    pub fn sensor(&self) -> Sensor {
        self.sensor
    }

    /// The number of samples taken.
    pub fn taken(&self) -> u64 {
        self.taken
    }

    /// Returns an empty wave that begins with the next sample.
    pub fn wave(&self) -> Wave {
        Wave { sensor: self.sensor, rate_hz: self.rate_hz, first: self.taken, samples: Vec::new() }
    }

    /// Returns when the next sample is due, if that is before a time [s].
    pub fn due_before(&self, secs: f64) -> Option<f64> {
        let due_secs = self.taken as f64 / self.rate_hz;
        (self.rate_hz > 0.0 && due_secs < secs).then_some(due_secs)
    }

    /// Takes the sample that is due, from the body's values on all channels and the acceleration [g].
    pub fn take(&mut self, secs: f64, given: &[f64], shake_g: f64, wave: &mut Wave) {
        self.taken += 1;
        let Electronics { noise, hum, wander, shaken } = self.electronics;
        let wandered = if wander > 0.0 { self.drift.after(1.0 / self.rate_hz) } else { 0.0 };
        let hum = if hum > 0.0 { hum * (TAU * MAINS_HZ * secs).sin() } else { 0.0 };
        let common = wander * wandered + hum + shaken * shake_g;
        let begin = wave.samples.len();
        let mut white = || if noise > 0.0 { noise * self.noise.normal() } else { 0.0 };
        wave.samples.extend(given.iter().map(|value| value + common + white()));
        if self.contact.has_script() {
            self.contact.disturb(secs, &mut wave.samples[begin..]);
        }
    }
}
