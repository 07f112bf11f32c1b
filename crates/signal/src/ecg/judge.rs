//! Which candidates are beats.

use super::candidates::Candidate;

/// How long the height of beats is learnt before the first one is reported [s].
pub(super) const LEARNING_SECS: f64 = 2.0;
/// The heart cycle that is taken for usual until one is known [s].
pub(super) const FIRST_CYCLE_SECS: f64 = 0.8;
/// A candidate is no beat when a quarter of the time before it is not below this share of it.
const RESTLESS: f64 = 0.4;
/// A T wave comes within this time after its beat [s] (Pan & Tompkins 1985,
/// doi:10.1109/TBME.1985.325532), and is lower than this share of it.
const T_WAVE_SECS: f64 = 0.36;
const T_WAVE_SHARE: f64 = 0.5;
/// Thresholds, from the usual height of what is no beat (0) to that of beats (1): just after a
/// beat, when the next is due, and one cycle later.
const EARLY: f64 = 0.5;
pub(super) const DUE: f64 = 0.35;
const OVERDUE: f64 = 0.2;

/// What is usual.
#[derive(Clone, Copy, Debug)]
pub(super) struct Usual {
    /// Height of beats.
    pub(super) beat: f64,
    /// Height of everything else.
    pub(super) other: f64,
    /// Time from beat to beat [s].
    pub(super) cycle_secs: f64,
}

impl Usual {
    /// The height that a beat must surpass so long after another one.
    pub(super) fn threshold(&self, secs: f64) -> f64 {
        let cycles = secs / self.cycle_secs;
        let share = if cycles < 1.0 {
            EARLY + (DUE - EARLY) * ((cycles - 0.25) / 0.75).max(0.0)
        } else {
            DUE + (OVERDUE - DUE) * (cycles - 1.0).min(1.0)
        };
        let other = self.other.min(self.beat);
        other + (self.beat - other) * share
    }
}

/// Whether a candidate stands out of quiet.
pub(super) fn stands_out(candidate: &Candidate) -> bool {
    candidate.restlessness < RESTLESS
}

/// Whether a candidate looks like the T wave of the beat before it.
pub(super) fn is_t_wave(candidate: &Candidate, before: &Candidate) -> bool {
    candidate.secs - before.secs < T_WAVE_SECS
        && candidate.strength < T_WAVE_SHARE * before.strength
}
