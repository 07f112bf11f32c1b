//! The decision whether a candidate is a beat.

use super::candidates::Candidate;

/// How long the height of beats is learnt before the first is reported [s].
pub(super) const LEARNING_SECS: f64 = 2.0;
/// The cardiac cycle assumed until one is known [s].
pub(super) const FIRST_CYCLE_SECS: f64 = 0.8;
/// The deviation of intervals assumed until one is known [log cycles]: no rhythm is regular.
pub(super) const UNKNOWN_DEVIATION: f64 = 1.0;
/// A candidate is rejected unless a quarter of the time before it is below this share of its height.
const RESTLESS: f64 = 0.4;
/// The same limit before the signal after the candidate is known: fibrillation of the ventricles has less quiet than
/// beats.
const RESTLESS_AT_FIRST: f64 = 0.27;
/// The same limit for candidates similar to beats: at high rates there is little quiet between beats.
const RESTLESS_ALIKE: f64 = 0.6;
/// Before the signal after a candidate is known, [`RESTLESS_ALIKE`] also applies to one that is on time: in full up to
/// the first deviation from the usual interval [log cycles], and not at all from the second on; not at all below the
/// first similarity to beats, and in full above the second.
const ON_TIME: (f64, f64) = (0.15, 0.3);
const ALIKE_ON_TIME: (f64, f64) = (0.7, 0.78);
/// A T wave follows its beat within this time [s] (Pan & Tompkins 1985, doi:10.1109/TBME.1985.325532), and is
/// lower than this share of it.
pub(super) const T_WAVE_SECS: f64 = 0.36;
const T_WAVE_SHARE: f64 = 0.5;
/// Thresholds between the usual height of other deflections (0) and of beats (1): right after a beat, when
/// the next is due, and one cycle later.
const EARLY: f64 = 0.5;
pub(super) const DUE: f64 = 0.35;
const OVERDUE: f64 = 0.2;
/// The threshold is at least this multiple of the highest deflection that usually occurs between two beats (a P or T
/// wave), limited to this share of usual beats. In noise, where the usual height of other deflections exceeds the third
/// share, no wave stands out.
const WAVES: f64 = 1.5;
const MOST_WAVES_SHARE: f64 = 0.8;
const MOST_OTHER_SHARE: f64 = 0.5;
/// Where that wave is low, a candidate in quiet may also be lower: it must exceed this multiple of the wave and this
/// share of usual beats.
const DISTINCT: f64 = 2.5;
const DISTINCT_SHARE: f64 = 0.25;
/// How far `DISTINCT` applies: in full below the first restlessness and the first usual height of other deflections (as
/// a share of beats), and not at all above the second ones.
const DISTINCT_RESTLESS: (f64, f64) = (0.15, 0.25);
const DISTINCT_OTHER: (f64, f64) = (0.1, 0.15);
/// A candidate similar to beats may be lower: its threshold falls from the first similarity on, and is lowest from the
/// second on, at this share.
const ALIKE: (f64, f64) = (0.93, 0.985);
const ALIKE_SHARE: f64 = 0.35;
/// The lower threshold applies only in quiet, in full below the first restlessness and not at all above the second:
/// noise resembles a beat now and then.
const ALIKE_RESTLESS: (f64, f64) = (0.15, 0.3);
/// The threshold of an early candidate unlike beats is higher by up to this share: in full below the first similarity
/// and the first number of cycles after the last beat and above the second restlessness.
const UNLIKE_SHARE: f64 = 0.8;
const UNLIKE: (f64, f64) = (0.83, 0.93);
const EARLY_CYCLES: (f64, f64) = (0.6, 0.8);
const UNLIKE_RESTLESS: (f64, f64) = (0.2, 0.3);
/// In a regular rhythm, the higher threshold applies to more candidates, with the limits below: in full below the first
/// deviation of intervals [log cycles], and not at all above the second.
pub(super) const REGULAR: (f64, f64) = (0.03, 0.08);
const REGULAR_UNLIKE: (f64, f64) = (0.86, 0.96);
const REGULAR_EARLY_CYCLES: (f64, f64) = (0.8, 0.9);
const REGULAR_RESTLESS: (f64, f64) = (0.05, 0.15);
/// Flutter of the ventricles exceeds this product of [breadth](Candidate::breadth) and [swell](Candidate::swell), but
/// hardly any beat does.
const FLUTTER: f64 = 11.0;
/// A candidate higher than this many usual beats is an electrode movement.
const HIGHEST_BEATS: f64 = 8.0;

/// Usual heights and cycle length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Usual {
    /// The usual height of beats.
    pub(super) beat: f64,
    /// The usual height of other deflections.
    pub(super) other: f64,
    /// The usual height of the highest other deflection between two beats; `None` while unknown.
    pub(super) wave: Option<f64>,
    /// The usual interval between beats [s].
    pub(super) cycle_secs: f64,
    /// The median deviation of intervals from the usual one [log cycles].
    pub(super) deviation: f64,
}

impl Usual {
    /// The height that a candidate must exceed at a time after the last beat [s].
    pub(super) fn threshold(&self, secs: f64, restlessness: f64) -> f64 {
        let cycles = secs / self.cycle_secs;
        let share = if cycles < 1.0 {
            EARLY + (DUE - EARLY) * ((cycles - 0.25) / 0.75).max(0.0)
        } else {
            DUE + (OVERDUE - DUE) * (cycles - 1.0).min(1.0)
        };
        let other = self.other.min(self.beat);
        let threshold = other + (self.beat - other) * share;
        let Some(wave) = self.wave.filter(|_| other < MOST_OTHER_SHARE * self.beat) else {
            return threshold;
        };
        let distinct = (DISTINCT * wave).max(DISTINCT_SHARE * self.beat).min(threshold);
        let quiet =
            quiet(restlessness, DISTINCT_RESTLESS) * quiet(other / self.beat, DISTINCT_OTHER);
        let quiet = if secs > T_WAVE_SECS { quiet } else { 0.0 };
        let threshold = threshold + (distinct - threshold) * quiet;
        threshold.max((WAVES * wave).min(MOST_WAVES_SHARE * self.beat))
    }
}

/// Whether a candidate with this similarity to beats is preceded by quiet.
pub(super) fn stands_out(candidate: &Candidate, alike: f64) -> bool {
    unrest(candidate, alike) < 1.0
}

/// The restlessness of a candidate with this similarity to beats, as a multiple of the highest that beats have.
pub(super) fn unrest(candidate: &Candidate, alike: f64) -> f64 {
    candidate.restlessness / if is_alike(alike) { RESTLESS_ALIKE } else { RESTLESS }
}

/// Whether a candidate this many cycles after the last beat is preceded by quiet and unlike flutter, before the signal
/// after it is known.
pub(super) fn stands_out_at_first(candidate: &Candidate, alike: f64, cycles: f64) -> bool {
    let on_time = quiet(cycles.ln().abs(), ON_TIME) * (1.0 - quiet(alike, ALIKE_ON_TIME));
    let most = RESTLESS_AT_FIRST + (RESTLESS_ALIKE - RESTLESS_AT_FIRST) * on_time;
    let most = if is_alike(alike) { RESTLESS_ALIKE } else { most };
    candidate.restlessness <= most && flutter(candidate) <= 1.0
}

/// How much a candidate looks like flutter of the ventricles, as a multiple of the most that beats do.
pub(super) fn flutter(candidate: &Candidate) -> f64 {
    candidate.breadth * candidate.swell / FLUTTER
}

/// The share of its threshold that a candidate with this similarity must exceed.
pub(super) fn share_when_alike(candidate: &Candidate, alike: f64) -> f64 {
    let likeness = ((alike - ALIKE.0) / (ALIKE.1 - ALIKE.0)).clamp(0.0, 1.0);
    1.0 - (1.0 - ALIKE_SHARE) * likeness * quiet(candidate.restlessness, ALIKE_RESTLESS)
}

/// The multiple of its threshold that a candidate must exceed before the signal after it is known: noise is unlike
/// beats, early, and not in quiet.
pub(super) fn share_at_first(
    candidate: &Candidate,
    alike: f64,
    cycles: f64,
    deviation: f64,
) -> f64 {
    let likelihood = |unlike, early, restless| {
        let restless = 1.0 - quiet(candidate.restlessness, restless);
        quiet(alike, unlike) * quiet(cycles, early) * restless
    };
    let in_any_rhythm = likelihood(UNLIKE, EARLY_CYCLES, UNLIKE_RESTLESS);
    let in_a_regular_one = quiet(deviation, REGULAR)
        * likelihood(REGULAR_UNLIKE, REGULAR_EARLY_CYCLES, REGULAR_RESTLESS);
    1.0 + UNLIKE_SHARE * in_any_rhythm.max(in_a_regular_one)
}

/// Falls from 1 at or below the first level to 0 at or above the second.
pub(super) fn quiet(level: f64, (quiet, restless): (f64, f64)) -> f64 {
    let share = ((restless - level) / (restless - quiet)).clamp(0.0, 1.0);
    if share.is_nan() { 0.0 } else { share }
}

/// Whether a similarity is that of a beat.
pub(super) fn is_alike(alike: f64) -> bool {
    alike >= ALIKE.1
}

/// Whether a candidate's waveform is irrelevant: it is higher than beats and in quiet, or far lower than they are.
pub(super) fn is_sure(candidate: &Candidate, usual: &Usual) -> bool {
    let share = candidate.strength / usual.beat;
    (share > 1.0 && candidate.restlessness < RESTLESS) || share < DUE * ALIKE_SHARE
}

/// Whether a candidate is far too high for a beat.
pub(super) fn is_artefact(candidate: &Candidate, usual: &Usual) -> bool {
    usual.beat > 0.0 && candidate.strength > HIGHEST_BEATS * usual.beat
}

/// Whether a candidate looks like the T wave of the beat before it.
pub(super) fn is_t_wave(candidate: &Candidate, before: &Candidate) -> bool {
    candidate.secs - before.secs < T_WAVE_SECS
        && candidate.strength < T_WAVE_SHARE * before.strength
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The height that a beat which is due must exceed.
    fn due(other: f64, wave: f64, restlessness: f64) -> f64 {
        let usual = Usual { beat: 1.0, other, wave: Some(wave), cycle_secs: 0.8, deviation: 0.0 };
        usual.threshold(0.8, restlessness)
    }

    #[test]
    fn a_low_deflection_in_quiet_is_a_beat_unless_p_or_t_waves_are_as_high() {
        assert!(due(0.05, 0.08, 0.1) < 0.3);
        assert!(due(0.05, 0.08, 0.3) > 0.35);
        assert!(due(0.05, 0.5, 0.1) > 0.7);
    }

    #[test]
    fn an_early_deflection_unlike_beats_must_be_higher_unless_it_stands_in_quiet() {
        let share = |restlessness: f64, alike: f64, cycles: f64| {
            let candidate = Candidate { restlessness, ..Candidate::at(0.0, 1.0) };
            share_at_first(&candidate, alike, cycles, 0.2)
        };
        assert!(share(0.35, 0.5, 0.4) > 1.7);
        for (restlessness, alike, cycles) in [(0.1, 0.5, 0.4), (0.35, 0.95, 0.4), (0.35, 0.5, 1.0)]
        {
            assert!((share(restlessness, alike, cycles) - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn in_a_regular_rhythm_a_deflection_unlike_beats_must_be_higher_also_a_little_early() {
        let candidate = Candidate { restlessness: 0.15, ..Candidate::at(0.0, 1.0) };
        let share = |cycles, deviation| share_at_first(&candidate, 0.5, cycles, deviation);
        assert!(share(0.8, 0.02) > 1.7);
        assert!((share(0.8, 0.1) - 1.0).abs() < 1e-9);
        assert!((share(1.0, 0.02) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn broad_waves_without_a_pause_are_no_beats() {
        let wave = |breadth, swell| Candidate { breadth, swell, ..Candidate::at(0.0, 1.0) };
        assert!(stands_out_at_first(&wave(12.0, 0.1), 0.5, 1.0));
        assert!(stands_out_at_first(&wave(1.0, 1.5), 0.5, 1.0));
        assert!(!stands_out_at_first(&wave(12.0, 1.5), 0.5, 1.0));
    }

    #[test]
    fn a_deflection_like_beats_and_on_time_needs_less_quiet_before_it() {
        let candidate = Candidate { restlessness: 0.5, ..Candidate::at(0.0, 1.0) };
        assert!(stands_out_at_first(&candidate, 0.9, 1.1));
        assert!(!stands_out_at_first(&candidate, 0.9, 1.4), "late");
        assert!(!stands_out_at_first(&candidate, 0.6, 1.1), "unlike beats");
    }

    #[test]
    fn noise_as_high_as_beats_raises_no_threshold_above_them() {
        assert!(due(0.6, 0.9, 0.5) < 0.75);
    }
}
