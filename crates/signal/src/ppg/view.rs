//! The data of a span of a PPG.

use super::pieces::Piece;
use super::pulse::Pulse;
use super::pulses::Shaped;
use super::quality::{LEAST_QUALITY, Quality};
use super::runs::Living;
use crate::analysis::{Reason, Span};
use crate::respiration::derived::{Beat, BreathingWindows};
use crate::robust::median;

/// The fewest intervals or pulses for a mean.
const LEAST_COUNT: usize = 3;
/// A higher perfusion index [%] means that the device removed the DC component.
const MOST_PERFUSION_PERCENT: f64 = 20.0;
/// The RMSSD of rises over that of intervals above which intervals may be noise: below it, one RMSSD in fifty was off
/// by more than a fifth, above it one in three (`bench/signal/measure_variability choosing 200`).
const MOST_BLUR: f64 = 0.75;

/// A span and the minute before it; indices count from the first sample of the signal.
pub(super) struct View {
    pub(super) quality: Quality,
    pub(super) rate_hz: f64,
    pub(super) living: Living,
    /// The pulses of the span and the minute before it.
    pub(super) pulses: Vec<Shaped>,
    /// The segments of the span itself.
    pub(super) pieces: Vec<Piece>,
    /// The start of the span itself.
    pub(super) inside: usize,
    /// The end of the part with known pulses.
    pub(super) known: f64,
}

/// The values reported at any quality.
pub(super) struct OfSignal {
    quality: f64,
    flagged: f64,
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
    /// The times of pulses of good cycles in pulse rate variability [ns].
    pub(super) fn good_pulses(&self) -> impl Iterator<Item = i64> {
        self.good().map(|index| self.time_ns(index))
    }

    /// The gaps between good pulses that are not successive [ns].
    pub(super) fn holes(&self) -> impl Iterator<Item = (i64, i64)> {
        let ends = self.good().zip(self.good().skip(1));
        ends.filter(|&(one, other)| !self.follow(one, other))
            .map(|(one, other)| (self.time_ns(one), self.time_ns(other)))
    }

    /// The time of a pulse in pulse rate variability [ns]: noise shifts it less than the peak or the middle of the
    /// rise.
    fn time_ns(&self, index: usize) -> i64 {
        let Shaped { at_ns, pulse, .. } = &self.pulses[index];
        let before_secs = (pulse.sample - pulse.time()) / self.rate_hz;
        at_ns.saturating_sub((before_secs * 1e9).round() as i64)
    }

    /// Whether the differences of successive intervals may come from noise rather than the heart: the times from the
    /// middle of a rise to its peak change nearly as much as the intervals.
    pub(super) fn is_blurred(&self) -> bool {
        let good = self.good_inside();
        let (mut of_rises, mut of_times) = (0.0, 0.0);
        for triple in good.windows(3) {
            if self.follow(triple[0], triple[1]) && self.follow(triple[1], triple[2]) {
                let bend = |of: fn(&Pulse) -> f64| {
                    let [one, two, three] =
                        [0, 1, 2].map(|place| of(&self.pulses[triple[place]].pulse));
                    (one - 2.0 * two + three).powi(2)
                };
                of_rises += bend(|pulse| pulse.sample - pulse.middle);
                of_times += bend(Pulse::time);
            }
        }
        of_rises > MOST_BLUR.powi(2) * of_times
    }

    fn good(&self) -> impl Iterator<Item = usize> {
        let cycles = self.quality.cycles().iter().enumerate();
        cycles.filter(|(_, cycle)| cycle.quality >= LEAST_QUALITY).map(|(index, _)| index)
    }

    fn follow(&self, one: usize, other: usize) -> bool {
        one + 1 == other && self.quality.cycles()[one].is_followed
    }

    /// Successive good pulses of the span.
    pub(super) fn neighbours(&self) -> Vec<(&Shaped, &Shaped)> {
        let good = self.good_inside();
        let pairs = good.windows(2).filter(|pair| self.follow(pair[0], pair[1]));
        pairs.map(|pair| (&self.pulses[pair[0]], &self.pulses[pair[1]])).collect()
    }

    /// The good pulses of the span itself.
    fn good_inside(&self) -> Vec<usize> {
        self.good().filter(|&index| self.is_inside(&self.pulses[index])).collect()
    }

    /// The pulses of the span itself, good or not.
    pub(super) fn pulses_inside(&self) -> Vec<&Pulse> {
        let inside = self.pulses.iter().filter(|shaped| self.is_inside(shaped));
        inside.map(|shaped| &shaped.pulse).collect()
    }

    fn is_inside(&self, shaped: &Shaped) -> bool {
        shaped.pulse.sample >= self.inside as f64
    }

    /// The values reported at any quality, with the quality.
    pub(super) fn of_signal(&self, quality: f64) -> OfSignal {
        let (begin, end) = (self.inside as f64, self.living.samples.end as f64);
        OfSignal {
            quality,
            flagged: self.flagged(),
            flat: 1.0 - self.living.share(begin, end),
            skewness: self.skewness(),
            pulses: self.good_inside().len(),
        }
    }

    /// The share of the span that is flagged.
    pub(super) fn flagged(&self) -> f64 {
        self.quality.flagged(self.inside as f64, self.known)
    }

    /// Rates, shapes and breathing, in the order of the values.
    pub(super) fn of_pulses(
        &self,
        span: Span,
        breathing: &BreathingWindows,
    ) -> Vec<Result<f64, Reason>> {
        let good = self.good_inside();
        let gap_ms = |pair: &[usize]| {
            let samples = self.pulses[pair[1]].pulse.sample - self.pulses[pair[0]].pulse.sample;
            self.follow(pair[0], pair[1]).then_some(samples / self.rate_hz * 1e3)
        };
        let gaps_ms: Vec<f64> = good.windows(2).filter_map(gap_ms).collect();
        let rates: Vec<f64> = gaps_ms.iter().map(|gap_ms| 60_000.0 / gap_ms).collect();
        let all = |of: fn(&Pulse) -> f64| -> Vec<f64> {
            good.iter()
                .map(|&index| of(&self.pulses[index].pulse))
                .filter(|x| x.is_finite())
                .collect()
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
        if amplitudes.len() < LEAST_COUNT || self.pieces.is_empty() {
            return Err(Reason::Short);
        }
        let level: f64 = self.pieces.iter().map(|piece| piece.mean).sum();
        let constant = level / self.pieces.len() as f64;
        let percent = 100.0 * median(amplitudes).ok_or(Reason::Short)? / constant.abs();
        if percent <= MOST_PERFUSION_PERCENT { Ok(percent) } else { Err(Reason::Missing) }
    }

    /// The skewness of the signal: Elgendi (2016), doi:10.3390/bioengineering3040021.
    pub(super) fn skewness(&self) -> Result<f64, Reason> {
        let pieces: Vec<f64> = self.pieces.iter().map(|piece| piece.skewness).collect();
        let nothing = if pieces.is_empty() { Reason::Short } else { Reason::Undefined };
        median(&pieces).ok_or(nothing)
    }

    fn beat(&self, index: usize) -> Beat {
        let shaped = &self.pulses[index];
        Beat { at_ns: shaped.at_ns, heights: [shaped.pulse.amplitude, shaped.baseline] }
    }
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
