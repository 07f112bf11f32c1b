//! The sensors that a body wears.

use std::ops::RangeInclusive;

use schemars::JsonSchema;
use serde::Deserialize;

/// The sensors that can be worn, each with its channels, unit and rate.
#[derive(Clone, Copy, Debug, Deserialize, Eq, Hash, JsonSchema, PartialEq)]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    /// The electrocardiogram, from a strap around the chest.
    Ecg,
    /// The photoplethysmogram, from light through a finger.
    Ppg,
    /// Skin conductance at the wrist, as a wristband measures it.
    EdaWrist,
    /// Skin conductance at the fingers, at a high rate.
    EdaFingers,
    /// Eight electromyograms, from a band around the forearm.
    Emg,
    /// Four electroencephalograms, from a band around the head.
    Eeg,
    /// The width of the chest, from a belt around it.
    Respiration,
    /// The temperature of the skin.
    Temperature,
    /// The acceleration of the wrist, gravity included.
    Acceleration,
}

impl Sensor {
    /// All sensors, in order.
    pub const ALL: [Sensor; 9] = [
        Sensor::Ecg,
        Sensor::Ppg,
        Sensor::EdaWrist,
        Sensor::EdaFingers,
        Sensor::Emg,
        Sensor::Eeg,
        Sensor::Respiration,
        Sensor::Temperature,
        Sensor::Acceleration,
    ];

    /// The names of the sensor's channels.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Sensor::Ecg => &["ecg"],
            Sensor::Ppg => &["ppg"],
            Sensor::EdaWrist | Sensor::EdaFingers => &["eda"],
            Sensor::Emg => &["emg1", "emg2", "emg3", "emg4", "emg5", "emg6", "emg7", "emg8"],
            Sensor::Eeg => &["TP9", "AF7", "AF8", "TP10"],
            Sensor::Respiration => &["respiration"],
            Sensor::Temperature => &["temperature"],
            Sensor::Acceleration => &["x", "y", "z"],
        }
    }

    /// The unit of the samples; "1" is relative to the usual value.
    pub fn unit(self) -> &'static str {
        match self {
            Sensor::Ecg => "mV",
            Sensor::Ppg | Sensor::Respiration => "1",
            Sensor::EdaWrist | Sensor::EdaFingers => "uS",
            Sensor::Emg | Sensor::Eeg => "uV",
            Sensor::Temperature => "degC",
            Sensor::Acceleration => "g",
        }
    }

    /// The rate of common wearable devices [Hz].
    pub fn usual_rate_hz(self) -> f64 {
        match self {
            Sensor::Ecg => 130.0,
            Sensor::Ppg => 64.0,
            Sensor::EdaWrist | Sensor::Temperature => 4.0,
            Sensor::EdaFingers => 128.0,
            Sensor::Emg => 200.0,
            Sensor::Eeg => 256.0,
            Sensor::Respiration => 50.0,
            Sensor::Acceleration => 32.0,
        }
    }

    /// The range of rates that can be simulated [Hz].
    pub fn rates_hz(self) -> RangeInclusive<f64> {
        match self {
            Sensor::Emg | Sensor::Eeg => 80.0..=4000.0,
            _ => 0.1..=4000.0,
        }
    }
}
