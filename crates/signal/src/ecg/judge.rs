//! The decision whether a candidate is a beat.

use super::candidates::Candidate;

/// How long the height of beats is learnt before the first is reported [s].
pub(super) const LEARNING_SECS: f64 = 2.0;
/// The cardiac cycle assumed until one is known [s].
pub(super) const FIRST_CYCLE_SECS: f64 = 0.8;
/// A candidate is rejected unless a quarter of the time before it is below this share of its height.
const RESTLESS: f64 = 0.4;
/// The same for candidates similar to beats: at high rates there is little quiet between beats.
const RESTLESS_ALIKE: f64 = 0.6;
/// A T wave follows its beat within this time [s] (Pan & Tompkins 1985, doi:10.1109/TBME.1985.325532), and is
/// lower than this share of it.
const T_WAVE_SECS: f64 = 0.36;
const T_WAVE_SHARE: f64 = 0.5;
/// Thresholds between the usual height of other deflections (0) and of beats (1): right after a beat, when
/// the next is due, and one cycle later.
const EARLY: f64 = 0.5;
pub(super) const DUE: f64 = 0.35;
const OVERDUE: f64 = 0.2;
/// A candidate similar to beats may be lower: from the first similarity on its threshold falls, and reaches
/// its lowest share at the second.
const ALIKE: (f64, f64) = (0.93, 0.985);
const ALIKE_SHARE: f64 = 0.35;
/// … only where it is quiet: noise resembles a beat now and then.
const ALIKE_RESTLESS: (f64, f64) = (0.15, 0.3);
/// A candidate higher than this many usual beats is an electrode movement.
const HIGHEST_BEATS: f64 = 8.0;

/// Usual heights and cycle length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Usual {
    /// The usual height of beats.
    pub(super) beat: f64,
    /// The usual height of other deflections.
    pub(super) other: f64,
    /// The usual interval between beats [s].
    pub(super) cycle_secs: f64,
}

impl Usual {
    /// The height that a candidate must exceed at a time after the last beat [s].
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

/// Whether a candidate with this similarity to beats is preceded by quiet.
pub(super) fn stands_out(candidate: &Candidate, alike: f64) -> bool {
    let most = if is_alike(alike) { RESTLESS_ALIKE } else { RESTLESS };
    candidate.restlessness < most
}

/// The share of its threshold that a candidate with this similarity must exceed.
pub(super) fn share_when_alike(candidate: &Candidate, alike: f64) -> f64 {
    let likeness = ((alike - ALIKE.0) / (ALIKE.1 - ALIKE.0)).clamp(0.0, 1.0);
    let (quiet, restless) = ALIKE_RESTLESS;
    let quiet = ((restless - candidate.restlessness) / (restless - quiet)).clamp(0.0, 1.0);
    1.0 - (1.0 - ALIKE_SHARE) * if quiet.is_nan() { 0.0 } else { likeness * quiet }
}

/// Whether a similarity is that of a beat.
pub(super) fn is_alike(alike: f64) -> bool {
    alike >= ALIKE.1
}

/// Whether its waveform is irrelevant: it is as high as beats and in quiet, or far lower.
pub(super) fn is_sure(candidate: &Candidate, usual: &Usual) -> bool {
    let share = candidate.strength / usual.beat;
    (share > 1.0 && candidate.restlessness < RESTLESS) || share < DUE * ALIKE_SHARE
}

/// Whether it is far too high for a beat.
pub(super) fn is_artefact(candidate: &Candidate, usual: &Usual) -> bool {
    usual.beat > 0.0 && candidate.strength > HIGHEST_BEATS * usual.beat
}

/// Whether a candidate looks like the T wave of the beat before it.
pub(super) fn is_t_wave(candidate: &Candidate, before: &Candidate) -> bool {
    candidate.secs - before.secs < T_WAVE_SECS
        && candidate.strength < T_WAVE_SHARE * before.strength
}
