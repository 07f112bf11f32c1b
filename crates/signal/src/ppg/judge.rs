//! The decision whether a candidate is a pulse.

use super::blocks::Candidate;
use crate::recent::Recent;

/// The shortest interval between pulses [s]: at most 255 pulses a minute if the usual cycle is shorter than
/// `SHORT_CYCLE_SECS`, otherwise 220.
pub(super) const REFRACTORY_SECS: f64 = 0.235;
const USUAL_REFRACTORY_SECS: f64 = 0.27;
const SHORT_CYCLE_SECS: f64 = 0.33;

/// The shortest interval between pulses [s], given the usual cycle [s].
pub(super) fn refractory_secs(cycle_secs: f64) -> f64 {
    if cycle_secs < SHORT_CYCLE_SECS { REFRACTORY_SECS } else { USUAL_REFRACTORY_SECS }
}

/// The diastolic wave follows the systolic peak within this time [s] and share of a cycle, is lower than this share of
/// the peak, and narrow.
const DIASTOLIC_SECS: f64 = 0.55;
const DIASTOLIC_CYCLES: f64 = 0.7;
const DIASTOLIC_SHARE: f64 = 0.5;
/// A candidate below this share of usual pulses is noise.
const LEAST_SHARE: f64 = 0.15;
/// The time without a pulse after which usual values are relearnt [s].
pub(super) const SILENCE_SECS: f64 = 3.0;
/// The cycle assumed until one is known [s].
const FIRST_CYCLE_SECS: f64 = 0.8;

/// Whether a candidate looks like the diastolic wave of the pulse before it.
pub(super) fn is_diastolic(
    candidate: &Candidate,
    before: &Candidate,
    secs: f64,
    cycle_secs: f64,
) -> bool {
    !candidate.is_broad
        && secs < DIASTOLIC_SECS.min(DIASTOLIC_CYCLES * cycle_secs)
        && candidate.height < DIASTOLIC_SHARE * before.height
}

/// Whether a candidate is far lower than usual pulses.
pub(super) fn is_noise(height: f64, usual: f64) -> bool {
    height < LEAST_SHARE * usual
}

/// A diastolic wave follows the systolic peak within this time at any rate [s], which is shorter than the time to the
/// next pulse by this factor, and is lower than this share of the peak.
const SECOND_WAVE_SECS: f64 = 0.47;
const SECOND_WAVE_EARLIER: f64 = 1.1;
const SECOND_WAVE_SHARE: f64 = 0.93;

/// Recognises alternating high and low candidates, each low candidate soon after a high one: pulses with strong
/// diastolic waves.
#[derive(Clone, Debug)]
pub(super) struct Turns {
    rate_hz: f64,
    /// The positions and heights of the newest candidates, oldest first.
    newest: [(i64, f64); 5],
    count: usize,
}

impl Turns {
    pub(super) fn new(rate_hz: f64) -> Turns {
        Turns { rate_hz, newest: [(0, 0.0); 5], count: 0 }
    }

    /// Takes in the next candidate; returns whether it is the second wave of a pulse, like the last low one.
    pub(super) fn take(&mut self, candidate: &Candidate) -> bool {
        self.newest.rotate_left(1);
        self.newest[4] = (candidate.place, candidate.height);
        self.count = (self.count + 1).min(5);
        self.count == 5 && self.is_low(4) && self.is_low(2)
    }

    fn is_low(&self, index: usize) -> bool {
        let [before, high, low] = [index - 2, index - 1, index].map(|index| self.newest[index]);
        let secs = (low.0 - high.0) as f64 / self.rate_hz;
        let until_high = (high.0 - before.0) as f64 / self.rate_hz;
        secs <= SECOND_WAVE_SECS
            && until_high >= SECOND_WAVE_EARLIER * secs
            && low.1 < SECOND_WAVE_SHARE * high.1
            && before.1 < SECOND_WAVE_SHARE * high.1
    }
}

/// Judges candidates in order by the pulses before them.
#[derive(Clone, Debug)]
pub(super) struct Judge {
    rate_hz: f64,
    heights: Recent,
    cycles_secs: Recent,
    last: Option<Candidate>,
    turns: Turns,
}

impl Judge {
    pub(super) fn new(rate_hz: f64) -> Judge {
        let (heights, cycles_secs) = (Recent::default(), Recent::default());
        Judge { rate_hz, heights, cycles_secs, last: None, turns: Turns::new(rate_hz) }
    }

    /// Takes in the next candidate; returns whether it is a pulse.
    pub(super) fn take(&mut self, candidate: Candidate) -> bool {
        let is_second = self.turns.take(&candidate);
        let Some(last) = self.last else { return self.accept(candidate) };
        let secs = (candidate.place - last.place) as f64 / self.rate_hz;
        if secs > SILENCE_SECS {
            (self.heights, self.cycles_secs) = (Recent::default(), Recent::default());
            return self.accept(candidate);
        }
        let known_secs = self.cycles_secs.median();
        let cycle_secs = known_secs.unwrap_or(FIRST_CYCLE_SECS);
        let usual = self.heights.median().unwrap_or(0.0);
        let is_pulse = secs >= refractory_secs(known_secs.unwrap_or(0.0))
            && !is_second
            && !is_diastolic(&candidate, &last, secs, cycle_secs)
            && !is_noise(candidate.height, usual);
        if is_pulse {
            self.cycles_secs.push(secs);
        }
        is_pulse && self.accept(candidate)
    }

    fn accept(&mut self, candidate: Candidate) -> bool {
        self.heights.push(candidate.height);
        self.last = Some(candidate);
        true
    }
}
