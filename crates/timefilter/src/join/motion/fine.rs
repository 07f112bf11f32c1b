//! The offset of each segment with similar motion, followed in both directions from the part where the offset
//! was found.

use super::coarse::Offset;
use super::grid::{Grid, STEP_SECS};

/// The length of a segment: 30 s \[steps\].
const STRETCH: usize = 1_500;
/// The search range around the offset [s], and how much it grows after a time without matches.
const AROUND_SECS: f64 = 0.3;
const DRIFT: f64 = 200e-6;
const MOST_AROUND_SECS: f64 = 1.0;
/// The minimum correlation of a segment with similar motion.
const LEAST: f64 = 0.3;

/// The result for all segments.
pub(super) struct Followed {
    /// The middle of each segment with similar motion [s], and how much later it is in the session [s].
    pub pairs: Vec<(f64, f64)>,
    /// The number of segments that both recorded.
    pub stretches: usize,
}

/// Follows a recording from the place where its offset is known.
pub(super) fn follow(session: &Grid, recording: &Grid, from: Offset) -> Followed {
    let middle = recording.place(from.at_secs).max(0) as usize;
    let start = Follower { session, recording, offset: from.secs, at: from.at_secs, stretches: 0 };
    let (mut back, mut on) = (start.clone(), start);
    let after = (middle..recording.values.len()).step_by(STRETCH);
    let before = (1..=middle / STRETCH).map(|number| middle - number * STRETCH);
    let mut pairs: Vec<(f64, f64)> = before.filter_map(|place| back.stretch(place)).collect();
    pairs.extend(after.filter_map(|place| on.stretch(place)));
    pairs.sort_by(|one, other| one.0.total_cmp(&other.0));
    Followed { pairs, stretches: back.stretches + on.stretches }
}

#[derive(Clone)]
struct Follower<'a> {
    session: &'a Grid,
    recording: &'a Grid,
    /// The offset, and where it was last seen [s].
    offset: f64,
    at: f64,
    stretches: usize,
}

impl Follower<'_> {
    /// The middle of the segment that begins at an index, and its offset [s]; `None` if the motions differ.
    fn stretch(&mut self, place: usize) -> Option<(f64, f64)> {
        let theirs = self.recording.part(place as isize, STRETCH)?;
        let at = self.recording.secs(place + STRETCH / 2);
        let around = (AROUND_SECS + DRIFT * (at - self.at).abs()).min(MOST_AROUND_SECS);
        let reach = (around / STEP_SECS).ceil() as isize;
        let there = self.session.place(self.recording.secs(place) + self.offset);
        let length = STRETCH + 2 * reach as usize;
        let ours = self.session.part(there - reach, length)?;
        self.stretches += 1;
        let heights: Vec<f64> =
            ours.windows(STRETCH).map(|ours| correlation(ours, theirs)).collect();
        let best = (0..heights.len()).max_by(|a, b| heights[*a].total_cmp(&heights[*b]))?;
        if heights[best] < LEAST {
            return None;
        }
        // At an end the true peak may lie beyond.
        let (before, after) = (heights.get(best.checked_sub(1)?)?, heights.get(best + 1)?);
        let bend = before - 2.0 * heights[best] + after;
        let within = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
        let lag = best as f64 - reach as f64 + within;
        let offset =
            self.session.secs(0) + (there as f64 + lag) * STEP_SECS - self.recording.secs(place);
        (self.offset, self.at) = (offset, at);
        Some((at, offset))
    }
}

fn correlation(one: &[f32], other: &[f32]) -> f64 {
    let (mut product, mut squares, mut others) = (0.0_f32, 0.0_f32, 0.0_f32);
    for (a, b) in one.iter().zip(other) {
        product += a * b;
        squares += a * a;
        others += b * b;
    }
    let both = f64::from(squares).sqrt() * f64::from(others).sqrt();
    if both > 0.0 { f64::from(product) / both } else { 0.0 }
}
