//! A simulated body that wears devices.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use super::Wearer;
use crate::body::{STEP_SECS, Sensor};
use crate::task::Operator;

/// How long samples and beats are kept for a device that requests them late \[s\].
const KEPT_SECS: f64 = 10.0;
/// The rounding error allowed in the number of a sample.
const ROUNDING: f64 = 1e-6;
/// The share of light that a resting finger transmits, and how much of it a usual pulse absorbs.
const LIGHT: f64 = 0.5;
const LIGHT_OF_PULSE: f64 = 0.15;

/// A simulated person with devices on the body; clones share the body.
///
/// The body is simulated up to the latest time that any device has requested. A device that requests an earlier time
/// within the last ten seconds gets the values of that time. The ECG is interpolated between its samples; any other
/// sensor has the value of its last sample. One microvolt of a muscle is one step of an armband.
#[derive(Clone, Debug)]
pub struct BodyWearer {
    body: Arc<Mutex<WornBody>>,
    skin: Sensor,
}

impl BodyWearer {
    /// Creates a person at the start of a task, with devices at the fingers.
    pub fn new(operator: Operator) -> Self {
        Self { body: Arc::new(Mutex::new(WornBody::new(operator))), skin: Sensor::EdaFingers }
    }

    /// Returns the same person, with the device at the wrist.
    #[must_use]
    pub fn at_wrist(&self) -> Self {
        Self { body: Arc::clone(&self.body), skin: Sensor::EdaWrist }
    }

    fn with<T>(&self, look: impl FnOnce(&mut WornBody) -> T) -> T {
        look(&mut self.body.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Returns the channels of a sensor; zeros if it isn't worn or has no value.
    fn sense<const N: usize>(&self, sensor: Sensor, secs: f64) -> [f64; N] {
        self.with(|body| body.sense(sensor, secs)).unwrap_or([0.0; N])
    }
}

impl Wearer for BodyWearer {
    fn ecg_uv(&mut self, secs: f64) -> f64 {
        let millivolts = self.with(|body| body.ecg_mv(secs)).unwrap_or(0.0);
        millivolts * 1e3
    }

    fn acceleration_mg(&mut self, secs: f64) -> [f64; 3] {
        self.sense(Sensor::Acceleration, secs).map(|g: f64| g * 1e3)
    }

    fn light(&mut self, secs: f64) -> f64 {
        let [pulse] = self.sense(Sensor::Ppg, secs);
        (LIGHT + LIGHT_OF_PULSE * pulse).clamp(0.0, 1.0)
    }

    fn conductance_us(&mut self, secs: f64) -> f64 {
        let [conductance_us] = self.sense(self.skin, secs);
        conductance_us
    }

    fn temperature_c(&mut self, secs: f64) -> f64 {
        let [temperature_c] = self.sense(Sensor::Temperature, secs);
        temperature_c
    }

    fn muscles(&mut self, secs: f64) -> [f64; 8] {
        self.sense(Sensor::Emg, secs).map(|microvolts: f64| microvolts.round().clamp(-128.0, 127.0))
    }

    fn beats(&mut self, after_secs: f64, until_secs: f64) -> Vec<f64> {
        self.with(|body| body.beats(after_secs, until_secs))
    }
}

#[derive(Debug)]
struct WornBody {
    operator: Operator,
    history: [History; Sensor::ALL.len()],
    beats: VecDeque<f64>,
}

/// The last samples of a sensor.
#[derive(Debug, Default)]
struct History {
    rate_hz: f64,
    /// The number of the first sample that is kept.
    first: u64,
    samples: VecDeque<f64>,
}

impl WornBody {
    fn new(operator: Operator) -> Self {
        Self {
            operator,
            history: std::array::from_fn(|_| History::default()),
            beats: VecDeque::new(),
        }
    }

    /// Simulates the body to just after a time.
    fn live(&mut self, secs: f64) {
        let record = self.operator.until(secs + STEP_SECS).record;
        for (history, wave) in self.history.iter_mut().zip(record.waves()) {
            history.rate_hz = wave.rate_hz;
            history.keep(&wave.samples, wave.sensor.channels().len());
        }
        self.beats.extend(record.truth.beats.iter().map(|beat| beat.secs));
        let since_secs = self.operator.secs() - KEPT_SECS;
        self.beats.drain(..self.beats.partition_point(|beat_secs| *beat_secs < since_secs));
    }

    fn sense<const N: usize>(&mut self, sensor: Sensor, secs: f64) -> Option<[f64; N]> {
        self.live(secs);
        let history = self.history.get(sensor as usize)?;
        let number = (secs * history.rate_hz + ROUNDING).floor() as u64;
        let at = usize::try_from(number.saturating_sub(history.first)).ok()?.checked_mul(N)?;
        let at = at.min(history.samples.len().checked_sub(N)?);
        let sample: Vec<f64> = history.samples.iter().skip(at).take(N).copied().collect();
        let sample = <[f64; N]>::try_from(sample).ok()?;
        sample.iter().all(|value| value.is_finite()).then_some(sample)
    }

    /// The ECG at a time, interpolated: holding the last sample would delay R waves by up to a sample.
    fn ecg_mv(&mut self, secs: f64) -> Option<f64> {
        let [before] = self.sense(Sensor::Ecg, secs)?;
        let history = self.history.get(Sensor::Ecg as usize)?;
        let place = secs * history.rate_hz;
        let number = (place + ROUNDING).floor();
        let next = usize::try_from((number as u64 + 1).saturating_sub(history.first)).ok()?;
        let after = history.samples.get(next).copied().filter(|after| after.is_finite());
        let share = (place - number).max(0.0);
        Some(after.map_or(before, |after| before + share * (after - before)))
    }

    fn beats(&mut self, after_secs: f64, until_secs: f64) -> Vec<f64> {
        self.live(until_secs);
        let asked = |beat_secs: &f64| *beat_secs > after_secs && *beat_secs <= until_secs;
        self.beats.iter().copied().filter(asked).collect()
    }
}

impl History {
    fn keep(&mut self, samples: &[f64], channels: usize) {
        self.samples.extend(samples);
        let most = (self.rate_hz * KEPT_SECS).ceil() as usize + 1;
        let over = (self.samples.len() / channels).saturating_sub(most);
        self.samples.drain(..over * channels);
        self.first += over as u64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Body, Rates, Settings, Traits};
    use crate::task::{Plan, Skill, Task};

    fn operator(rates: Rates) -> Operator {
        let settings = Settings { rates, script: Vec::new() };
        let body = Body::wearing(&Traits::of_seed(3), 3, &settings).expect("usual rates");
        Operator::new(body, Task::new(Plan::default(), Skill::of_seed(3), 3))
    }

    #[test]
    fn what_devices_sense_is_what_the_body_recorded() {
        let mut truth = operator(Rates::default());
        let record = truth.until(20.0).record;
        let mut fingers = BodyWearer::new(operator(Rates::default()));
        let mut wrist = fingers.at_wrist();
        for second in 0..20_u32 {
            let secs = f64::from(second);
            let sample = |sensor: Sensor, channel| {
                let wave = record.wave(sensor);
                wave.channel(channel).nth((secs * wave.rate_hz) as usize).expect("was recorded")
            };
            assert_eq!(fingers.ecg_uv(secs), sample(Sensor::Ecg, 0) * 1e3);
            assert_eq!(fingers.conductance_us(secs), sample(Sensor::EdaFingers, 0));
            assert_eq!(wrist.conductance_us(secs), sample(Sensor::EdaWrist, 0));
            assert_eq!(wrist.temperature_c(secs), sample(Sensor::Temperature, 0));
            assert_eq!(wrist.acceleration_mg(secs)[2], sample(Sensor::Acceleration, 2) * 1e3);
            assert_eq!(wrist.muscles(secs)[7], sample(Sensor::Emg, 7).round().clamp(-128.0, 127.0));
            assert!((0.01..0.99).contains(&wrist.light(secs)));
        }
    }

    #[test]
    fn an_ecg_between_two_samples_is_between_their_values() {
        let mut wearer = BodyWearer::new(operator(Rates::default()));
        for number in 200..800_u32 {
            let secs = f64::from(number) / 130.0;
            let [before, after] = [secs, secs + 1.0 / 130.0].map(|secs| wearer.ecg_uv(secs));
            let between = wearer.ecg_uv(secs + 0.25 / 130.0);
            assert!((between - (0.75 * before + 0.25 * after)).abs() < 1e-3, "{number}");
        }
    }

    #[test]
    fn every_beat_arrives_once_at_its_true_time_whoever_lived_ahead() {
        let mut truth = operator(Rates::NONE);
        let beats = truth.until(30.0).record.truth.beats.iter().map(|beat| beat.secs);
        let beats: Vec<f64> = beats.filter(|beat_secs| *beat_secs <= 29.0).collect();
        let mut wearer = BodyWearer::new(operator(Rates::NONE));
        let mut ahead = wearer.clone();
        let mut heard = Vec::new();
        for tenth in 0..290_u32 {
            let secs = f64::from(tenth) / 10.0;
            ahead.ecg_uv(secs + 1.0);
            heard.extend(wearer.beats(secs, f64::from(tenth + 1) / 10.0));
        }
        assert_eq!(heard, beats);
    }

    #[test]
    fn the_past_can_be_asked_for_and_a_sensor_that_is_not_worn_has_no_value() {
        let rates = Rates { temperature_hz: 0.0, ..Rates::default() };
        let mut wearer = BodyWearer::new(operator(rates));
        let then = wearer.conductance_us(5.0);
        wearer.conductance_us(12.0);
        assert_eq!(wearer.conductance_us(5.0), then);
        assert_eq!(wearer.temperature_c(5.0), 0.0);
    }
}
