//! The offset at which the envelopes of two motions agree best.

use std::ops::Range;

use super::JoinError;
use super::grid::{Grid, STEP_SECS};

/// The number of grid steps per envelope step.
const STEPS: usize = 5;
const ENVELOPE_SECS: f64 = STEPS as f64 * STEP_SECS;
/// The length of the parts of the recording that are searched for: ten minutes.
const PART: usize = 6_000;
/// The most parts, and the most products that are computed.
const MOST_PARTS: usize = 12;
const MOST_PRODUCTS: f64 = 4e9;
/// Changes of an envelope slower than this are removed, such as alternating sitting and walking \[steps\].
const TREND: usize = 600;
/// The minimum correlation, and the largest height of the next peak relative to it.
const LEAST: f64 = 0.15;
const AMBIGUOUS_SHARE: f64 = 0.75;
/// Offsets this close belong to one peak [s].
const PEAK_SECS: f64 = 5.0;

/// The placement of a part of the recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Offset {
    /// The offset added to a time of the recording [s].
    pub secs: f64,
    /// The middle of the part, by the recording's clock [s].
    pub at_secs: f64,
}

/// The best offset of the part of the recording that agrees best.
pub(super) fn best_offset(
    session: &Grid,
    recording: &Grid,
    max_offset_secs: f64,
) -> Result<Offset, JoinError> {
    let (ours, theirs) = (Envelope::of(session), Envelope::of(recording));
    let length = PART.min(theirs.values.len());
    let lags = ours.lags(&theirs, max_offset_secs).ok_or(JoinError::Apart)?;
    let affordable = MOST_PRODUCTS / (length as f64 * lags.clone().count().max(1) as f64);
    let parts = theirs.liveliest(length, (affordable as usize).clamp(1, MOST_PARTS));
    let peaks = parts.into_iter().filter_map(|from| ours.peak(&theirs, from..from + length, &lags));
    let best = peaks.max_by(|one, other| one.height.total_cmp(&other.height));
    let best = best.filter(|best| best.height >= LEAST).ok_or(JoinError::Apart)?;
    match best.next {
        Some((next_offset_secs, height)) if height > AMBIGUOUS_SHARE * best.height => {
            Err(JoinError::Ambiguous { offset_secs: best.offset.secs, next_offset_secs })
        }
        _ => Ok(best.offset),
    }
}

/// The intensity of motion ten times a second, relative to the surrounding time.
struct Envelope {
    start_secs: f64,
    values: Vec<f32>,
    /// The cumulative sums of squares of all values before each index.
    squares: Vec<f64>,
}

/// The best offset of a part of a recording.
struct Peak {
    offset: Offset,
    height: f64,
    next: Option<(f64, f64)>,
}

impl Envelope {
    fn of(grid: &Grid) -> Envelope {
        let mean = |part: &[f32]| part.iter().map(|value| value.abs()).sum::<f32>() / STEPS as f32;
        let strengths: Vec<f32> = grid.values.chunks_exact(STEPS).map(mean).collect();
        let mut known: Vec<f32> = strengths.iter().copied().filter(|each| *each > 0.0).collect();
        known.sort_by(f32::total_cmp);
        let usual = known.get(known.len() / 2).copied().unwrap_or(1.0);
        // Strong movements count more than weak ones, but no single movement decides the result.
        let levels: Vec<f32> = strengths.iter().map(|each| (each / usual).ln_1p()).collect();
        let values = without_trend(&levels);
        let mut squares = vec![0.0];
        let mut sum = 0.0;
        for value in &values {
            sum += f64::from(value * value);
            squares.push(sum);
        }
        Envelope { start_secs: grid.start_secs, values, squares }
    }

    fn energy(&self, part: Range<usize>) -> f64 {
        self.squares[part.end] - self.squares[part.start]
    }

    /// Where the recording may begin in the session, in steps from the session's start; `None` if nowhere.
    fn lags(&self, recording: &Envelope, max_offset_secs: f64) -> Option<Range<isize>> {
        let begins = (recording.start_secs - self.start_secs) / ENVELOPE_SECS;
        let most = max_offset_secs / ENVELOPE_SECS;
        let from = (begins - most).max(-(recording.values.len() as f64));
        let to = (begins + most).min(self.values.len() as f64);
        (from < to).then_some(from.floor() as isize..to.ceil() as isize + 1)
    }

    /// The starts of the parts with the most motion.
    fn liveliest(&self, length: usize, count: usize) -> Vec<usize> {
        let last = self.values.len() - length;
        let mut parts: Vec<usize> = (0..=last).step_by(length.max(1)).chain([last]).collect();
        parts.dedup();
        let energy = |from: &usize| self.energy(*from..from + length);
        parts.sort_by(|one, other| energy(other).total_cmp(&energy(one)));
        parts.truncate(count);
        parts
    }

    /// The offset at which a part of a recording agrees best.
    fn peak(&self, recording: &Envelope, part: Range<usize>, lags: &Range<isize>) -> Option<Peak> {
        let heights: Vec<(isize, f64)> = lags
            .clone()
            .filter_map(|lag| Some((lag, self.correlation(recording, &part, lag)?)))
            .collect();
        let highest = |apart: &dyn Fn(isize) -> bool| {
            let among = heights.iter().filter(|(lag, _)| apart(*lag));
            among.max_by(|one, other| one.1.total_cmp(&other.1)).copied()
        };
        let (lag, height) = highest(&|_| true)?;
        let is_apart = |other: isize| (other - lag).abs() as f64 * ENVELOPE_SECS > PEAK_SECS;
        let begins = (recording.start_secs - self.start_secs) / ENVELOPE_SECS;
        let secs = |lag: isize| (lag as f64 - begins) * ENVELOPE_SECS;
        let middle = usize::midpoint(part.start, part.end) as f64;
        let at_secs = recording.start_secs + middle * ENVELOPE_SECS;
        let next = highest(&is_apart).map(|(lag, height)| (secs(lag), height));
        Some(Peak { offset: Offset { secs: secs(lag), at_secs }, height, next })
    }

    /// The correlation of a part of a recording that begins at a lag with the overlapping data; `None` if less
    /// than half of it overlaps.
    fn correlation(&self, recording: &Envelope, part: &Range<usize>, lag: isize) -> Option<f64> {
        let from = part.start as isize + lag;
        let skipped = (-from).max(0) as usize;
        let there = usize::try_from(from.max(0)).ok()?;
        let length = part.len().checked_sub(skipped)?;
        let length = length.min(self.values.len().checked_sub(there)?);
        if length * 2 < part.len() {
            return None;
        }
        let theirs = part.start + skipped..part.start + skipped + length;
        let ours = there..there + length;
        let both = (self.energy(ours.clone()) * recording.energy(theirs.clone())).sqrt();
        (both > 0.0).then(|| dot(&self.values[ours], &recording.values[theirs]) / both)
    }
}

fn dot(one: &[f32], other: &[f32]) -> f64 {
    let parts = one.chunks(256).zip(other.chunks(256));
    let part = |(one, other): (&[f32], &[f32])| -> f64 {
        f64::from(one.iter().zip(other).map(|(a, b)| a * b).sum::<f32>())
    };
    parts.map(part).sum()
}

/// Each value minus the mean of those around it.
fn without_trend(values: &[f32]) -> Vec<f32> {
    let mut sums = vec![0.0];
    let mut sum = 0.0;
    for value in values {
        sum += f64::from(*value);
        sums.push(sum);
    }
    let rest = |(place, value): (usize, &f32)| {
        let from = place.saturating_sub(TREND / 2);
        let to = (place + TREND / 2 + 1).min(values.len());
        value - ((sums[to] - sums[from]) / (to - from) as f64) as f32
    };
    values.iter().enumerate().map(rest).collect()
}
