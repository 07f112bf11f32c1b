//! The recording of a body, and the ground truth.

use super::breath::Breath;
use super::eyes::Blink;
use super::heart::Beat;
use super::movement::Swing;
use super::muscle::Contraction;
use super::sensor::Sensor;
use super::skin::Response;
use super::state::State;
use super::vessels::Pulse;

/// Successive samples of one sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Wave {
    /// The sensor.
    pub sensor: Sensor,
    /// The sampling rate [Hz]; 0 if the sensor is not worn.
    pub rate_hz: f64,
    /// The number of the first sample, counted from the start.
    pub first: u64,
    /// The samples with all their channels, in the sensor's unit; NaN for missing values.
    pub samples: Vec<f64>,
}

impl Wave {
    /// The number of samples, each with all channels.
    pub fn count(&self) -> usize {
        self.samples.len() / self.sensor.channels().len()
    }

    /// When the first sample was taken, after the start [s].
    pub fn first_secs(&self) -> f64 {
        if self.rate_hz > 0.0 { self.first as f64 / self.rate_hz } else { 0.0 }
    }

    /// Returns the samples of one channel, numbered from 0.
    pub fn channel(&self, channel: usize) -> impl Iterator<Item = f64> + '_ {
        let channels = self.sensor.channels().len();
        self.samples.iter().copied().skip(channel).step_by(channels)
    }
}

/// The exact state of the body at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// The time after the start [s].
    pub secs: f64,
    /// The person's state.
    pub state: State,
    /// The heart rate at this time, including its oscillations [1/min].
    pub heart_rate_bpm: f64,
    /// The breathing rate [1/min].
    pub breaths_per_min: f64,
    /// The tonic level of skin conductance [µS].
    pub skin_level_us: f64,
    /// The temperature of the skin [°C].
    pub temperature_c: f64,
}

/// The ground truth as lists of events, each in order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// The state of the body once a second.
    pub moments: Vec<Moment>,
    /// Heartbeats, at their R waves.
    pub beats: Vec<Beat>,
    /// Pulses at the finger, reported at their peak.
    pub pulses: Vec<Pulse>,
    /// Responses of the skin, reported at their onset.
    pub responses: Vec<Response>,
    /// Breaths, reported when exhaled.
    pub breaths: Vec<Breath>,
    /// Blinks, reported at their onset.
    pub blinks: Vec<Blink>,
    /// Contractions of the forearm, reported at their onset.
    pub contractions: Vec<Contraction>,
    /// Movements of the arm, reported at their onset.
    pub swings: Vec<Swing>,
}

/// The recording since the previous call.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    pub(super) waves: [Wave; Sensor::ALL.len()],
    /// The ground truth.
    pub truth: Truth,
}

impl Record {
    /// Returns the recording of a sensor; empty if it is not worn.
    pub fn wave(&self, sensor: Sensor) -> &Wave {
        &self.waves[sensor as usize]
    }

    /// Returns the recordings of all sensors, in the order of [`Sensor::ALL`].
    pub fn waves(&self) -> impl Iterator<Item = &Wave> {
        self.waves.iter()
    }
}

impl Truth {
    pub(super) fn clear(&mut self) {
        self.moments.clear();
        self.beats.clear();
        self.pulses.clear();
        self.responses.clear();
        self.breaths.clear();
        self.blinks.clear();
        self.contractions.clear();
        self.swings.clear();
    }
}
