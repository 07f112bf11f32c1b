//! How far pulse waves can be relied on.

use super::clean::checked_ppg_rate_hz;
use super::judge::REFRACTORY_SECS;
use super::pulse::Pulse;
use super::shape::Wave;
use super::smooth::Smoothing;
use super::template::Template;
use crate::gaps::{bridged, is_usable};
use crate::robust::median;

/// Cycles below this quality are flagged: motion, noise, a sensor that came off.
pub const LEAST_QUALITY: f64 = 0.8;
/// The longest time between two pulses [s]: 30 a minute.
const LONGEST_SECS: f64 = 2.0;
/// A cycle ends after so many usual ones when no pulse follows.
const LONGEST_CYCLES: f64 = 1.5;
/// A cycle shorter than this share of the usual one is none.
const SHORTEST_CYCLES: f64 = 0.5;
/// Amplitudes outside of this many usual ones are no pulse's.
const AMPLITUDES: std::ops::RangeInclusive<f64> = 0.3..=3.0;
/// Steeper than so many usual pulses the signal does not rise or fall.
const STEEPEST: f64 = 2.0;
/// A signal that stays the same for longer is flat [s].
const FLAT_SECS: f64 = 0.2;
/// One that stays at its highest or lowest value for longer is at the end of the sensor's range [s].
const SATURATED_SECS: f64 = 0.08;
/// How many cycles before and after one tell whether it is good by luck only.
const NEIGHBOURS: usize = 2;
/// With fewer pulses nothing can be said.
const LEAST_PULSES: usize = 3;

/// One cycle of the pulse, from its onset to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    /// Onset of the pulse [samples].
    pub begin: f64,
    /// Onset of the next one [samples]; where there is none for 1.5 usual cycles, the end of these.
    pub end: f64,
    /// How far it can be relied on [0..1].
    pub quality: f64,
    /// Whether another pulse follows at its end.
    pub is_followed: bool,
}

/// Signal quality of a PPG, cycle by cycle.
///
/// Quality of a cycle: likeness · living share, 0 where it is implausible. Here
/// - likeness is the correlation of the pulse, from 0.4 usual cycles before its peak to 0.6
///   after it, with the median pulse, straight lines taken out of both, and not below 0 (after
///   Orphanidou et al. 2015, doi:10.1109/JBHI.2014.2338351);
/// - the living share is that of samples that are usable numbers and not flat (the same for more
///   than 0.2 s: a sensor that came off, or saturation);
/// - implausible is a cycle under 0.27 s or half of the usual one, an amplitude below 0.3 or above 3
///   usual ones, a step from sample to sample above twice the steepest of a usual rise, and one that
///   stays at the highest or lowest value of the signal for more than 0.08 s (saturation). Usual is
///   the median.
///
/// Where the median of a cycle and the two before and after it is flagged, it counts no more than that.
/// Where there is no
/// cycle, the quality is 0. Limits: when more than half of the pulses are motion, motion is usual; a
/// motion as regular as a pulse (steps of a runner) looks like one. Extrasystoles lower it.
#[derive(Clone, Debug, PartialEq)]
pub struct Quality {
    cycles: Vec<Cycle>,
}

impl Quality {
    /// Of a signal at 20 to 2000 Hz with its pulses, in their order. With fewer than three, all is
    /// poor. `None` for another rate, and without a usable sample.
    pub fn of(signal: &[f64], rate_hz: f64, pulses: &[Pulse]) -> Option<Quality> {
        checked_ppg_rate_hz(rate_hz).ok()?;
        let smoothed = Smoothing::new(rate_hz).smoothed(&bridged(signal).ok()?);
        let wave = Wave { smoothed: &smoothed, rate_hz };
        Some(Quality::over(&wave, &Living::of(signal, rate_hz), pulses))
    }

    pub(super) fn over(wave: &Wave<'_>, living: &Living, pulses: &[Pulse]) -> Quality {
        if pulses.len() < LEAST_PULSES {
            return Quality { cycles: Vec::new() };
        }
        let secs = |samples: f64| samples / wave.rate_hz;
        let gaps: Vec<f64> =
            pulses.windows(2).map(|pair| pair[1].sample - pair[0].sample).collect();
        let usual = median(&gaps).unwrap_or(0.0);
        let usual = usual.clamp(REFRACTORY_SECS * wave.rate_hz, LONGEST_SECS * wave.rate_hz);
        let amplitudes: Vec<f64> = pulses.iter().map(|pulse| pulse.amplitude).collect();
        let usual_amplitude = median(&amplitudes).unwrap_or(0.0);
        let steepest: Vec<f64> =
            pulses.iter().map(|pulse| wave.steepest(pulse.onset, pulse.sample)).collect();
        let steepest_usual = STEEPEST * median(&steepest).unwrap_or(0.0);
        let template = Template::of(wave.smoothed, pulses, usual);
        let cycle = |(index, pulse): (usize, &Pulse)| {
            let longest = (pulse.onset + LONGEST_CYCLES * usual).min(wave.smoothed.len() as f64);
            let next = pulses.get(index + 1).map(|next| next.onset);
            let end = next.filter(|&onset| onset <= longest);
            let is_short = gaps
                .get(index)
                .is_some_and(|&gap| gap < SHORTEST_CYCLES * usual || secs(gap) < REFRACTORY_SECS);
            let is_plausible =
                !is_short && AMPLITUDES.contains(&(pulse.amplitude / usual_amplitude));
            let (begin, is_followed) = (pulse.onset, end.is_some());
            let end = end.unwrap_or(longest).max(begin);
            let likeness = template.likeness(wave.smoothed, pulse.sample).max(0.0);
            let is_whole =
                !living.is_saturated(begin, end) && wave.steepest(begin, end) <= steepest_usual;
            let quality =
                if is_plausible && is_whole { likeness * living.share(begin, end) } else { 0.0 };
            Cycle { begin, end, quality, is_followed }
        };
        let cycles = pulses.iter().enumerate().map(cycle).collect();
        Quality { cycles: without_luck(cycles) }
    }

    /// The cycles, in the order of the pulses; none for fewer than three pulses.
    pub fn cycles(&self) -> &[Cycle] {
        &self.cycles
    }

    /// Lowers to 0 the quality of cycles that something else speaks against.
    pub(super) fn discard(&mut self, is_poor: impl Fn(&Cycle) -> bool) {
        self.cycles.iter_mut().filter(|cycle| is_poor(cycle)).for_each(|cycle| cycle.quality = 0.0);
    }

    /// The mean over the time from one sample to another [0..1].
    pub fn mean(&self, begin: f64, end: f64) -> f64 {
        self.share(begin, end, |cycle| cycle.quality)
    }

    /// The share of the time from one sample to another that is flagged [0..1].
    pub fn flagged(&self, begin: f64, end: f64) -> f64 {
        1.0 - self.share(begin, end, |cycle| f64::from(u8::from(cycle.quality >= LEAST_QUALITY)))
    }

    fn share(&self, begin: f64, end: f64, of: impl Fn(&Cycle) -> f64) -> f64 {
        let overlap = |cycle: &Cycle| (cycle.end.min(end) - cycle.begin.max(begin)).max(0.0);
        let sum: f64 = self.cycles.iter().map(|cycle| overlap(cycle) * of(cycle)).sum();
        let share = sum / (end - begin);
        if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
    }
}

/// Lowers the quality of cycles to the median of those around it, where that is poor.
fn without_luck(cycles: Vec<Cycle>) -> Vec<Cycle> {
    let qualities: Vec<f64> = cycles.iter().map(|cycle| cycle.quality).collect();
    let around = |index: usize| {
        let near = index.saturating_sub(NEIGHBOURS)..(index + NEIGHBOURS + 1).min(qualities.len());
        median(&qualities[near]).unwrap_or(0.0)
    };
    let limited = |(index, cycle): (usize, Cycle)| {
        let around = around(index);
        let limit = if around < LEAST_QUALITY { around } else { 1.0 };
        Cycle { quality: cycle.quality.min(limit), ..cycle }
    };
    cycles.into_iter().enumerate().map(limited).collect()
}

/// Which samples are usable and not flat, and which lie at the end of the sensor's range.
pub(super) struct Living {
    /// How many are living up to each.
    living: Vec<usize>,
    /// How many are saturated up to each.
    saturated: Vec<usize>,
}

impl Living {
    pub(super) fn of(signal: &[f64], rate_hz: f64) -> Living {
        let most = |secs: f64| (secs * rate_hz).ceil().max(3.0) as usize;
        let usable = || signal.iter().copied().filter(|&value| is_usable(value));
        let ends =
            [usable().fold(f64::INFINITY, f64::min), usable().fold(-f64::INFINITY, f64::max)];
        let is_same =
            |a: &f64, b: &f64| a.total_cmp(b).is_eq() || !(is_usable(*a) || is_usable(*b));
        let (mut living, mut saturated) = (vec![0], vec![0]);
        let extend = |counts: &mut Vec<usize>, length: usize, counts_now: bool| {
            let (before, step) = (counts[counts.len() - 1], usize::from(counts_now));
            counts.extend((1..=length).map(|each| before + step * each));
        };
        for run in signal.chunk_by(is_same) {
            let (value, length) = (run[0], run.len());
            extend(&mut living, length, is_usable(value) && length <= most(FLAT_SECS));
            let is_at_end = ends.iter().any(|end| end.total_cmp(&value).is_eq());
            extend(&mut saturated, length, is_at_end && length > most(SATURATED_SECS));
        }
        Living { living, saturated }
    }

    /// The share of the samples from one to another that are usable and not flat.
    pub(super) fn share(&self, begin: f64, end: f64) -> f64 {
        let (begin, end) = self.places(begin, end);
        (self.living[end] - self.living[begin]) as f64 / (end - begin).max(1) as f64
    }

    fn is_saturated(&self, begin: f64, end: f64) -> bool {
        let (begin, end) = self.places(begin, end);
        self.saturated[end] > self.saturated[begin]
    }

    fn places(&self, begin: f64, end: f64) -> (usize, usize) {
        let last = self.living.len() - 1;
        let begin = (begin.round().max(0.0) as usize).min(last);
        (begin, (end.round().max(0.0) as usize).clamp(begin, last))
    }
}
