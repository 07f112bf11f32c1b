//! Causal beat detection.

use std::collections::VecDeque;

use super::beat::{Beat, Found};
use super::both_sides;
use super::candidates::{Candidate, Candidates};
use super::deflections::Deflections;
use super::judge::{
    FIRST_CYCLE_SECS, LEARNING_SECS, REGULAR, UNKNOWN_DEVIATION, Usual, flutter, is_alike,
    is_artefact, is_t_wave, quiet, share_at_first, share_when_alike, stands_out,
    stands_out_at_first,
};
use super::recent::{MEMORY, Recent};
use super::shape::{Shape, alike};
use crate::error::SignalError;

/// The time after which a maximum of the envelope is known to remain the highest [s]. (The main deflection of one beat
/// in a hundred precedes it by more than 35 ms.)
const LATENCY_SECS: f64 = 0.213;
/// The refractory period of the ventricles [s]. (Short, so that a P wave taken for a beat does not hide the
/// QRS complex after it.)
const REFRACTORY_SECS: f64 = 0.16;
/// If two candidates are closer than this [s] and the second is higher, the first was a P wave.
const P_WAVE_SECS: f64 = 0.25;
/// A beat counts as missing after this many cycles, in a regular rhythm after fewer; it is then searched for among the
/// candidates after this share of a cycle (Pan & Tompkins 1985, doi:10.1109/TBME.1985.325532, search after 1.66
/// cycles).
const MISSED_CYCLES: f64 = 1.45;
const MISSED_CYCLES_IF_REGULAR: f64 = 1.3;
const EARLIEST_CYCLES: f64 = 0.35;
/// The share of the threshold that a missed beat must exceed.
const SEARCH_BACK_SHARE: f64 = 0.8;
/// The largest restlessness before a missed beat, however quiet it is after the beat.
const MOST_RESTLESS: f64 = 0.5;
/// The largest resemblance of a missed beat to flutter, as a multiple of the largest that beats have.
const MOST_FLUTTER: f64 = 2.0;
/// The time without a beat after which the height of beats is relearnt [s].
const SILENCE_SECS: f64 = 8.0;
/// The shorter time [s] that applies if the height was learnt from fewer beats than `TRIED_BEATS`.
const SHORT_SILENCE_SECS: f64 = 3.0;
const TRIED_BEATS: usize = 6;
/// After this many artefacts in a row, beats are taken to have become higher.
const MOST_ARTEFACTS: usize = 4;
/// Beats closer than this [s] come at the time of T waves.
const FAST_SECS: f64 = 0.42;
/// The initial height of beats, as a share of the highest candidate.
const FIRST_SHARE: f64 = 0.8;
/// The longest interval between successive beats [s].
const LONGEST_SECS: f64 = 3.0;
/// The number of rejected candidates kept for the search back.
const MOST_PASSED: usize = 128;

/// Detects beats in an ECG sample by sample.
///
/// Half of the beats are reported within 220 ms of data time and 99 of 100 within 250 ms, except those [found
/// later](Found::Later): in the first two seconds, or because a beat was missing. The output is bit-identical
/// for any chunking, and no sample allocates. Samples that are not [usable numbers](crate::gaps::is_usable)
/// are bridged; intervals across long gaps are not learnt from.
#[derive(Clone, Debug)]
pub struct BeatDetector {
    candidates: Candidates,
    learning_until_secs: Option<f64>,
    is_learning: bool,
    beats: Recent,
    others: Deflections,
    /// The highest other deflection of each of the newest cycles.
    waves: Deflections,
    /// The waveforms of the newest beats.
    shapes: [Shape; MEMORY],
    accepted: usize,
    /// The number of artefacts since the last beat.
    artefacts: usize,
    cycles_secs: Recent,
    last: Option<Candidate>,
    /// The beat before the last one, if the interval between them is the newest cycle.
    before: Option<Candidate>,
    quiet_since_secs: f64,
    passed: VecDeque<Candidate>,
    /// Beats that were found together with another one and wait to be returned.
    found: VecDeque<(Candidate, Found)>,
}

impl BeatDetector {
    /// Creates a detector for samples at 80 to 4000 Hz, in any unit and of either polarity.
    ///
    /// Returns an error for another rate.
    pub fn new(rate_hz: f64) -> Result<BeatDetector, SignalError> {
        Ok(BeatDetector::over(Candidates::new(rate_hz, LATENCY_SECS)?))
    }

    pub(super) fn over(candidates: Candidates) -> BeatDetector {
        BeatDetector {
            candidates,
            learning_until_secs: None,
            is_learning: true,
            beats: Recent::default(),
            others: Deflections::default(),
            waves: Deflections::default(),
            shapes: [Shape::NONE; MEMORY],
            accepted: 0,
            artefacts: 0,
            cycles_secs: Recent::default(),
            last: None,
            before: None,
            quiet_since_secs: 0.0,
            passed: VecDeque::with_capacity(MOST_PASSED + 1),
            found: VecDeque::with_capacity(MOST_PASSED + 1),
        }
    }

    /// Takes in the next sample, and returns a beat if one became known.
    ///
    /// Beats that become known together are returned one per sample, in order.
    pub fn push(&mut self, sample: f64) -> Option<Beat> {
        if let Some(candidate) = self.candidates.push(sample) {
            self.take(candidate);
        }
        self.next_found().map(|(candidate, found)| candidate.beat(found))
    }

    pub(super) fn next_found(&mut self) -> Option<(Candidate, Found)> {
        self.found.pop_front()
    }

    pub(super) fn take(&mut self, candidate: Candidate) {
        if candidate.after_gap {
            self.forget_rhythm(candidate.secs);
        }
        if !self.is_learning && candidate.secs - self.quiet_since_secs > self.silence_secs() {
            self.forget_height();
        }
        if self.is_learning {
            self.learn(candidate);
            return;
        }
        while self.search_back(&candidate) {}
        self.judge(candidate, Found::InTime);
    }

    /// The silence that triggers relearning [s]; shorter after few beats, which may have been artefacts.
    fn silence_secs(&self) -> f64 {
        if self.accepted < TRIED_BEATS { SHORT_SILENCE_SECS } else { SILENCE_SECS }
    }

    fn forget_rhythm(&mut self, secs: f64) {
        (self.last, self.before) = (None, None);
        self.quiet_since_secs = secs;
        if !self.is_learning {
            self.passed.clear();
        }
    }

    fn forget_height(&mut self) {
        (self.last, self.before) = (None, None);
        self.beats = Recent::default();
        self.others = Deflections::default();
        self.waves = Deflections::default();
        self.shapes = [Shape::NONE; MEMORY];
        (self.accepted, self.artefacts) = (0, 0);
        self.passed.clear();
        self.is_learning = true;
        self.learning_until_secs = None;
    }

    fn learn(&mut self, candidate: Candidate) {
        let until = self.learning_until_secs.get_or_insert(candidate.secs + LEARNING_SECS);
        let is_learnt = candidate.secs >= *until;
        self.pass(candidate);
        if !is_learnt {
            return;
        }
        let highest = self.passed.iter().filter(|candidate| stands_out(candidate, 0.0));
        let highest = highest.map(|candidate| candidate.strength).fold(0.0, f64::max);
        self.is_learning = highest <= 0.0;
        self.learning_until_secs = None;
        if self.is_learning {
            self.passed.clear();
            return;
        }
        self.beats.push(FIRST_SHARE * highest);
        self.quiet_since_secs = candidate.secs;
        for _ in 0..self.passed.len() {
            if let Some(candidate) = self.passed.pop_front() {
                self.judge(candidate, Found::Later);
            }
        }
    }

    /// Searches back for a missed beat before this candidate; returns whether one was found.
    fn search_back(&mut self, until: &Candidate) -> bool {
        let usual = self.usual(until.secs);
        let Some(last) = self.last else { return false };
        let missed_cycles = MISSED_CYCLES
            + (MISSED_CYCLES_IF_REGULAR - MISSED_CYCLES) * quiet(usual.deviation, REGULAR);
        if until.secs - last.secs <= missed_cycles * usual.cycle_secs {
            return false;
        }
        let earliest = last.secs + REFRACTORY_SECS.max(EARLIEST_CYCLES * usual.cycle_secs);
        let late = self.passed.iter().filter(|passed| passed.secs >= earliest);
        let late = late.filter(|passed| !is_t_wave(passed, &last));
        let best = late.max_by(|a, b| a.strength.total_cmp(&b.strength)).copied();
        let beat = best.filter(|best| {
            let least = SEARCH_BACK_SHARE * usual.threshold(usual.cycle_secs, best.restlessness);
            let alike = self.alike(best);
            let least = least.max(usual.other) * share_when_alike(best, alike);
            let restlessness = both_sides::restlessness(best, until);
            best.strength > least
                && best.restlessness < MOST_RESTLESS
                && flutter(best) <= MOST_FLUTTER
                && stands_out(&Candidate { restlessness, ..*best }, alike)
        });
        beat.inspect(|beat| self.accept(*beat, Found::Later)).is_some()
    }

    fn judge(&mut self, candidate: Candidate, found: Found) {
        let usual = self.usual(candidate.secs);
        let secs = self.last.map_or(usual.cycle_secs, |last| candidate.secs - last.secs);
        if secs < REFRACTORY_SECS {
            return;
        }
        if is_artefact(&candidate, &usual) {
            self.artefacts += 1;
            if self.artefacts >= MOST_ARTEFACTS {
                self.forget_height();
            }
            return;
        }
        let alike = self.alike(&candidate);
        let cycles = secs / usual.cycle_secs;
        let share = share_when_alike(&candidate, alike)
            * share_at_first(&candidate, alike, cycles, usual.deviation);
        let is_fast = usual.cycle_secs < FAST_SECS && is_alike(alike);
        let is_t_wave = !is_fast && self.last.is_some_and(|last| is_t_wave(&candidate, &last));
        let surpasses = candidate.strength > share * usual.threshold(secs, candidate.restlessness);
        if surpasses && stands_out_at_first(&candidate, alike, cycles) && !is_t_wave {
            self.accept(candidate, found);
        } else {
            self.others.push(candidate.secs, candidate.strength);
            self.pass(candidate);
        }
    }

    fn accept(&mut self, candidate: Candidate, found: Found) {
        self.learn_from(&candidate);
        self.shapes[self.accepted % MEMORY] = candidate.shape;
        self.accepted += 1;
        self.artefacts = 0;
        self.last = Some(candidate);
        self.quiet_since_secs = candidate.secs;
        if found == Found::InTime {
            self.passed.clear();
        } else {
            self.passed.retain(|passed| passed.secs > candidate.secs);
        }
        self.found.push_back((candidate, found));
    }

    fn learn_from(&mut self, beat: &Candidate) {
        let cycle_secs = |last: &Candidate| (beat.secs - last.secs).min(LONGEST_SECS);
        let is_p_wave = |last: &&Candidate| {
            beat.secs - last.secs < P_WAVE_SECS && beat.strength > last.strength
        };
        let highest = self.highest_before(beat);
        if let Some(p_wave) = self.last.as_ref().filter(is_p_wave) {
            self.others.push(p_wave.secs, p_wave.strength);
            self.waves.raise_newest(p_wave.strength);
            self.beats.replace_newest(beat.strength);
            if let Some(before) = &self.before {
                self.cycles_secs.replace_newest(cycle_secs(before));
            }
            return;
        }
        if let Some(last) = &self.last {
            self.cycles_secs.push(cycle_secs(last));
            self.waves.push(beat.secs, highest);
        }
        self.beats.push(beat.strength);
        self.before = self.last;
    }

    /// The height of the highest deflection between the last beat and this one.
    fn highest_before(&self, beat: &Candidate) -> f64 {
        let before = self.passed.iter().filter(|passed| passed.secs < beat.secs);
        before.map(|passed| passed.strength).fold(0.0, f64::max)
    }

    fn pass(&mut self, candidate: Candidate) {
        if self.passed.len() == MOST_PASSED {
            self.passed.pop_front();
        }
        self.passed.push_back(candidate);
    }

    /// The similarity of a candidate to the newest beats.
    fn alike(&self, candidate: &Candidate) -> f64 {
        alike(&candidate.shape, self.shapes.iter())
    }

    fn usual(&self, at_secs: f64) -> Usual {
        let cycle_secs = self.cycles_secs.median().unwrap_or(FIRST_CYCLE_SECS);
        let deviation = self.cycles_secs.median_of(|each| (each / cycle_secs).ln().abs());
        Usual {
            beat: self.beats.median().unwrap_or(0.0),
            other: self.others.usual(at_secs, self.accepted, cycle_secs),
            wave: self.waves.median(at_secs),
            cycle_secs,
            deviation: deviation.unwrap_or(UNKNOWN_DEVIATION),
        }
    }
}
