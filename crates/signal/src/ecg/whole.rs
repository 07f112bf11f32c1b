//! Beats of a whole recording.

use super::beat::{Beat, Found};
use super::both_sides::consider_both_sides;
use super::candidates::{Candidate, Candidates};
use super::causal::BeatDetector;
use super::deflections::is_near;
use super::judge::{FIRST_CYCLE_SECS, UNKNOWN_DEVIATION, Usual, is_sure};
use super::recent::{MEMORY, median};
use super::rhythm::{self, chain};
use super::shape::alike;
use crate::error::SignalError;

/// The time after which a maximum of the envelope is known to remain the highest [s].
const LATENCY_SECS: f64 = 0.255;
/// How long a maximum of the envelope must remain the highest to be considered with the rhythm [s]: a deflection just
/// after a beat may be higher. The first pass requires it for longer [s].
const SPACING_SECS: f64 = 0.05;
const HIDING_SECS: f64 = 0.18;
/// A beat this near to an end of the recording [s] counts if it is like at least three of the nearest ones.
const UNKNOWN_SECS: f64 = 0.1;
const LEAST_OTHERS: usize = 3;
const ALIKE: f64 = 0.8;
/// The number of passes that choose the beats again, from the statistics of the last choice.
const PASSES: usize = 3;
/// The number of cycles before and after that define what is usual, and the range of usual cycles [s].
const CYCLES: usize = 16;
const CYCLE_SECS: (f64, f64) = (0.22, 2.4);

/// Finds the beats of a whole ECG at 80 to 4000 Hz, in any unit and of either polarity.
///
/// A first pass detects beats as [`BeatDetector`] does. Three further passes estimate the typical beat height and
/// interval from the beats before and after each candidate, and choose the most probable chain of beats. The more
/// deflections there are besides beats, the higher a candidate that does not fit the rhythm must be to count. Samples
/// that are not [usable numbers](crate::gaps::is_usable) are bridged; a recording without beats returns none.
///
/// Returns an error for a rate outside this range.
pub fn find_beats(signal: &[f64], rate_hz: f64) -> Result<Vec<Beat>, SignalError> {
    let mut candidates = Candidates::with_spacing(rate_hz, LATENCY_SECS, SPACING_SECS)?;
    let mut detector = BeatDetector::over(candidates.clone());
    // The end of the recording counts as a gap.
    let beyond = std::iter::repeat_n(f64::NAN, candidates.latency());
    let samples = signal.iter().copied().chain(beyond);
    let mut found: Vec<Candidate> = samples.filter_map(|sample| candidates.push(sample)).collect();
    hide_lower(&mut found);
    let mut places = first_pass(&mut detector, &found);
    consider_both_sides(&mut found);
    for _ in 0..PASSES {
        if !places.is_empty() {
            places = next_pass(&found, &places);
        }
    }
    let end_secs = signal.len() as f64 / rate_hz;
    if let [first, later @ ..] = &places[..]
        && found[*first].secs < UNKNOWN_SECS
        && is_unlike(&found, *first, later.iter())
    {
        places.remove(0);
    }
    if let [earlier @ .., last] = &places[..]
        && found[*last].secs > end_secs - UNKNOWN_SECS
        && is_unlike(&found, *last, earlier.iter().rev())
    {
        places.pop();
    }
    let beats = places.into_iter().map(|place| found[place].beat(Found::InTime));
    Ok(beats.filter(|beat| beat.sample <= signal.len() as f64 - 1.0).collect())
}

/// Whether a beat is unlike the nearest ones, as a hum that begins or breaks off at an end of the recording is.
fn is_unlike<'a>(
    candidates: &[Candidate],
    beat: usize,
    others: impl ExactSizeIterator<Item = &'a usize>,
) -> bool {
    let is_known = others.len() >= LEAST_OTHERS;
    let shapes = others.take(MEMORY).map(|&place| &candidates[place].shape);
    is_known && alike(&candidates[beat].shape, shapes) < ALIKE
}

/// Hides candidates that are so near a higher one that the causal detector does not consider them.
fn hide_lower(candidates: &mut [Candidate]) {
    let mut top = None;
    for place in 0..candidates.len() {
        let here = candidates[place];
        candidates[place].hidden = true;
        let is_over = |&top: &usize| here.secs - candidates[top].secs >= HIDING_SECS;
        if let Some(top) = top.take_if(|top| is_over(top)) {
            candidates[top].hidden = false;
        }
        if top.is_none_or(|top: usize| here.strength > candidates[top].strength) {
            top = Some(place);
        }
    }
    if let Some(top) = top {
        candidates[top].hidden = false;
    }
}

/// The indices of the candidates that the causal detector accepts.
fn first_pass(detector: &mut BeatDetector, candidates: &[Candidate]) -> Vec<usize> {
    let mut places = Vec::new();
    for candidate in candidates.iter().filter(|each| !each.hidden) {
        detector.take(*candidate);
        while let Some((beat, _)) = detector.next_found() {
            let place = candidates.binary_search_by(|each| each.secs.total_cmp(&beat.secs));
            places.extend(place);
        }
    }
    places
}

fn next_pass(candidates: &[Candidate], beats: &[usize]) -> Vec<usize> {
    let usual = usual(candidates, beats);
    let (mut begin, mut next) = (0, Vec::with_capacity(beats.len()));
    for stretch in candidates.chunk_by(|_, each| !each.after_gap) {
        let end = begin + stretch.len();
        chain(stretch, &usual[begin..end], begin, &mut next);
        begin = end;
    }
    next
}

/// The usual heights and cycle around each candidate, given these beats.
fn usual(candidates: &[Candidate], beats: &[usize]) -> Vec<rhythm::Around> {
    let count = candidates.len();
    let strengths = |places: &Places| -> Vec<f64> {
        places.indices.iter().map(|&place| candidates[place].strength).collect()
    };
    let is_interval = |pair: &&[usize]| !candidates[pair[1]].after_gap;
    let pairs: Vec<&[usize]> = beats.windows(2).filter(is_interval).collect();
    let ends = Places::new(pairs.iter().map(|pair| pair[1]).collect(), count);
    let beats = Places::new(beats.to_vec(), count);
    let is_other = |&place: &usize| !beats.contains(place) && !candidates[place].hidden;
    let others = Places::new((0..count).filter(is_other).collect(), count);
    let heights = Around::new(&beats, strengths(&beats), MEMORY);
    let other_heights = Around::new(&others, strengths(&others), MEMORY);
    let secs = |pair: &&[usize]| candidates[pair[1]].secs - candidates[pair[0]].secs;
    let cycles_secs = Around::new(&ends, pairs.iter().map(secs).collect(), CYCLES);
    let deviation = |(secs, median): (&f64, &f64)| (secs / median).ln().abs();
    let each = cycles_secs.values.iter().zip(&cycles_secs.medians);
    let deviations = Around::new(&ends, each.map(deviation).collect(), CYCLES);
    let wave = |pair: &&[usize]| highest_between(candidates, pair);
    let waves = Around::new(&ends, pairs.iter().map(wave).collect(), MEMORY);
    let at = |place| {
        let cycle_secs = cycles_secs.median(place).unwrap_or(FIRST_CYCLE_SECS);
        let cycle_secs = cycle_secs.clamp(CYCLE_SECS.0, CYCLE_SECS.1);
        let other = match other_heights.far(place, candidates) {
            Some(near) => {
                // A beat without another deflection counts as one of height zero.
                let beats = heights.places_around(place).iter();
                let beats =
                    beats.filter(|&&beat| is_near(candidates[beat].secs - candidates[place].secs));
                let mut near: Vec<f64> = near.collect();
                near.resize(near.len().max(beats.count()), 0.0);
                median(&mut near).unwrap_or(0.0)
            }
            None => other_heights.median(place).unwrap_or(0.0),
        };
        let usual = Usual {
            beat: heights.median(place).unwrap_or(0.0),
            other,
            wave: waves.median(place),
            cycle_secs,
            deviation: deviations.median(place).unwrap_or(UNKNOWN_DEVIATION),
        };
        let candidate = &candidates[place];
        let alike = if is_sure(candidate, &usual) {
            0.0
        } else {
            let near = heights.places_around(place).iter().filter(|&&beat| beat != place);
            alike(&candidate.shape, near.map(|&beat| &candidates[beat].shape))
        };
        rhythm::Around { usual, alike }
    };
    (0..count).map(at).collect()
}

/// The height of the highest candidate between two beats.
fn highest_between(candidates: &[Candidate], pair: &[usize]) -> f64 {
    let between = candidates[pair[0] + 1..pair[1]].iter().filter(|each| !each.hidden);
    between.map(|each| each.strength).fold(0.0, f64::max)
}

/// Some of the candidates.
struct Places {
    /// The indices of these candidates, in ascending order.
    indices: Vec<usize>,
    /// The number of these candidates before each candidate.
    ranks: Vec<usize>,
}

impl Places {
    fn new(indices: Vec<usize>, candidates: usize) -> Places {
        let mut ranks = Vec::with_capacity(candidates);
        for (rank, &index) in indices.iter().enumerate() {
            ranks.resize(index + 1, rank);
        }
        ranks.resize(candidates, indices.len());
        Places { indices, ranks }
    }

    fn contains(&self, place: usize) -> bool {
        self.indices.get(self.ranks[place]) == Some(&place)
    }
}

/// Medians of the values around an index.
struct Around<'a> {
    places: &'a Places,
    values: Vec<f64>,
    reach: usize,
    medians: Vec<f64>,
}

impl<'a> Around<'a> {
    /// Uses `reach` values before and after.
    fn new(places: &'a Places, values: Vec<f64>, reach: usize) -> Around<'a> {
        Around { places, reach, medians: rolling_medians(&values, reach), values }
    }

    fn window(&self, place: usize) -> std::ops::Range<usize> {
        let middle = self.places.ranks[place];
        middle.saturating_sub(self.reach)..(middle + self.reach).min(self.values.len())
    }

    /// The indices of the surrounding values.
    fn places_around(&self, place: usize) -> &[usize] {
        &self.places.indices[self.window(place)]
    }

    /// The surrounding values that are near in time; `None` if all are.
    fn far<'b>(
        &'b self,
        place: usize,
        candidates: &'b [Candidate],
    ) -> Option<impl Iterator<Item = f64> + 'b> {
        let window = self.window(place);
        let here = candidates[place].secs;
        let indices = &self.places.indices;
        let near = move |each: usize| is_near(candidates[each].secs - here);
        let ends = indices.get(window.start).zip(indices.get(window.end.checked_sub(1)?));
        let is_whole = window.len() == 2 * self.reach;
        if is_whole && ends.is_some_and(|(&first, &last)| near(first) && near(last)) {
            return None;
        }
        Some(window.filter(move |&index| near(indices[index])).map(|index| self.values[index]))
    }

    /// The median of the surrounding values; `None` without values.
    fn median(&self, place: usize) -> Option<f64> {
        self.medians.get(self.places.ranks[place]).copied()
    }
}

/// The median of `reach` values on both sides, for each position between two values and at both ends.
fn rolling_medians(values: &[f64], reach: usize) -> Vec<f64> {
    if values.is_empty() {
        return Vec::new();
    }
    let mut sorted: Vec<f64> = values[..reach.min(values.len())].to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let mut medians = Vec::with_capacity(values.len() + 1);
    for place in 0..=values.len() {
        let middle = sorted.len() / 2;
        let is_odd = sorted.len() % 2 == 1;
        medians.push(if is_odd {
            sorted[middle]
        } else {
            sorted[middle - 1].midpoint(sorted[middle])
        });
        if let Some(old) = place.checked_sub(reach) {
            sorted.remove(rank(&sorted, values[old]));
        }
        if let Some(&new) = values.get(place + reach) {
            sorted.insert(rank(&sorted, new), new);
        }
    }
    medians
}

/// The number of values smaller than `value`.
fn rank(sorted: &[f64], value: f64) -> usize {
    sorted.partition_point(|each| each.total_cmp(&value).is_lt())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::robust::median;

    proptest! {
        #[test]
        fn rolling_medians_are_those_of_the_values_around(
            values in prop::collection::vec((0..9i32).prop_map(f64::from), 0..50),
            reach in 1..20usize,
        ) {
            let medians = rolling_medians(&values, reach);
            for (place, &rolling) in medians.iter().enumerate() {
                let end = (place + reach).min(values.len());
                prop_assert_eq!(Some(rolling), median(&values[place.saturating_sub(reach)..end]));
            }
        }
    }
}
