//! Noise and artefacts that sensors add to the body's signals.

use super::sensor::Sensor;

/// The noise and artefacts of a sensor, in its unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Electronics {
    /// The standard deviation of white noise; muscles and brain are noisy enough without it.
    pub noise: f64,
    /// The amplitude of mains hum.
    pub hum: f64,
    /// The standard deviation of the baseline's drift over several seconds.
    pub wander: f64,
    /// The disturbance by a movement of 1 g; 0 for an accelerometer, which measures the movement.
    pub shaken: f64,
}

impl Electronics {
    /// Returns the noise and artefacts of a sensor.
    pub fn of(sensor: Sensor) -> Electronics {
        let none = Electronics::default();
        match sensor {
            Sensor::Ecg => Electronics { noise: 0.008, hum: 0.005, wander: 0.04, shaken: 0.8 },
            Sensor::Ppg => Electronics { noise: 0.005, wander: 0.03, shaken: 5.0, ..none },
            Sensor::EdaWrist | Sensor::EdaFingers => {
                Electronics { noise: 0.001, shaken: 0.3, ..none }
            }
            Sensor::Emg => Electronics { hum: 0.5, ..none },
            Sensor::Eeg => Electronics { hum: 1.0, shaken: 150.0, ..none },
            Sensor::Respiration => Electronics { noise: 0.003, wander: 0.02, shaken: 0.4, ..none },
            Sensor::Temperature => Electronics { noise: 0.005, ..none },
            Sensor::Acceleration => Electronics { noise: 0.004, ..none },
        }
    }
}
