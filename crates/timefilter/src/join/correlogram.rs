//! The offset on which most events agree: the histogram of all distances.

use super::JoinError;

/// The width of a bin [s].
const BIN_SECS: f64 = 0.01;
/// The most bins: 46 hours.
const MOST_BINS: usize = 1 << 24;
/// The number of events compared at once; over such a chunk the clocks drift apart by a tenth of the
/// tolerance.
const CHUNK: usize = 256;
/// The most chunks, spread evenly over the recording.
const MOST_CHUNKS: usize = 12;
/// Offsets this close belong to one peak [s].
const PEAK_SECS: f64 = 0.2;
/// The height of the second peak, relative to the first, above which the offset is ambiguous.
const AMBIGUOUS_SHARE: f64 = 0.7;

/// An offset, and the part of the recording in which it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lag {
    pub(super) offset_secs: f64,
    /// The index of the first event of the part, and of the one after it.
    pub(super) first: usize,
    pub(super) end: usize,
    /// The tolerance of a pair [s].
    pub(super) tolerance_secs: f64,
    /// The share of the part's events that agree, and the next best offset with its share.
    share: f64,
    next: Option<(f64, f64)>,
}

/// The offset on which most events of any part of the recording agree.
pub(super) fn best_lag(
    session: &[f64],
    recording: &[f64],
    max_offset_secs: f64,
    tolerance_secs: f64,
) -> Result<Lag, JoinError> {
    let length = CHUNK.min(recording.len());
    let chunks = recording.len().div_ceil(length).min(MOST_CHUNKS);
    let step = (recording.len() - length) as f64 / (chunks.max(2) - 1) as f64;
    let of_chunk = |chunk: usize| {
        let first = ((chunk as f64 * step) as usize).min(recording.len() - length);
        chunk_lag(session, recording, first..first + length, max_offset_secs, tolerance_secs)
    };
    let lags = (0..chunks).filter_map(of_chunk);
    let best = lags.max_by(|a, b| a.share.total_cmp(&b.share)).ok_or(JoinError::Apart)?;
    match best.next {
        Some((next_offset_secs, share)) if share > AMBIGUOUS_SHARE * best.share => {
            Err(JoinError::Ambiguous { offset_secs: best.offset_secs, next_offset_secs })
        }
        _ => Ok(best),
    }
}

fn chunk_lag(
    session: &[f64],
    recording: &[f64],
    chunk: std::ops::Range<usize>,
    max_offset_secs: f64,
    tolerance_secs: f64,
) -> Option<Lag> {
    let part = &recording[chunk.clone()];
    let least = (session.first()? - part.last()?).max(-max_offset_secs) - PEAK_SECS;
    let most = (session.last()? - part.first()?).min(max_offset_secs) + PEAK_SECS;
    let bins = ((most - least) / BIN_SECS).ceil() + 1.0;
    if !(bins >= 1.0 && bins <= MOST_BINS as f64) {
        return None;
    }
    let mut histogram = vec![0_f32; bins as usize];
    let width = tolerance_secs / BIN_SECS;
    for device in part {
        let from = session.partition_point(|secs| *secs < device + least);
        let near = session[from..].iter().take_while(|secs| **secs <= device + most);
        for secs in near {
            let center = (secs - device - least) / BIN_SECS;
            let last = ((center + width) as usize).min(histogram.len() - 1);
            for (place, height) in histogram
                .iter_mut()
                .enumerate()
                .take(last + 1)
                .skip((center - width).max(0.0).ceil() as usize)
            {
                *height += (1.0 - (place as f64 - center).abs() / width).max(0.0) as f32;
            }
        }
    }
    let place = highest(&histogram, |_| true)?;
    let apart = |other: usize| {
        other.abs_diff(place) as f64 * BIN_SECS > PEAK_SECS.max(2.0 * tolerance_secs)
    };
    let at = |place: usize| least + place as f64 * BIN_SECS;
    let share = |place: usize| f64::from(histogram[place]) / part.len() as f64;
    Some(Lag {
        offset_secs: at(place),
        first: chunk.start,
        end: chunk.end,
        tolerance_secs,
        share: share(place),
        next: highest(&histogram, apart).map(|next| (at(next), share(next))),
    })
}

/// The index of the highest positive bin among those selected.
fn highest(histogram: &[f32], among: impl Fn(usize) -> bool) -> Option<usize> {
    let places = (0..histogram.len()).filter(|place| histogram[*place] > 0.0 && among(*place));
    places.max_by(|a, b| histogram[*a].total_cmp(&histogram[*b]))
}
