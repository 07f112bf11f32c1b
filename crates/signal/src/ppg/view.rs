//! What is seen of a span of a PPG.

use super::pulse::Pulse;
use super::quality::{LEAST_QUALITY, Living, Quality};
use super::shape::Wave;
use super::smooth::Smoothing;
use super::template::Line;
use crate::analysis::{Reason, Span, Track};
use crate::gaps::{bridged, is_usable};
use crate::hrv::BEFORE_SECS;
use crate::respiration::derived::{Beat, BreathingWindows};
use crate::robust::median;

/// Pulses of the newest samples are not known yet [s].
const UNKNOWN_SECS: f64 = 0.5;
/// With fewer intervals or pulses there is no mean worth telling.
const LEAST_COUNT: usize = 3;
/// Light that pulses more than this [%] has lost its constant part in the device.
const MOST_PERFUSION_PERCENT: f64 = 20.0;
/// Pieces whose skewness is taken [s].
const PIECE_SECS: f64 = 5.0;

/// A span and the minute before it, in which places count from its first sample.
pub(super) struct View {
    /// The number of its first sample.
    pub(super) begin: usize,
    pub(super) quality: Quality,
    rate_hz: f64,
    raw: Vec<f64>,
    smoothed: Vec<f64>,
    living: Living,
    pulses: Vec<(i64, Pulse)>,
    /// Where the span itself begins.
    inside: usize,
    /// Up to where pulses are known.
    known: f64,
}

/// What is told of a span whatever its quality.
pub(super) struct OfSignal {
    pub(super) quality: f64,
    pub(super) flagged: f64,
    flat: f64,
    skewness: Result<f64, Reason>,
    pulses: usize,
}

impl OfSignal {
    pub(super) fn values(self) -> Vec<Result<f64, Reason>> {
        let pulses = self.pulses as f64;
        vec![Ok(pulses), Ok(self.quality), Ok(self.flagged), Ok(self.flat), self.skewness]
    }
}

impl View {
    /// `None` without a usable sample. Pulses are those of the span and the minute before it.
    pub(super) fn of(
        signal: &Track,
        span: Span,
        smoothing: &Smoothing,
        pulses: impl Iterator<Item = (i64, Pulse)>,
    ) -> Option<View> {
        let rate_hz = signal.rate_hz();
        let places = signal.samples_in(span.with_before(BEFORE_SECS));
        let begin = places.start;
        let inside = signal.samples_in(span).start.saturating_sub(begin);
        let raw = signal.values(places);
        let smoothed = smoothing.smoothed(&bridged(&raw).ok()?);
        let wave = Wave { smoothed: &smoothed, rate_hz };
        let pulses: Vec<(i64, Pulse)> = measured(&wave, pulses, begin).collect();
        let living = Living::of(&raw, rate_hz);
        let alone: Vec<Pulse> = pulses.iter().map(|pulse| pulse.1).collect();
        let quality = Quality::over(&wave, &living, &alone);
        let known = signal.held().end as f64 - UNKNOWN_SECS * rate_hz - begin as f64;
        let known = (raw.len() as f64).min(known).max(inside as f64 + 1.0);
        Some(View { begin, quality, rate_hz, raw, smoothed, living, pulses, inside, known })
    }

    /// When the pulses of good cycles were [ns].
    pub(super) fn good_pulses(&self) -> impl Iterator<Item = i64> {
        self.good().map(|index| self.pulses[index].0)
    }

    /// Times between good pulses that do not follow each other [ns].
    pub(super) fn holes(&self) -> impl Iterator<Item = (i64, i64)> {
        let ends = self.good().zip(self.good().skip(1));
        ends.filter(|&(one, other)| !self.follow(one, other))
            .map(|(one, other)| (self.pulses[one].0, self.pulses[other].0))
    }

    fn good(&self) -> impl Iterator<Item = usize> {
        let cycles = self.quality.cycles().iter().enumerate();
        cycles.filter(|(_, cycle)| cycle.quality >= LEAST_QUALITY).map(|(index, _)| index)
    }

    fn follow(&self, one: usize, other: usize) -> bool {
        one + 1 == other && self.quality.cycles()[one].is_followed
    }

    /// The good pulses of the span itself.
    fn good_inside(&self) -> Vec<usize> {
        self.good().filter(|&index| self.pulses[index].1.sample >= self.inside as f64).collect()
    }

    pub(super) fn of_signal(&self) -> OfSignal {
        let (begin, end) = (self.inside as f64, self.raw.len() as f64);
        OfSignal {
            quality: self.quality.mean(begin, self.known),
            flagged: self.quality.flagged(begin, self.known),
            flat: 1.0 - self.living.share(begin, end),
            skewness: skewness(&self.smoothed[self.inside..], self.rate_hz),
            pulses: self.good_inside().len(),
        }
    }

    /// Rates, shapes and breathing, in the order of the values.
    pub(super) fn of_pulses(
        &self,
        span: Span,
        breathing: &BreathingWindows,
    ) -> Vec<Result<f64, Reason>> {
        let good = self.good_inside();
        let gap_ms = |pair: &[usize]| {
            let samples = self.pulses[pair[1]].1.sample - self.pulses[pair[0]].1.sample;
            self.follow(pair[0], pair[1]).then_some(samples / self.rate_hz * 1e3)
        };
        let gaps_ms: Vec<f64> = good.windows(2).filter_map(gap_ms).collect();
        let rates: Vec<f64> = gaps_ms.iter().map(|gap_ms| 60_000.0 / gap_ms).collect();
        let all = |of: fn(&Pulse) -> f64| -> Vec<f64> {
            good.iter().map(|&index| of(&self.pulses[index].1)).filter(|x| x.is_finite()).collect()
        };
        let amplitudes = all(|pulse| pulse.amplitude);
        vec![
            average(&gaps_ms).map(|mean_ms| 60_000.0 / mean_ms),
            sd(&rates),
            average(&gaps_ms),
            average(&amplitudes),
            sd(&amplitudes),
            average(&all(|pulse| pulse.rise_ms)),
            average(&all(|pulse| pulse.width_ms)),
            self.perfusion_percent(&amplitudes),
            breathing
                .measure(good.iter().map(|&index| self.beat(index)), span)
                .map(|derived| derived.rate_per_min.value),
        ]
    }

    fn perfusion_percent(&self, amplitudes: &[f64]) -> Result<f64, Reason> {
        if amplitudes.len() < LEAST_COUNT {
            return Err(Reason::Short);
        }
        let inside = self.raw[self.inside..].iter().copied();
        let constant = average(&inside.filter(|&value| is_usable(value)).collect::<Vec<_>>())?;
        let percent = 100.0 * median(amplitudes).ok_or(Reason::Short)? / constant.abs();
        if percent <= MOST_PERFUSION_PERCENT { Ok(percent) } else { Err(Reason::Missing) }
    }

    /// A pulse with its amplitude and its baseline.
    fn beat(&self, index: usize) -> Beat {
        let (at_ns, pulse) = self.pulses[index];
        let place = pulse.sample.round().max(0.0) as usize;
        let baseline = self.smoothed.get(place).map_or(f64::NAN, |top| top - pulse.amplitude);
        Beat { at_ns, heights: [pulse.amplitude, baseline] }
    }
}

/// Pulses placed among the smoothed samples from `begin` on, and measured there.
fn measured(
    wave: &Wave<'_>,
    pulses: impl Iterator<Item = (i64, Pulse)>,
    begin: usize,
) -> impl Iterator<Item = (i64, Pulse)> {
    let mut floor = 0;
    pulses.filter_map(move |(at_ns, pulse)| {
        let sample = pulse.sample - begin as f64;
        let peak = sample.round().max(0.0) as usize;
        let measured = wave.pulse_at(peak, floor.min(peak))?;
        floor = peak;
        let rise_ms = (sample - measured.onset) / wave.rate_hz * 1e3;
        Some((at_ns, Pulse { sample, rise_ms, ..measured }))
    })
}

fn average(values: &[f64]) -> Result<f64, Reason> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    if values.len() < LEAST_COUNT { Err(Reason::Short) } else { Reason::unless_finite(mean) }
}

fn sd(values: &[f64]) -> Result<f64, Reason> {
    let mean = average(values)?;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    Reason::unless_finite((squares / (values.len() as f64 - 1.0)).sqrt())
}

/// Elgendi (2016), doi:10.3390/bioengineering3040021.
fn skewness(smoothed: &[f64], rate_hz: f64) -> Result<f64, Reason> {
    let length = (PIECE_SECS * rate_hz).round().max(1.0) as usize;
    let pieces = smoothed.chunks_exact(length).map(skewness_of_piece);
    let skewness = median(&pieces.collect::<Vec<_>>());
    skewness.ok_or(if smoothed.len() < length { Reason::Short } else { Reason::Undefined })
}

fn skewness_of_piece(piece: &[f64]) -> f64 {
    let line = Line::through(piece);
    let (mut squares, mut cubes) = (0.0, 0.0);
    for (place, &value) in piece.iter().enumerate() {
        let away = line.above(place, value);
        squares += away * away;
        cubes += away * away * away;
    }
    let count = piece.len() as f64;
    (cubes / count) / (squares / count).powf(1.5)
}
