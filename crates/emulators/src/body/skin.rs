//! The skin and its conductance.

use std::collections::VecDeque;
use std::ops::Range;

use super::chance::Chance;
use super::state::State;
use super::step::{STEP_SECS, Step};
use super::traits::Traits;
use crate::noise::{Drift, Noise};

/// The rise of the level with full arousal and with full workload [µS].
const AROUSAL_US: f64 = 2.5;
const WORKLOAD_US: f64 = 1.0;
/// The random drift of the level [µS], and its time constant [s].
const DRIFT_US: f64 = 0.15;
const DRIFT_SECS: f64 = 120.0;
/// The rate of spontaneous responses at rest, and its rise at full workload and at full arousal [1/min].
const REST_PER_MIN: f64 = 2.0;
const WORKLOAD_PER_MIN: f64 = 4.0;
const AROUSAL_PER_MIN: f64 = 4.0;
/// The time constants with which a response rises and falls [s]; it is a Bateman function.
const RISE_SECS: f64 = 0.7;
const FALL_SECS: f64 = 2.0;
/// The variation of the height of responses, as the standard deviation of its logarithm.
const HEIGHT_SIGMA: f64 = 0.5;
/// The delay from an event to its response [s].
const LATENCY_SECS: Range<f64> = 1.5..3.0;
/// The duration of a response [s].
const LAST_SECS: f64 = 20.0;
/// The largest number of responses that are active or pending at once.
const MOST_RESPONSES: usize = 256;

/// A skin conductance response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// When the response begins to rise, after the start [s].
    pub onset_secs: f64,
    /// When the response peaks, unless another one follows before [s].
    pub peak_secs: f64,
    /// The amplitude above the level without the response [µS].
    pub amplitude_us: f64,
    /// The time of the event that evoked it [s]; `None` if it is spontaneous.
    pub event_secs: Option<f64>,
}

/// The skin of a body.
#[derive(Clone, Debug)]
pub struct Skin {
    rest_us: f64,
    response_us: f64,
    drift: Drift,
    chance: Chance,
    noise: Noise,
    answers: Noise,
    level_us: f64,
    until_secs: f64,
    /// Active and pending responses, by their onset.
    responses: VecDeque<Response>,
}

impl Skin {
    /// Creates skin at rest.
    pub fn new(traits: &Traits, mut noise: Noise) -> Skin {
        Skin {
            rest_us: traits.skin_level_us,
            response_us: traits.skin_response_us,
            drift: Drift::new(DRIFT_SECS, noise.fork()),
            chance: Chance::new(noise.fork()),
            answers: noise.fork(),
            noise,
            level_us: traits.skin_level_us,
            until_secs: 0.0,
            responses: VecDeque::new(),
        }
    }

    /// Triggers an event to which the skin responds 1.5 to 3 s later, at a multiple of the usual strength.
    pub fn startle(&mut self, event_secs: f64, strength: f64) {
        let onset_secs = (event_secs + self.answers.uniform(LATENCY_SECS)).max(self.until_secs);
        let median_us = self.response_us * strength;
        let response = Response {
            event_secs: Some(event_secs),
            ..Response::varied(onset_secs, median_us, &mut self.answers)
        };
        self.plan(response);
    }

    /// Advances by one step, and returns the responses that start in it.
    pub fn advance(&mut self, step: Step, state: State) -> impl Iterator<Item = Response> {
        self.until_secs = step.to_secs;
        let raised_us = AROUSAL_US * state.arousal + WORKLOAD_US * state.workload;
        let wandered_us = DRIFT_US * self.drift.after(STEP_SECS);
        self.level_us = (self.rest_us + raised_us + wandered_us).max(0.0);
        let added_per_min = WORKLOAD_PER_MIN * state.workload + AROUSAL_PER_MIN * state.arousal;
        if let Some(onset_secs) = self.chance.within(step, REST_PER_MIN + added_per_min) {
            let response = Response::varied(onset_secs, self.response_us, &mut self.noise);
            self.plan(response);
        }
        let is_over = |response: &Response| step.from_secs > response.onset_secs + LAST_SECS;
        while self.responses.front().is_some_and(is_over) {
            self.responses.pop_front();
        }
        let within = step.from_secs..step.to_secs;
        self.responses.iter().filter(move |each| within.contains(&each.onset_secs)).copied()
    }

    /// The tonic level of skin conductance [µS].
    pub fn level_us(&self) -> f64 {
        self.level_us
    }

    /// The skin conductance at a time of the present step [µS].
    pub fn at(&self, secs: f64) -> f64 {
        self.level_us + self.responses.iter().map(|response| response.at(secs)).sum::<f64>()
    }

    fn plan(&mut self, response: Response) {
        if self.responses.len() < MOST_RESPONSES {
            let is_before = |other: &Response| other.onset_secs <= response.onset_secs;
            self.responses.insert(self.responses.partition_point(is_before), response);
        }
    }
}

impl Response {
    fn varied(onset_secs: f64, median_us: f64, noise: &mut Noise) -> Response {
        let amplitude_us = median_us * (HEIGHT_SIGMA * noise.normal()).exp();
        let peak_secs = onset_secs + peak_secs();
        Response { onset_secs, peak_secs, amplitude_us, event_secs: None }
    }

    fn at(&self, secs: f64) -> f64 {
        if secs <= self.onset_secs {
            return 0.0;
        }
        self.amplitude_us * bateman(secs - self.onset_secs) / bateman(peak_secs())
    }
}

/// The response function: a substance flows into the skin and out of it (Benedek & Kaernbach 2010,
/// doi:10.1016/j.jneumeth.2010.04.028).
fn bateman(secs: f64) -> f64 {
    (-secs / FALL_SECS).exp() - (-secs / RISE_SECS).exp()
}

/// Returns when a Bateman function peaks [s].
fn peak_secs() -> f64 {
    (FALL_SECS / RISE_SECS).ln() * FALL_SECS * RISE_SECS / (FALL_SECS - RISE_SECS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_is_answered_once_from_its_onset_to_its_height() {
        let mut skin = Skin::new(&Traits::of_seed(1), Noise::seeded(1));
        skin.startle(0.0, 5.0);
        let to_event: Vec<Response> = (0..64 * 5)
            .flat_map(|n| skin.advance(Step::nth(n), State::default()).collect::<Vec<_>>())
            .filter(|response| response.event_secs == Some(0.0))
            .collect();
        let [response] = to_event[..] else { panic!("{to_event:?}") };
        assert!(LATENCY_SECS.contains(&response.onset_secs));
        assert_eq!(response.at(response.onset_secs), 0.0);
        assert!((response.at(response.peak_secs) - response.amplitude_us).abs() < 1e-12);
    }
}
