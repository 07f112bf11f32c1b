//! Beats of a whole recording.

use std::ops::Range;

use super::beat::{Beat, Found};
use super::candidates::{Candidate, Candidates};
use super::causal::BeatDetector;
use super::judge::{FIRST_CYCLE_SECS, Usual, is_t_wave, stands_out};
use super::recent::{MEMORY, median};
use crate::error::SignalError;

/// How long a maximum of the envelope must stay unsurpassed [s].
const WAIT_SECS: f64 = 0.15;
/// No two beats follow faster [s]: 240 a minute.
const REFRACTORY_SECS: f64 = 0.25;
/// The next sure beat surpasses this share of the usual height.
const SURE: f64 = 0.7;
/// It is looked for during so many cycles.
const SURE_CYCLES: f64 = 2.0;

/// The beats of a whole ECG at a rate of 80 to 4000 Hz, in any unit and of either polarity.
///
/// In a first pass beats are found as [`BeatDetector`] does. In a second one, what is usual is
/// known from both sides of each candidate, and a candidate must not come too early after the beat
/// before it, nor too shortly before the next sure one. Samples that are no [usable numbers](crate::gaps::is_usable) are
/// bridged; a recording without beats has none.
///
/// An error when the rate lies outside.
pub fn find_beats(signal: &[f64], rate_hz: f64) -> Result<Vec<Beat>, SignalError> {
    let mut candidates = Candidates::new(rate_hz, WAIT_SECS)?;
    let mut detector = BeatDetector::over(candidates.clone());
    // What lies beyond the end counts as a gap.
    let beyond = std::iter::repeat_n(f64::NAN, candidates.latency());
    let samples = signal.iter().copied().chain(beyond);
    let found: Vec<Candidate> = samples.filter_map(|sample| candidates.push(sample)).collect();
    let first = first_pass(&mut detector, &found);
    let beats = if first.is_empty() { first } else { second_pass(&found, &first) };
    let within = |beat: &Beat| beat.sample <= signal.len() as f64 - 1.0;
    Ok(beats.iter().map(|beat| beat.beat(Found::InTime)).filter(within).collect())
}

fn first_pass(detector: &mut BeatDetector, candidates: &[Candidate]) -> Vec<Candidate> {
    let mut beats = Vec::new();
    for candidate in candidates {
        detector.take(*candidate);
        while let Some((beat, _)) = detector.next_found() {
            beats.push(beat);
        }
    }
    beats
}

fn second_pass(candidates: &[Candidate], first: &[Candidate]) -> Vec<Candidate> {
    let around = Around::new(candidates, first);
    let usual: Vec<Usual> =
        candidates.iter().map(|candidate| around.usual(candidate.secs)).collect();
    let mut beats: Vec<Candidate> = Vec::new();
    for (index, candidate) in candidates.iter().enumerate() {
        let before = beats.last().filter(|_| !candidate.after_gap);
        let usual_here = &usual[index];
        let to_next_secs = secs_to_sure_beat(candidates, &usual, index);
        let secs = before.map_or(usual_here.cycle_secs, |before| candidate.secs - before.secs);
        if secs.min(to_next_secs) < REFRACTORY_SECS {
            replace_if_far_higher(&mut beats, candidate, secs);
            continue;
        }
        let threshold = usual_here.threshold(secs).max(usual_here.threshold(to_next_secs));
        let is_t_wave = before.is_some_and(|before| is_t_wave(candidate, before));
        if candidate.strength > threshold && stands_out(candidate) && !is_t_wave {
            beats.push(*candidate);
        }
    }
    beats
}

/// Lets go of the last beat for one of more than twice its height that comes too early after it.
fn replace_if_far_higher(beats: &mut [Candidate], candidate: &Candidate, secs: f64) {
    if let Some(last) = beats.last_mut()
        && secs < REFRACTORY_SECS
        && candidate.strength > 2.0 * last.strength
    {
        *last = *candidate;
    }
}

/// The time until the next candidate that is surely a beat, and higher.
fn secs_to_sure_beat(candidates: &[Candidate], usual: &[Usual], index: usize) -> f64 {
    let (here, most_secs) = (&candidates[index], SURE_CYCLES * usual[index].cycle_secs);
    let later = candidates[index + 1..].iter().zip(&usual[index + 1..]);
    later
        .map(|(candidate, usual)| (candidate.secs - here.secs, candidate.strength, usual.beat))
        .take_while(|(secs, ..)| *secs < most_secs)
        .find(|(_, strength, beat)| *strength > (SURE * beat).max(here.strength))
        .map_or(most_secs, |(secs, ..)| secs)
}

/// Times and values of the first pass's beats, of the other candidates, and of the intervals.
struct Around {
    beats: Vec<(f64, f64)>,
    others: Vec<(f64, f64)>,
    cycles_secs: Vec<(f64, f64)>,
}

impl Around {
    fn new(candidates: &[Candidate], beats: &[Candidate]) -> Around {
        let point = |candidate: &Candidate| (candidate.secs, candidate.strength);
        let is_beat = |candidate: &Candidate| {
            beats.binary_search_by(|beat| beat.secs.total_cmp(&candidate.secs)).is_ok()
        };
        Around {
            beats: beats.iter().map(point).collect(),
            others: candidates.iter().filter(|candidate| !is_beat(candidate)).map(point).collect(),
            cycles_secs: beats
                .windows(2)
                .filter(|pair| !pair[1].after_gap)
                .map(|pair| (pair[1].secs, pair[1].secs - pair[0].secs))
                .collect(),
        }
    }

    fn usual(&self, secs: f64) -> Usual {
        Usual {
            beat: median_around(&self.beats, secs).unwrap_or(0.0),
            other: median_around(&self.others, secs).unwrap_or(0.0),
            cycle_secs: median_around(&self.cycles_secs, secs).unwrap_or(FIRST_CYCLE_SECS),
        }
    }
}

/// The median of as many values before and after a time as are remembered.
fn median_around(points: &[(f64, f64)], secs: f64) -> Option<f64> {
    let middle = points.partition_point(|point| point.0 < secs);
    let near: Range<usize> = middle.saturating_sub(MEMORY)..(middle + MEMORY).min(points.len());
    let mut values = [0.0; 2 * MEMORY];
    let values = &mut values[..near.len()];
    values.iter_mut().zip(&points[near]).for_each(|(value, point)| *value = point.1);
    median(values)
}
