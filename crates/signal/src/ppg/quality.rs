//! Signal quality of a PPG.

use super::clean::checked_ppg_rate_hz;
use super::judge::{REFRACTORY_SECS, refractory_secs};
use super::pulse::Pulse;
use super::pulses::Shaped;
use super::runs::{Living, Runs};
use super::smoothed::{Part, Smoothed};
use super::template::Template;
use crate::robust::median_in_place;

/// The quality below which cycles are flagged: motion, noise, a detached sensor.
pub const LEAST_QUALITY: f64 = 0.8;
/// The longest time between two pulses [s]: 30 a minute.
const LONGEST_SECS: f64 = 2.0;
/// The longest cycle without a following pulse, as a multiple of the usual one.
const LONGEST_CYCLES: f64 = 1.5;
/// The shortest cycle, as a share of the usual one.
const SHORTEST_CYCLES: f64 = 0.5;
/// The plausible amplitudes, relative to the usual one.
const AMPLITUDES: std::ops::RangeInclusive<f64> = 0.3..=3.0;
/// The steepest plausible slope, relative to usual pulses.
const STEEPEST: f64 = 2.0;
/// The number of cycles on either side whose median limits the quality of a cycle.
const NEIGHBOURS: usize = 2;
/// The fewest pulses for a judgement.
const LEAST_PULSES: usize = 3;

/// One cycle of the pulse, from its onset to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    /// The onset of the pulse [samples].
    pub begin: f64,
    /// The onset of the next pulse [samples], or 1.5 usual cycles later if that comes first.
    pub end: f64,
    /// The quality of the cycle [0..1].
    pub quality: f64,
    /// Whether another pulse follows at the end of the cycle.
    pub is_followed: bool,
}

/// Signal quality of a PPG, cycle by cycle.
///
/// The quality of a cycle is similarity · living share, or 0 if the cycle is implausible:
/// - similarity is the correlation of the pulse, from 0.4 usual cycles before its peak to 0.6 after it, with
///   the median pulse, both detrended, and not below 0 (after Orphanidou et al. 2015,
///   doi:10.1109/JBHI.2014.2338351); for more than 64 pulses, the median is taken over every second, third, …
///   one;
/// - the living share is the share of samples that are usable numbers and not flat (constant for more than 0.2
///   s: a detached sensor, or saturation);
/// - a cycle is implausible if it is shorter than 0.27 s or half of the usual one, its amplitude is below 0.3
///   or above 3 usual ones, it has a step between samples of more than twice the steepest of a usual rise, or
///   it stays at the highest or lowest value of the signal for more than 0.08 s (saturation). The usual values
///   are medians.
///
/// The quality of a cycle is limited to the median over it and the two cycles before and after it, if that median is
/// flagged. Where there is no cycle, the quality is 0. Limits: when more than half of the pulses are motion, motion is
/// taken for usual; motion as regular as a pulse (the steps of a runner) looks like one. Extrasystoles lower the
/// quality.
#[derive(Clone, Debug, PartialEq)]
pub struct Quality {
    cycles: Vec<Cycle>,
}

impl Quality {
    /// Assesses the quality of a signal at 20 to 2000 Hz, given its pulses in order. With fewer than three pulses, all
    /// of the signal is poor. `None` for another rate, and without a usable sample.
    pub fn of(signal: &[f64], rate_hz: f64, pulses: &[Pulse]) -> Option<Quality> {
        checked_ppg_rate_hz(rate_hz).ok()?;
        let smoothed = Smoothed::of(signal, rate_hz);
        let part = smoothed.part(0..signal.len());
        let living = Runs::of(signal, rate_hz).living(0..signal.len(), signal.iter().copied());
        let numbered = pulses.iter().enumerate();
        let shaped = numbered.map(|(number, &pulse)| Shaped::of(&part, number, 0, pulse));
        let shaped: Vec<Shaped> = shaped.collect();
        (!smoothed.held().is_empty()).then(|| Quality::over(rate_hz, &part, &living, &shaped))
    }

    /// The quality of a part of a smoothed signal with its pulses.
    pub(super) fn over(
        rate_hz: f64,
        signal: &Part<'_>,
        living: &Living,
        pulses: &[Shaped],
    ) -> Quality {
        if pulses.len() < LEAST_PULSES {
            return Quality { cycles: Vec::new() };
        }
        let usual = Usual::of(rate_hz, signal, pulses);
        let is_too_near = |one: &Shaped, other: &Shaped| {
            let gap = other.pulse.sample - one.pulse.sample;
            gap < SHORTEST_CYCLES * usual.cycle
                || gap / rate_hz < refractory_secs(usual.cycle / rate_hz)
        };
        let cycle = |(index, shaped): (usize, &Shaped)| {
            let (pulse, next) = (&shaped.pulse, pulses.get(index + 1));
            let longest = pulse.onset + LONGEST_CYCLES * usual.cycle;
            let longest = longest.min(living.samples.end as f64);
            let end = next.map(|next| next.pulse.onset).filter(|&onset| onset <= longest);
            let (begin, is_followed) = (pulse.onset, end.is_some());
            let end = end.unwrap_or(longest).max(begin);
            let steepest = shaped.cycle_step.filter(|_| is_followed);
            let steepest = steepest.unwrap_or_else(|| signal.steepest(begin, end));
            let is_plausible = !next.is_some_and(|next| is_too_near(shaped, next))
                && AMPLITUDES.contains(&(pulse.amplitude / usual.amplitude));
            let is_whole = !living.is_saturated(begin, end) && steepest <= usual.steepest;
            let likeness = || usual.template.likeness(signal, pulse.sample).max(0.0);
            let quality =
                if is_plausible && is_whole { likeness() * living.share(begin, end) } else { 0.0 };
            Cycle { begin, end, quality, is_followed }
        };
        let cycles = pulses.iter().enumerate().map(cycle).collect();
        Quality { cycles: without_luck(cycles) }
    }

    /// The cycles in order; none with fewer than three pulses.
    pub fn cycles(&self) -> &[Cycle] {
        &self.cycles
    }

    /// Sets the quality of cycles with other evidence against them to 0.
    pub(super) fn discard(&mut self, is_poor: impl Fn(&Cycle) -> bool) {
        self.cycles.iter_mut().filter(|cycle| is_poor(cycle)).for_each(|cycle| cycle.quality = 0.0);
    }

    /// The mean quality between two samples [0..1].
    pub fn mean(&self, begin: f64, end: f64) -> f64 {
        self.share(begin, end, |cycle| cycle.quality)
    }

    /// The share of the time between two samples that is flagged [0..1].
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

/// Usual values of the pulses in a part of a signal.
struct Usual {
    /// The usual cycle [samples].
    cycle: f64,
    amplitude: f64,
    /// The largest plausible step between samples.
    steepest: f64,
    template: Template,
}

impl Usual {
    fn of(rate_hz: f64, signal: &Part<'_>, pulses: &[Shaped]) -> Usual {
        let gaps = pulses.windows(2).map(|pair| pair[1].pulse.sample - pair[0].pulse.sample);
        let cycle = median_of(gaps).clamp(REFRACTORY_SECS * rate_hz, LONGEST_SECS * rate_hz);
        Usual {
            cycle,
            amplitude: median_of(pulses.iter().map(|shaped| shaped.pulse.amplitude)),
            steepest: STEEPEST * median_of(pulses.iter().map(|shaped| shaped.rise_step)),
            template: Template::of(signal, pulses, cycle),
        }
    }
}

/// The median of the finite values; 0 without any.
fn median_of(values: impl Iterator<Item = f64>) -> f64 {
    let mut finite: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    median_in_place(&mut finite).unwrap_or(0.0)
}

/// Limits the quality of cycles to the median around them, where that is poor.
fn without_luck(mut cycles: Vec<Cycle>) -> Vec<Cycle> {
    let qualities: Vec<f64> = cycles.iter().map(|cycle| cycle.quality).collect();
    for (index, cycle) in cycles.iter_mut().enumerate() {
        let near = index.saturating_sub(NEIGHBOURS)..(index + NEIGHBOURS + 1).min(qualities.len());
        let mut around = [0.0; 2 * NEIGHBOURS + 1];
        let around = &mut around[..near.len()];
        around.copy_from_slice(&qualities[near]);
        let around = median_in_place(around).unwrap_or(0.0);
        let limit = if around < LEAST_QUALITY { around } else { 1.0 };
        cycle.quality = cycle.quality.min(limit);
    }
    cycles
}
