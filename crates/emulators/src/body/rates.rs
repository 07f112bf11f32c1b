//! The sampling rates of the sensors.

use schemars::JsonSchema;
use serde::Deserialize;
use thiserror::Error;

use super::sensor::Sensor;

/// The sampling rates of a body's sensors [Hz]; 0 for a sensor that is not worn.
#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(default, deny_unknown_fields)]
pub struct Rates {
    /// The rate of the electrocardiogram [Hz]. Default: 130, a Polar H10's.
    pub ecg_hz: f64,
    /// The rate of the photoplethysmogram [Hz]. Default: 64, an Empatica E4's.
    pub ppg_hz: f64,
    /// The rate of skin conductance at the wrist [Hz]. Default: 4, an Empatica E4's.
    pub eda_wrist_hz: f64,
    /// The rate of skin conductance at the fingers [Hz]. Default: 128, a Shimmer3's.
    pub eda_fingers_hz: f64,
    /// The rate of the eight electromyograms [Hz]. Default: 200, a Myo's.
    pub emg_hz: f64,
    /// The rate of the four electroencephalograms [Hz]. Default: 256, a Muse's.
    pub eeg_hz: f64,
    /// The rate of respiration, the width of the chest [Hz]. Default: 50.
    pub respiration_hz: f64,
    /// The rate of skin temperature [Hz]. Default: 4, an Empatica E4's.
    pub temperature_hz: f64,
    /// The rate of the wrist's acceleration [Hz]. Default: 32, an Empatica E4's.
    pub acceleration_hz: f64,
}

impl Default for Rates {
    fn default() -> Rates {
        Rates {
            ecg_hz: Sensor::Ecg.usual_rate_hz(),
            ppg_hz: Sensor::Ppg.usual_rate_hz(),
            eda_wrist_hz: Sensor::EdaWrist.usual_rate_hz(),
            eda_fingers_hz: Sensor::EdaFingers.usual_rate_hz(),
            emg_hz: Sensor::Emg.usual_rate_hz(),
            eeg_hz: Sensor::Eeg.usual_rate_hz(),
            respiration_hz: Sensor::Respiration.usual_rate_hz(),
            temperature_hz: Sensor::Temperature.usual_rate_hz(),
            acceleration_hz: Sensor::Acceleration.usual_rate_hz(),
        }
    }
}

/// A rate that can't be simulated.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("the rate of {sensor:?} is {rate_hz} Hz; expected 0 (none), or {least} to {most} Hz")]
pub struct RateError {
    /// The sensor.
    pub sensor: Sensor,
    /// The requested rate [Hz].
    pub rate_hz: f64,
    /// The slowest rate that can be simulated [Hz].
    pub least: f64,
    /// The fastest rate that can be simulated [Hz].
    pub most: f64,
}

impl Rates {
    /// Returns these rates without some sensors.
    #[must_use]
    pub fn without(mut self, sensors: &[Sensor]) -> Rates {
        for sensor in sensors {
            *self.of_mut(*sensor) = 0.0;
        }
        self
    }

    fn of_mut(&mut self, sensor: Sensor) -> &mut f64 {
        match sensor {
            Sensor::Ecg => &mut self.ecg_hz,
            Sensor::Ppg => &mut self.ppg_hz,
            Sensor::EdaWrist => &mut self.eda_wrist_hz,
            Sensor::EdaFingers => &mut self.eda_fingers_hz,
            Sensor::Emg => &mut self.emg_hz,
            Sensor::Eeg => &mut self.eeg_hz,
            Sensor::Respiration => &mut self.respiration_hz,
            Sensor::Temperature => &mut self.temperature_hz,
            Sensor::Acceleration => &mut self.acceleration_hz,
        }
    }

    /// Rates without any sensor: only the ground truth is simulated.
    pub const NONE: Rates = Rates {
        ecg_hz: 0.0,
        ppg_hz: 0.0,
        eda_wrist_hz: 0.0,
        eda_fingers_hz: 0.0,
        emg_hz: 0.0,
        eeg_hz: 0.0,
        respiration_hz: 0.0,
        temperature_hz: 0.0,
        acceleration_hz: 0.0,
    };

    /// Returns the rate of one sensor [Hz]; 0 if it is not worn.
    pub fn of(&self, sensor: Sensor) -> f64 {
        match sensor {
            Sensor::Ecg => self.ecg_hz,
            Sensor::Ppg => self.ppg_hz,
            Sensor::EdaWrist => self.eda_wrist_hz,
            Sensor::EdaFingers => self.eda_fingers_hz,
            Sensor::Emg => self.emg_hz,
            Sensor::Eeg => self.eeg_hz,
            Sensor::Respiration => self.respiration_hz,
            Sensor::Temperature => self.temperature_hz,
            Sensor::Acceleration => self.acceleration_hz,
        }
    }

    /// Returns an error for a rate that can't be simulated.
    pub fn check(&self) -> Result<(), RateError> {
        Sensor::ALL.into_iter().try_for_each(|sensor| {
            let (rate_hz, can) = (self.of(sensor), sensor.rates_hz());
            if rate_hz == 0.0 || can.contains(&rate_hz) {
                return Ok(());
            }
            Err(RateError { sensor, rate_hz, least: *can.start(), most: *can.end() })
        })
    }
}
