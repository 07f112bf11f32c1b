//! The pulses of a signal, measured as soon as enough of it is known.

use std::collections::VecDeque;

use super::pulse::Pulse;
use super::shape::{LONGEST_FALL_SECS, Wave};
use super::smoothed::{Part, Smoothed};
use crate::analysis::Span;

/// The part examined before a peak [s]; no rise is longer.
const BEFORE_SECS: f64 = 1.0;

/// A pulse with its shape in the smoothed signal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shaped {
    /// The index of the pulse.
    pub(super) number: usize,
    /// The time of the peak [ns].
    pub(super) at_ns: i64,
    pub(super) pulse: Pulse,
    /// The height of the peak minus the pulse's amplitude.
    pub(super) baseline: f64,
    /// The largest step between samples of the rise.
    pub(super) rise_step: f64,
    /// The largest step between samples up to the onset of the next pulse, if known.
    pub(super) cycle_step: Option<f64>,
}

impl Shaped {
    /// The shape of a pulse that was measured in a signal.
    pub(super) fn of(signal: &Part<'_>, number: usize, at_ns: i64, pulse: Pulse) -> Shaped {
        let peak = pulse.sample.round().max(0.0) as usize;
        let top = signal.values(peak..peak.saturating_add(1)).first().copied().unwrap_or(f64::NAN);
        Shaped {
            number,
            at_ns,
            pulse,
            baseline: top - pulse.amplitude,
            rise_step: signal.steepest(pulse.onset, pulse.sample),
            cycle_step: None,
        }
    }
}

/// A pulse as detected.
#[derive(Clone, Copy, Debug)]
struct Found {
    number: usize,
    at_ns: i64,
    sample: f64,
    /// The sample of the previous peak.
    floor: usize,
}

impl Found {
    fn peak(&self) -> usize {
        self.sample.round().max(0.0) as usize
    }

    /// Measures the pulse; `None` outside the part of the signal that is held.
    fn shaped(&self, signal: &Smoothed) -> Option<Shaped> {
        let rate_hz = signal.rate_hz();
        // The start is independent of the part held, so that rounding is, too.
        let begin = self.peak().saturating_sub((BEFORE_SECS * rate_hz) as usize);
        let around = signal.part(begin..signal.held().end);
        let wave = Wave { smoothed: around.values, rate_hz };
        let peak = self.peak().checked_sub(around.begin)?;
        let measured = wave.pulse_at(peak, self.floor.saturating_sub(around.begin).min(peak))?;
        let measured = measured.later_by(around.begin as f64);
        let rise_ms = (self.sample - measured.onset) / rate_hz * 1e3;
        let pulse = Pulse { sample: self.sample, rise_ms, ..measured };
        Some(Shaped::of(&around, self.number, self.at_ns, pulse))
    }

    /// Whether no later sample can change the shape of the pulse.
    fn is_settled(&self, signal: &Smoothed) -> bool {
        let reach = (LONGEST_FALL_SECS * signal.rate_hz()).ceil() as usize + 1;
        self.peak() + reach < signal.held().end
    }
}

/// The pulses of a signal, in order.
#[derive(Clone, Debug, Default)]
pub(super) struct Pulses {
    count: usize,
    last: Option<f64>,
    settled: VecDeque<Shaped>,
    newest: VecDeque<Found>,
}

impl Pulses {
    /// Takes in a pulse with its peak at a sample; returns the sample of the one before it.
    pub(super) fn push(&mut self, at_ns: i64, sample: f64) -> Option<f64> {
        let before = self.last.replace(sample);
        let floor = before.map_or(0, |before| before.round().max(0.0) as usize);
        self.newest.push_back(Found { number: self.count, at_ns, sample, floor });
        self.count += 1;
        before
    }

    /// Measures the pulses for which enough signal has arrived.
    pub(super) fn settle(&mut self, signal: &Smoothed) {
        while self.newest.front().is_some_and(|found| found.is_settled(signal)) {
            let shaped = self.newest.pop_front().and_then(|found| found.shaped(signal));
            let Some(shaped) = shaped else { continue };
            if let Some(before) = self.settled.back_mut() {
                let steepest = signal.part(signal.held());
                before.cycle_step = Some(steepest.steepest(before.pulse.onset, shaped.pulse.onset));
            }
            self.settled.push_back(shaped);
        }
    }

    /// Drops the pulses before a time [ns].
    pub(super) fn forget(&mut self, before_ns: i64) {
        while self.settled.front().is_some_and(|shaped| shaped.at_ns < before_ns) {
            self.settled.pop_front();
        }
        while self.newest.front().is_some_and(|found| found.at_ns < before_ns) {
            self.newest.pop_front();
        }
    }

    /// The pulses of a span, the newest as far as the signal is known.
    pub(super) fn within(&self, span: Span, signal: &Smoothed) -> Vec<Shaped> {
        let place = |at_ns: i64| self.settled.partition_point(|shaped| shaped.at_ns < at_ns);
        let settled = place(span.begin_ns)..place(span.end_ns.max(span.begin_ns));
        let newest = self.newest.iter().filter(|found| span.holds(found.at_ns));
        let newest = newest.filter_map(|found| found.shaped(signal));
        let mut within = Vec::with_capacity(settled.len() + self.newest.len());
        within.extend(self.settled.range(settled));
        within.extend(newest);
        within
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pulse_that_is_settled_is_as_it_would_be_measured_now() {
        let rate_hz = 50.0;
        let wave = |k: usize| (-((k % 50) as f64 - 20.0).powi(2) / 60.0).exp();
        let (mut smoothed, mut pulses) = (Smoothed::new(rate_hz), Pulses::default());
        for k in 0..500 {
            smoothed.push(wave(k));
            pulses.settle(&smoothed);
            if k % 50 == 40 {
                pulses.push(k as i64, (k - 20) as f64);
            }
        }
        let mut late = Pulses::default();
        for k in 0..10 {
            late.push(50 * k + 40, (50 * k + 20) as f64);
        }
        let all = Span { begin_ns: 0, end_ns: 1000 };
        let [settled, late] = [pulses, late].map(|pulses| pulses.within(all, &smoothed));
        assert_eq!(settled.len(), 10);
        for (one, other) in settled.iter().zip(&late) {
            assert_eq!(
                (one.number, one.pulse, one.rise_step),
                (other.number, other.pulse, other.rise_step)
            );
        }
        let step = smoothed.part(0..500).steepest(settled[3].pulse.onset, settled[4].pulse.onset);
        assert_eq!(settled[3].cycle_step, Some(step));
    }
}
