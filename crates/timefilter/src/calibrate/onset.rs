//! Onsets: the moments at which a stream leaves its quiet level.

use super::{CalibrationError, Which};

/// The quiet level is the running median over this time before a sample [s].
const QUIET_SECS: f64 = 0.4;
/// The minimum number of samples in the running median.
const QUIET_LEAST: usize = 5;
/// The maximum number of samples in the running median, evenly spread; it bounds the work.
const QUIET_MOST: usize = 31;
/// The threshold of an onset above the median deviation, in scaled median absolute deviations: in normal
/// noise about five standard deviations, for one channel and for three.
const STANDS_OUT: f64 = 7.0;
/// The minimum threshold of an onset relative to the largest deviation, for signals without noise.
const LEAST_RISE: f64 = 0.02;
/// The height below which a sample is quiet, in scaled median absolute deviations.
const IS_QUIET: f64 = 3.0;
/// The minimum height of an event relative to the largest deviation.
const LEAST_SHARE: f64 = 0.2;
/// The minimum height of the peak that ends an event's rise, relative to the event's height.
const PEAK_SHARE: f64 = 0.3;
/// The minimum quiet time before an onset [s]: anything sooner is the same event ringing on.
const APART_SECS: f64 = 0.2;
/// The longest rise [s], extended to two or three sampling periods where those are longer.
const RISE_SECS: f64 = 0.06;
/// The longest gap in a rise, in sampling periods: beyond it the time of the onset is unknown.
const GAP_INTERVALS: f64 = 3.0;
/// The minimum weight of the first sample's share in a short event: a compromise between sensors that average over
/// their period and those that sample an instant.
const LEAST_LASTS: f64 = 0.5;
/// The most onsets used; the largest are kept.
const MOST: usize = 1000;

/// A moment at which a stream leaves its quiet level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Onset {
    /// When it left the quiet level, as precisely as its first samples show [s].
    pub at_secs: f64,
    /// Half the rise time plus a quarter of the sampling period, as sensors differ in which part of their
    /// period they timestamp [s].
    pub half_span_secs: f64,
    height: f64,
}

/// Why there is no onset.
#[derive(Clone, Copy, Debug)]
pub(super) enum Missing {
    Samples,
    Event,
}

impl Missing {
    pub(super) fn of(self, which: Which) -> CalibrationError {
        match self {
            Missing::Samples => CalibrationError::Short(which),
            Missing::Event => CalibrationError::Quiet(which),
        }
    }
}

/// The onsets of events are the events themselves, without duplicates.
pub(super) fn of_events(times: &[i64], origin: i64) -> Result<Vec<Onset>, Missing> {
    let mut times = times.to_vec();
    times.sort_unstable();
    times.dedup();
    let onset =
        |time| Onset { at_secs: secs_since(origin, time), half_span_secs: 0.0, height: 1.0 };
    let onsets: Vec<Onset> = times.into_iter().take(MOST).map(onset).collect();
    if onsets.is_empty() { Err(Missing::Samples) } else { Ok(onsets) }
}

/// The onsets of a stream of samples.
pub(super) fn of_samples(
    times: &[i64],
    values: &[f64],
    origin: i64,
) -> Result<Vec<Onset>, Missing> {
    let samples = Samples::new(times, values, origin);
    if samples.secs.len() <= 2 * QUIET_LEAST {
        return Err(Missing::Samples);
    }
    let deviations = samples.deviations().ok_or(Missing::Event)?;
    let (middle, spread) = spread(&deviations);
    let rises = Rises {
        secs: &samples.secs,
        deviations: &deviations,
        threshold: (middle + STANDS_OUT * spread).max(LEAST_RISE),
        quiet: (middle + IS_QUIET * spread).max(LEAST_RISE / 2.0),
        interval_secs: samples.interval_secs(),
    };
    let mut onsets = rises.onsets();
    if onsets.len() > MOST {
        onsets.sort_by(|a, b| b.height.total_cmp(&a.height));
        onsets.truncate(MOST);
        onsets.sort_by(|a, b| a.at_secs.total_cmp(&b.at_secs));
    }
    if onsets.is_empty() { Err(Missing::Event) } else { Ok(onsets) }
}

/// Samples in order of time, with distinct times and finite values.
struct Samples {
    secs: Vec<f64>,
    /// The values, sample by sample.
    values: Vec<f64>,
    width: usize,
}

impl Samples {
    fn new(times: &[i64], values: &[f64], origin: i64) -> Samples {
        let width = values.len() / times.len().max(1);
        let row = |place: usize| &values[place * width..][..width];
        let is_sound =
            |place: &usize| width > 0 && row(*place).iter().all(|value| value.is_finite());
        let mut order: Vec<usize> = (0..times.len()).filter(is_sound).collect();
        order.sort_by_key(|place| times[*place]);
        order.dedup_by_key(|place| times[*place]);
        Samples {
            secs: order.iter().map(|place| secs_since(origin, times[*place])).collect(),
            values: order.iter().flat_map(|place| row(*place)).copied().collect(),
            width,
        }
    }

    /// The deviation of each sample from the quiet level before it, over all channels, relative to the
    /// largest deviation; `None` if the signal never moves.
    fn deviations(&self) -> Option<Vec<f64>> {
        let mut begin = 0;
        let mut squares = vec![0.0; self.secs.len()];
        let scales: Vec<f64> = (0..self.width).map(|channel| self.largest(channel)).collect();
        let largest = scales.iter().copied().fold(0.0, f64::max);
        for (place, square) in squares.iter_mut().enumerate().skip(1) {
            while self.secs[begin] < self.secs[place] - QUIET_SECS {
                begin += 1;
            }
            let begin = begin.min(place.saturating_sub(QUIET_LEAST));
            for channel in 0..self.width {
                let quiet = self.median(channel, begin, place);
                let value = self.values[place * self.width + channel];
                *square += (value / largest - quiet / largest).powi(2);
            }
        }
        let most = squares.iter().copied().fold(0.0, f64::max).sqrt();
        let is_still = most.is_nan() || most <= 0.0;
        (!is_still).then(|| squares.iter().map(|square| square.sqrt() / most).collect())
    }

    fn largest(&self, channel: usize) -> f64 {
        let values = self.values.iter().skip(channel).step_by(self.width);
        values.fold(0.0, |largest, value| value.abs().max(largest))
    }

    /// The median of a channel over some samples, subsampled where there are many.
    fn median(&self, channel: usize, begin: usize, end: usize) -> f64 {
        let mut some = [0.0; QUIET_MOST];
        let stride = (end - begin).div_ceil(QUIET_MOST).max(1);
        let places = (begin..end).step_by(stride);
        let count = places.len().min(QUIET_MOST);
        for (value, place) in some.iter_mut().zip(places) {
            *value = self.values[place * self.width + channel];
        }
        median(&mut some[..count])
    }

    /// The median sampling period [s].
    fn interval_secs(&self) -> f64 {
        let mut intervals: Vec<f64> = self.secs.windows(2).map(|two| two[1] - two[0]).collect();
        median(&mut intervals)
    }
}

/// The rises of a stream above its quiet level.
struct Rises<'a> {
    secs: &'a [f64],
    deviations: &'a [f64],
    threshold: f64,
    quiet: f64,
    interval_secs: f64,
}

impl Rises<'_> {
    fn onsets(&self) -> Vec<Onset> {
        let mut onsets = Vec::new();
        let mut quiet_since = self.secs.first().copied().unwrap_or_default();
        for (place, deviation) in self.deviations.iter().enumerate() {
            if *deviation < self.threshold {
                continue;
            }
            if self.secs[place] - quiet_since >= APART_SECS {
                onsets.extend(self.onset(place));
            }
            quiet_since = self.secs[place];
        }
        onsets
    }

    /// The onset whose rise crosses the threshold at an index; `None` if it is too small or lies in a gap.
    fn onset(&self, place: usize) -> Option<Onset> {
        let begin = self.begin(place)?;
        let ends_secs = self.secs[place] + RISE_SECS.max(2.5 * self.interval_secs);
        let near = self.secs[place..].iter().take_while(|secs| **secs <= ends_secs);
        let event = &self.deviations[..place + near.count()];
        let height = event[place..].iter().copied().fold(0.0, f64::max);
        let end = (place..event.len()).find(|k| {
            event[*k] >= PEAK_SHARE * height
                && event.get(k + 1).is_none_or(|next| *next <= event[*k])
        })?;
        let gap_secs = self.secs[begin + 1] - self.secs[begin];
        let is_clear = height >= LEAST_SHARE && gap_secs <= GAP_INTERVALS * self.interval_secs;
        is_clear.then(|| Onset {
            at_secs: self.secs[begin + 1] + self.interval_secs * self.part(begin + 1),
            half_span_secs: (self.secs[end] - self.secs[begin]) / 2.0 + self.interval_secs / 4.0,
            height,
        })
    }

    /// The time of the onset within the sampling period of the event's first sample, relative to its middle
    /// [-0.5..0.5].
    ///
    /// A step fills the rest of the period, so the first sample's share of the step gives the exact time if the sensor
    /// averages over the period; if it samples an instant, a full share shows only that the step came before the
    /// sample. The shorter an event, the less its share shows, and the better the middle is as an estimate.
    fn part(&self, first: usize) -> f64 {
        let [at, next, then] =
            [0, 1, 2].map(|k| self.deviations.get(first + k).copied().unwrap_or(0.0));
        let lasts = (next.min(then) / at.max(next)).clamp(0.0, 1.0);
        let share = if next > 0.0 { (at / next).min(1.0) } else { 1.0 };
        lasts.max(LEAST_LASTS) * (0.5 - share)
    }

    /// The index of the last quiet sample before the one that crosses the threshold.
    fn begin(&self, place: usize) -> Option<usize> {
        let is_rising = |k: &usize| {
            self.deviations[*k] > self.quiet && self.deviations[*k] < self.deviations[k + 1]
        };
        let rising = (0..place).rev().take_while(is_rising).count();
        place.checked_sub(rising + 1)
    }
}

/// The median of deviations, and their median absolute deviation scaled to a standard deviation.
fn spread(deviations: &[f64]) -> (f64, f64) {
    let mut sorted = deviations.to_vec();
    let middle = median(&mut sorted);
    for deviation in &mut sorted {
        *deviation = (*deviation - middle).abs();
    }
    (middle, 1.4826 * median(&mut sorted))
}

/// The upper median; 0 for an empty slice. Reorders the values.
fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

fn secs_since(origin: i64, time: i64) -> f64 {
    time.saturating_sub(origin) as f64 / 1e9
}
