//! Selection of beats among many candidates by height and rhythm.

use super::candidates::Candidate;
use super::judge::{Usual, flutter, is_artefact, quiet, share_when_alike, unrest};

/// The refractory period [s]: at most 240 beats a minute, or 270 if the usual cycle is shorter than `FAST_CYCLE_SECS`.
const REFRACTORY_SECS: f64 = 0.25;
const FAST_REFRACTORY_SECS: f64 = 0.22;
const FAST_CYCLE_SECS: f64 = 0.3;
/// The score per factor of e by which a candidate's height exceeds the threshold of a due beat, and the highest score,
/// reached at about twice the threshold.
const HEIGHT_WEIGHT: f64 = 2.0;
const MOST_HEIGHT: f64 = 1.5;
/// The score lost per factor of e by which a candidate's restlessness exceeds that of beats; above this multiple it is
/// not a beat.
const UNREST_WEIGHT: f64 = 4.0;
const MOST_UNREST: f64 = 1.5;
/// The weight of an interval's cost, the squared log deviation from the usual cycle. It grows in noise, where
/// heights carry little information: with the square of the usual height of other deflections relative to
/// beats.
const RHYTHM_WEIGHT: f64 = 0.8;
const NOISE_WEIGHT: f64 = 8.0;
/// Longer intervals cost as much as one of this length [cycles].
const LONGEST_CYCLES: f64 = 4.0;
/// The largest additional cost of an interval that fits neither the usual cycle nor the interval before it.
const MISFIT_WEIGHT: f64 = 1.0;
/// The deviation up to which intervals fit, as a multiple of the usual one, and its minimum [log cycles].
const MISFIT_DEVIATIONS: f64 = 4.0;
const LEAST_MISFIT: f64 = 0.08;
/// The additional cost does not apply to a candidate in quiet, below the first restlessness, and applies in full above
/// the second.
const MISFIT_RESTLESS: (f64, f64) = (0.1, 0.25);
/// The score lost per factor of e by which a candidate looks more like flutter than beats do.
const FLUTTER_WEIGHT: f64 = 4.0;

/// The usual heights and cycle around a candidate, and its similarity to beats.
pub(super) struct Around {
    pub(super) usual: Usual,
    pub(super) alike: f64,
}

/// A candidate as the end of a chain of beats.
#[derive(Clone, Copy)]
struct Link {
    /// The candidate's index.
    place: usize,
    /// The score of the best chain that ends with it.
    score: f64,
    /// The link before it in that chain, and the interval since [log cycles].
    before: Option<usize>,
    interval: f64,
}

/// Finds the most probable beats of one stretch without a gap: the chain of candidates whose heights and intervals have
/// the highest total score (dynamic programming, Viterbi 1967, doi:10.1109/TIT.1967.1054010).
///
/// `usual` has one entry for each candidate. Adds the indices of the beats, plus `begin`, to `beats`.
pub(super) fn chain(
    candidates: &[Candidate],
    usual: &[Around],
    begin: usize,
    beats: &mut Vec<usize>,
) {
    let secs = |link: &Link| candidates[link.place].secs;
    let mut links: Vec<Link> = Vec::with_capacity(candidates.len());
    // The best chain that ended beyond the longest interval, and the first link within it.
    let (mut best, mut recent): (Option<usize>, usize) = (None, 0);
    let can_be = |&place: &usize| {
        unrest(&candidates[place], usual[place].alike) < MOST_UNREST
            && !is_artefact(&candidates[place], &usual[place].usual)
    };
    for place in (0..candidates.len()).filter(can_be) {
        let (here, around) = (candidates[place].secs, &usual[place]);
        let usual = &around.usual;
        let is_fast = usual.cycle_secs < FAST_CYCLE_SECS;
        let refractory_secs = if is_fast { FAST_REFRACTORY_SECS } else { REFRACTORY_SECS };
        while links.get(recent).is_some_and(|link| here - secs(link) >= refractory_secs) {
            best = Some(
                best.filter(|&best| links[best].score >= links[recent].score).unwrap_or(recent),
            );
            recent += 1;
        }
        let weight = rhythm_weight(usual);
        let anew = weight * LONGEST_CYCLES.ln().powi(2);
        let far = best.filter(|&best| links[best].score > 0.0);
        let mut top = (far.map_or(0.0, |far| links[far].score) - anew, far, f64::INFINITY);
        let misfit = Misfit::of(&candidates[place], usual);
        for before in (0..recent).rev() {
            let link = &links[before];
            let cycles = (here - secs(link)) / usual.cycle_secs;
            if cycles > LONGEST_CYCLES {
                break;
            }
            let interval = cycles.ln();
            let cost = weight * interval * interval + misfit.cost(interval, link.interval);
            let score = link.score - cost;
            top = if score > top.0 { (score, Some(before), interval) } else { top };
        }
        let score = top.0 + own_score(&candidates[place], usual, around.alike);
        links.push(Link { place, score, before: top.1, interval: top.2 });
    }
    follow_back(&links, begin, beats);
}

/// The additional cost of intervals that do not fit the rhythm.
struct Misfit {
    most: f64,
    /// The variance of intervals that fit [log cycles, squared].
    variance: f64,
}

impl Misfit {
    fn of(candidate: &Candidate, usual: &Usual) -> Misfit {
        let most = MISFIT_WEIGHT * (1.0 - quiet(candidate.restlessness, MISFIT_RESTLESS));
        Misfit { most, variance: (MISFIT_DEVIATIONS * usual.deviation).max(LEAST_MISFIT).powi(2) }
    }

    /// The cost of an interval, given the one before it [log cycles].
    fn cost(&self, interval: f64, before: f64) -> f64 {
        let off = (interval * interval).min((interval - before).powi(2));
        self.most * (1.0 - (-off / (2.0 * self.variance)).exp())
    }
}

/// Traces the best chain back and adds its beats.
fn follow_back(links: &[Link], begin: usize, beats: &mut Vec<usize>) {
    let first = beats.len();
    let mut next = (0..links.len()).max_by(|&a, &b| links[a].score.total_cmp(&links[b].score));
    while let Some(link) = next {
        beats.push(begin + links[link].place);
        next = links[link].before;
    }
    beats[first..].reverse();
}

/// The score of a candidate by its height and by the quiet around it.
fn own_score(candidate: &Candidate, usual: &Usual, alike: f64) -> f64 {
    let threshold = share_when_alike(candidate, alike)
        * usual.threshold(usual.cycle_secs, candidate.restlessness);
    let score = HEIGHT_WEIGHT * (candidate.strength / threshold).ln();
    let score = score.clamp(-4.0 * MOST_HEIGHT, MOST_HEIGHT);
    score
        - UNREST_WEIGHT * unrest(candidate, alike).max(1.0).ln()
        - FLUTTER_WEIGHT * flutter(candidate).max(1.0).ln()
}

fn rhythm_weight(usual: &Usual) -> f64 {
    let noise = (usual.other / usual.beat).min(1.0);
    RHYTHM_WEIGHT + NOISE_WEIGHT * noise * noise
}

#[cfg(test)]
mod tests {
    use super::*;

    const CYCLE_SECS: f64 = 0.8;

    /// The beats among candidates, where usual ones are 1 high and 0.8 s apart.
    fn chosen(candidates: &[Candidate], deviation: f64) -> Vec<usize> {
        let usual =
            Usual { beat: 1.0, other: 0.05, wave: Some(0.1), cycle_secs: CYCLE_SECS, deviation };
        let around: Vec<Around> = candidates.iter().map(|_| Around { usual, alike: 0.9 }).collect();
        let mut beats = Vec::new();
        chain(candidates, &around, 0, &mut beats);
        beats
    }

    /// Twenty beats, with a candidate somewhat after the tenth that is a third higher than they are.
    fn beats_and(after_secs: f64, restlessness: f64) -> Vec<Candidate> {
        let beats = (0..20).map(|beat| Candidate::at(f64::from(beat) * CYCLE_SECS, 1.0));
        let mut candidates: Vec<Candidate> = beats.collect();
        let secs = candidates[9].secs + after_secs;
        candidates.insert(10, Candidate { restlessness, ..Candidate::at(secs, 1.3) });
        candidates
    }

    #[test]
    fn noise_just_after_a_beat_does_not_replace_it_in_a_regular_rhythm() {
        let on_time: Vec<usize> = (0..21).filter(|&place| place != 10).collect();
        assert_eq!(chosen(&beats_and(0.2, 0.3), 0.02), on_time);
        assert_eq!(chosen(&beats_and(0.4, 0.3), 0.02), on_time);
        assert_eq!(chosen(&beats_and(0.4, 0.05), 0.02).len(), 21, "an early beat in quiet");
    }

    #[test]
    fn waves_of_flutter_are_not_beats() {
        let wave = |k: i32| Candidate {
            restlessness: 0.25,
            breadth: 10.0,
            swell: 2.0 * f64::from(k % 2),
            ..Candidate::at(f64::from(k) * 0.4, 1.0)
        };
        let candidates: Vec<Candidate> = (0..40).map(wave).collect();
        let pauses: Vec<usize> = (0..40).step_by(2).collect();
        assert_eq!(chosen(&candidates, 0.02), pauses);
    }
}
