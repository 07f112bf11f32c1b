//! Which candidates are pulses.

use super::blocks::Candidate;
use crate::recent::Recent;

/// No two pulses follow faster [s]: 220 a minute.
pub(super) const REFRACTORY_SECS: f64 = 0.27;
/// The diastolic wave comes within this time [s], and share of a cycle, after the systolic peak, and
/// is lower than this share of it, and narrow.
const DIASTOLIC_SECS: f64 = 0.55;
const DIASTOLIC_CYCLES: f64 = 0.7;
const DIASTOLIC_SHARE: f64 = 0.5;
/// What is lower than this share of usual pulses is noise.
const LEAST_SHARE: f64 = 0.15;
/// After so long without a pulse [s], what is usual is learnt anew.
pub(super) const SILENCE_SECS: f64 = 3.0;
/// The cycle that is taken for usual until one is known [s].
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

/// Whether a candidate is far lower than pulses use to be.
pub(super) fn is_noise(height: f64, usual: f64) -> bool {
    height < LEAST_SHARE * usual
}

/// Judges candidates in their order by the pulses before them.
#[derive(Clone, Debug)]
pub(super) struct Judge {
    rate_hz: f64,
    heights: Recent,
    cycles_secs: Recent,
    last: Option<Candidate>,
}

impl Judge {
    pub(super) fn new(rate_hz: f64) -> Judge {
        let (heights, cycles_secs) = (Recent::default(), Recent::default());
        Judge { rate_hz, heights, cycles_secs, last: None }
    }

    /// Takes in the next candidate; whether it is a pulse.
    pub(super) fn take(&mut self, candidate: Candidate) -> bool {
        let Some(last) = self.last else { return self.accept(candidate) };
        let secs = (candidate.place - last.place) as f64 / self.rate_hz;
        if secs > SILENCE_SECS {
            (self.heights, self.cycles_secs) = (Recent::default(), Recent::default());
            return self.accept(candidate);
        }
        let cycle_secs = self.cycles_secs.median().unwrap_or(FIRST_CYCLE_SECS);
        let usual = self.heights.median().unwrap_or(0.0);
        let is_pulse = secs >= REFRACTORY_SECS
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
