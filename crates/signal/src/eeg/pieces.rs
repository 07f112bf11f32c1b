//! The segments of all channels, averaged over windows.

use std::collections::VecDeque;
use std::ops::Range;

use super::examiner::Examiner;
use super::lines::free_of_lines;
use super::quality::{LEAST_QUALITY, Quality};
use crate::analysis::{LEAST_COVERAGE, Reason, Span};
use crate::spectrum::Spectrum;

/// Spectra and qualities, by segment and channel.
pub(super) struct Pieces {
    channels: usize,
    frequencies_hz: Vec<f64>,
    length: f64,
    step: f64,
    rate_hz: f64,
    most_rms_uv: f64,
    /// The times of the first and the last sample of each segment [ns].
    times_ns: VecDeque<(i64, i64)>,
    powers: VecDeque<f64>,
    qualities: VecDeque<f64>,
}

/// The average over a channel's segments in a span.
pub(super) struct Reading {
    /// The average spectrum, or why it is missing.
    pub(super) spectrum: Result<Spectrum, Reason>,
    /// The share of the span's segments that have data [0..1].
    pub(super) present: f64,
    /// The share of the span's segments that have data and are not artefacts [0..1].
    pub(super) coverage: f64,
    /// The mean quality of all segments, times how free of [lines](free_of_lines) their mean spectrum is [0..1].
    pub(super) quality: f64,
    /// The mean quality of all segments regardless of lines [0..1].
    pub(super) segments_quality: f64,
}

impl Pieces {
    /// Creates a store for segments examined by `examiner`; segments above `most_rms_uv` [µV] count as artefacts.
    pub(super) fn new(
        examiner: &Examiner,
        rate_hz: f64,
        channels: usize,
        most_rms_uv: f64,
    ) -> Pieces {
        Pieces {
            channels,
            frequencies_hz: (0..examiner.bins()).map(|bin| examiner.frequency_hz(bin)).collect(),
            length: examiner.length() as f64,
            step: examiner.step() as f64,
            rate_hz,
            most_rms_uv,
            times_ns: VecDeque::new(),
            powers: VecDeque::new(),
            qualities: VecDeque::new(),
        }
    }

    /// Begins a segment; [`add`](Self::add) must follow, once per channel.
    pub(super) fn begin(&mut self, begin_ns: i64, end_ns: i64) {
        self.times_ns.push_back((begin_ns, end_ns));
    }

    /// Adds the next channel of the segment, as just examined.
    pub(super) fn add(&mut self, quality: Quality, power: &[f64]) {
        let is_too_high = quality.rms_uv > self.most_rms_uv;
        self.qualities.push_back(if is_too_high { 0.0 } else { quality.combined() });
        self.powers.extend(power);
    }

    /// Drops the segments that begin before a time [ns].
    pub(super) fn forget(&mut self, before_ns: i64) {
        let gone = self.times_ns.partition_point(|&(begin_ns, _)| begin_ns < before_ns);
        self.times_ns.drain(..gone);
        self.qualities.drain(..gone * self.channels);
        self.powers.drain(..gone * self.channels * self.frequencies_hz.len());
    }

    /// The segments that lie within a span.
    pub(super) fn within(&self, span: Span) -> Range<usize> {
        let begin = self.times_ns.partition_point(|&(begin_ns, _)| begin_ns < span.begin_ns);
        let end = self.times_ns.partition_point(|&(_, end_ns)| end_ns < span.end_ns);
        begin..end.max(begin)
    }

    /// The average over a channel's segments within a span, without rejected ones.
    pub(super) fn read(
        &self,
        channel: usize,
        span: Span,
        is_left_out: &dyn Fn((i64, i64)) -> bool,
    ) -> Reading {
        let pieces = self.within(span);
        let count = pieces.len() as f64;
        let (mut sum, mut kept, mut present) = (vec![0.0; self.frequencies_hz.len()], 0, 0);
        let mut qualities = 0.0;
        for piece in pieces {
            let place = piece * self.channels + channel;
            let quality = self.qualities[place];
            let power = self.powers.range(place * sum.len()..(place + 1) * sum.len());
            qualities += quality;
            let is_there = power.clone().next().is_some_and(|power| power.is_finite());
            present += usize::from(is_there);
            if is_there && quality >= LEAST_QUALITY && !is_left_out(self.times_ns[piece]) {
                kept += 1;
                sum.iter_mut().zip(power).for_each(|(sum, power)| *sum += power);
            }
        }
        let share = |part: usize| (part as f64 / self.expected(span).max(1.0)).min(1.0);
        let (present, coverage) = (share(present), share(kept));
        let reason = match () {
            () if count < 1.0 && self.expected(span) < 1.0 => Some(Reason::Short),
            () if coverage >= LEAST_COVERAGE => None,
            () if present >= LEAST_COVERAGE => Some(Reason::Quality),
            () => Some(Reason::Gap),
        };
        let segments_quality = if count > 0.0 { qualities / count } else { 0.0 };
        let spectrum = match reason {
            Some(reason) => Err(reason),
            None => Ok(self.average(sum, kept)),
        };
        let quality = segments_quality * spectrum.as_ref().map_or(1.0, free_of_lines);
        Reading { spectrum, present, coverage, quality, segments_quality }
    }

    fn average(&self, mut sum: Vec<f64>, segments: usize) -> Spectrum {
        for power in &mut sum {
            *power /= segments as f64;
        }
        Spectrum { frequencies_hz: self.frequencies_hz.clone(), power: sum, segments }
    }

    /// The minimum number of segments in a gap-free span, wherever they begin.
    fn expected(&self, span: Span) -> f64 {
        let samples = (span.secs() * self.rate_hz).round();
        ((samples - self.length - self.step + 1.0) / self.step).floor() + 1.0
    }
}

/// The mean of several spectra with the same bins, or the reason why all are missing.
pub(super) fn mean(readings: &[Reading]) -> Result<Spectrum, Reason> {
    let found: Vec<&Spectrum> =
        readings.iter().filter_map(|reading| reading.spectrum.as_ref().ok()).collect();
    let Some((first, others)) = found.split_first() else {
        let reasons: Vec<Reason> = readings
            .iter()
            .filter_map(|reading| reading.spectrum.as_ref().err().copied())
            .collect();
        let is_poor = reasons.contains(&Reason::Quality);
        let first = reasons.first().copied().unwrap_or(Reason::Missing);
        return Err(if is_poor { Reason::Quality } else { first });
    };
    let mut mean = Spectrum::clone(first);
    for other in others {
        mean.power.iter_mut().zip(&other.power).for_each(|(sum, power)| *sum += power);
    }
    for power in &mut mean.power {
        *power /= found.len() as f64;
    }
    Ok(mean)
}
