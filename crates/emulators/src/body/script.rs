//! The script of faults: which sensor fails, how and when.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::Deserialize;

use super::sensor::Sensor;
use crate::noise::Noise;

/// The frequency of the mains [Hz].
const MAINS_HZ: f64 = 50.0;
/// The temperature around the body [°C], and the time constant with which a sensor approaches it [s].
const AMBIENT_C: f64 = 22.0;
const AMBIENT_SECS: f64 = 60.0;

/// One entry of the script: a fault that lasts for a while.
#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// The sensor that fails; by default all. Ignored for movement, which affects all sensors.
    pub sensor: Option<Sensor>,
    /// When the fault begins, after the start [s]. Default: 0.
    #[serde(default)]
    pub from_secs: f64,
    /// When the fault ends, after the start [s]; by default never.
    pub to_secs: Option<f64>,
    /// The fault.
    pub what: Fault,
}

/// A fault of a sensor.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// The sensor gives no samples.
    Dead,
    /// The values stay unchanged.
    Stuck,
    /// The sensor is off the body: noise and hum instead of the body's signal.
    OffBody,
    /// The body moves with this strength [g]: the accelerometer measures it, the other sensors have artefacts.
    MovementG(f64),
    /// Mains hum with this amplitude (in the sensor's unit).
    MainsHum(f64),
    /// White noise like that of muscles (RMS, in the sensor's unit).
    MuscleNoise(f64),
    /// The amplifier saturates at this value to either side, in the sensor's unit.
    Saturated(f64),
}

impl Scene {
    fn is_playing(&self, secs: f64) -> bool {
        (self.from_secs..self.to_secs.unwrap_or(f64::INFINITY)).contains(&secs)
    }
}

/// Returns the strength of the body's movement at a time, from the script [g].
pub fn movement_g(scenes: &[Scene], secs: f64) -> f64 {
    let playing = scenes.iter().filter(|scene| scene.is_playing(secs));
    let strengths = playing.filter_map(|scene| match scene.what {
        Fault::MovementG(strength_g) if strength_g.is_finite() => Some(strength_g),
        _ => None,
    });
    strengths.fold(0.0, f64::max)
}

/// The contact between a body and one of its sensors, which affects the samples.
#[derive(Clone, Debug)]
pub struct Contact {
    sensor: Sensor,
    scenes: Vec<Scene>,
    held: Vec<f64>,
    noise: Noise,
}

impl Contact {
    /// Creates the contact of a sensor according to the script.
    pub fn new(sensor: Sensor, script: &[Scene], noise: Noise) -> Contact {
        let concerns = |scene: &&Scene| scene.sensor.is_none_or(|only| only == sensor);
        let scenes = script.iter().filter(concerns).cloned().collect();
        Contact { sensor, scenes, held: vec![0.0; sensor.channels().len()], noise }
    }

    /// Whether the script has any faults.
    pub fn has_script(&self) -> bool {
        !self.scenes.is_empty()
    }

    /// Applies the script to one sample of all channels; NaN is a missing sample.
    pub fn disturb(&mut self, secs: f64, sample: &mut [f64]) {
        if let Some(from_secs) = self.since(secs, Fault::OffBody) {
            self.take_off(secs - from_secs, sample);
        }
        let (hum, noise, limit) = self.strengths(secs);
        if hum > 0.0 || noise > 0.0 {
            let hum = hum * (TAU * MAINS_HZ * secs).sin();
            for value in sample.iter_mut() {
                *value += hum + noise * self.noise.normal();
            }
        }
        for value in sample.iter_mut() {
            *value = value.clamp(-limit, limit);
        }
        if self.since(secs, Fault::Stuck).is_some() {
            sample.copy_from_slice(&self.held);
        } else {
            self.held.copy_from_slice(sample);
        }
        if self.since(secs, Fault::Dead).is_some() {
            sample.fill(f64::NAN);
        }
    }

    fn since(&self, secs: f64, what: Fault) -> Option<f64> {
        let mut playing = self.scenes.iter().filter(|scene| scene.is_playing(secs));
        playing.find(|scene| scene.what == what).map(|scene| scene.from_secs)
    }

    /// Returns the hum, noise and limit at a time.
    fn strengths(&self, secs: f64) -> (f64, f64, f64) {
        let (mut hum, mut noise, mut limit) = (0.0, 0.0, f64::INFINITY);
        for scene in self.scenes.iter().filter(|scene| scene.is_playing(secs)) {
            match scene.what {
                Fault::MainsHum(height) if height.is_finite() => hum += height,
                Fault::MuscleNoise(rms) if rms.is_finite() => noise += rms,
                Fault::Saturated(most) if most >= 0.0 => limit = f64::min(limit, most),
                _ => {}
            }
        }
        (hum, noise, limit)
    }

    /// Replaces a sample with that of a sensor that has been off the body for a while.
    fn take_off(&mut self, since_secs: f64, sample: &mut [f64]) {
        let noise = &mut self.noise;
        let mut all = |level: f64, rms: f64| {
            for value in sample.iter_mut() {
                *value = level + rms * noise.normal();
            }
        };
        match self.sensor {
            Sensor::Ecg => all(0.0, 0.2),
            Sensor::Ppg => all(0.0, 0.02),
            Sensor::EdaWrist | Sensor::EdaFingers => all(0.0, 0.001),
            Sensor::Emg => all(0.0, 3.0),
            Sensor::Eeg => all(0.0, 150.0),
            Sensor::Respiration => all(0.0, 0.003),
            Sensor::Temperature => {
                let kept = (-since_secs / AMBIENT_SECS).exp();
                for value in sample.iter_mut() {
                    *value = AMBIENT_C + (*value - AMBIENT_C) * kept;
                }
            }
            Sensor::Acceleration => {
                all(0.0, 0.004);
                sample[2] += 1.0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contact(what: Fault) -> Contact {
        let scene = Scene { sensor: Some(Sensor::Ecg), from_secs: 1.0, to_secs: Some(2.0), what };
        Contact::new(Sensor::Ecg, &[scene], Noise::seeded(1))
    }

    fn after(contact: &mut Contact, secs: f64, value: f64) -> f64 {
        let mut sample = [value];
        contact.disturb(secs, &mut sample);
        sample[0]
    }

    #[test]
    fn a_fault_lasts_from_its_begin_to_before_its_end() {
        let mut stuck = contact(Fault::Stuck);
        let given = [0.5, 1.0, 1.9, 2.0].map(|secs| after(&mut stuck, secs, secs));
        assert_eq!(given, [0.5, 0.5, 0.5, 2.0]);
    }

    #[test]
    fn what_is_saturated_stays_within_and_what_is_dead_gives_nothing() {
        assert_eq!(after(&mut contact(Fault::Saturated(0.3)), 1.5, -7.0), -0.3);
        assert!(after(&mut contact(Fault::Dead), 1.5, -7.0).is_nan());
        assert_eq!(after(&mut contact(Fault::Dead), 2.5, -7.0), -7.0);
    }

    #[test]
    fn a_script_is_read_from_a_study() {
        let scene: Scene = toml::from_str(
            r#"sensor = "eda_wrist"
               to_secs = 3
               what = { mains_hum = 0.2 }"#,
        )
        .unwrap();
        assert_eq!(scene.sensor, Some(Sensor::EdaWrist));
        assert_eq!(scene.what, Fault::MainsHum(0.2));
    }
}
