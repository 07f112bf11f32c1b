//! Selection of beats among many candidates by height and rhythm.

use super::candidates::Candidate;
use super::judge::{Usual, is_artefact, share_when_alike, unrest};

/// The refractory period [s]: 240 beats a minute, or 270 where the usual cycle is not much longer [s].
const REFRACTORY_SECS: f64 = 0.25;
const FAST_REFRACTORY_SECS: f64 = 0.22;
const FAST_CYCLE_SECS: f64 = 0.3;
/// The score per factor of e that a candidate's height exceeds the threshold of a due beat, and the highest: that of
/// twice the threshold.
const HEIGHT_WEIGHT: f64 = 2.0;
const MOST_HEIGHT: f64 = 1.5;
/// The score lost per factor of e that its restlessness exceeds that of beats; above this multiple it is none.
const UNREST_WEIGHT: f64 = 4.0;
const MOST_UNREST: f64 = 1.5;
/// The weight of an interval's cost, the squared log deviation from the usual cycle. It grows in noise, where
/// heights carry little information: with the square of the usual height of other deflections relative to
/// beats.
const RHYTHM_WEIGHT: f64 = 0.8;
const NOISE_WEIGHT: f64 = 8.0;
/// Longer intervals cost as much as this one [cycles].
const LONGEST_CYCLES: f64 = 4.0;

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
    /// The link before it in that chain.
    before: Option<usize>,
}

/// The most probable beats of one stretch without a gap: the chain of candidates whose heights and intervals
/// have the highest total score (dynamic programming, Viterbi 1967, doi:10.1109/TIT.1967.1054010).
///
/// `usual` belongs to the candidates one by one. Adds their indices, plus `begin`, to `beats`.
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
        let (here, usual, alike) =
            (candidates[place].secs, &usual[place].usual, usual[place].alike);
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
        let mut top = (far.map_or(0.0, |far| links[far].score) - anew, far);
        for before in (0..recent).rev() {
            let cycles = (here - secs(&links[before])) / usual.cycle_secs;
            if cycles > LONGEST_CYCLES {
                break;
            }
            let score = links[before].score - weight * cycles.ln().powi(2);
            top = if score > top.0 { (score, Some(before)) } else { top };
        }
        let score = top.0 + own_score(&candidates[place], usual, alike);
        links.push(Link { place, score, before: top.1 });
    }
    follow_back(&links, begin, beats);
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
    score - UNREST_WEIGHT * unrest(candidate, alike).max(1.0).ln()
}

fn rhythm_weight(usual: &Usual) -> f64 {
    let noise = (usual.other / usual.beat).min(1.0);
    RHYTHM_WEIGHT + NOISE_WEIGHT * noise * noise
}
