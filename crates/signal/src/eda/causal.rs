//! Causal analysis of skin conductance.

use std::collections::VecDeque;

use super::analysis::{LONGEST_GAP_SECS, Settings};
use super::clean::{FASTEST_HZ, LEAST_FILTERED_HZ, ORDER};
use super::contact::SteadyContact;
use super::detector::{ResponseDetector, WAIT_SECS};
use super::step::{is_step, rise};
use super::store::{Placed, Store};
use super::{Response, Threshold, checked_rate, values};
use crate::analysis::{Causal, Event, Measured, Span, Value, Windows};
use crate::error::SignalError;
use crate::filter::Cascade;
use crate::filter::butterworth::{high_pass, low_pass};
use crate::gaps::is_usable;

/// Samples are averaged down to this rate [Hz], or slightly above.
const WORKING_HZ: f64 = 32.0;
/// The cut-off below which the signal is tonic [Hz].
const PARTING_HZ: f64 = 0.01;
/// The most events waiting to be read; older ones are dropped.
const MOST_EVENTS: usize = 1024;

/// The causal analysis.
pub(super) struct CausalEda {
    store: Store,
    group: Group,
    contact: SteadyContact,
    /// The last usable sample.
    held: f64,
    /// The low-pass; `None` where the rate leaves no room for it.
    low: Option<Cascade>,
    /// The delay of the low-pass [samples at the working rate].
    delay: f64,
    high: Cascade,
    detector: ResponseDetector,
    /// The length of the current gap [samples at the working rate].
    missing: usize,
    longest_gap: usize,
    /// The level at which the newest response has recovered by half, until it does.
    falling_to: Option<f64>,
    events: VecDeque<Event>,
}

/// A group of samples to average.
struct Group {
    size: usize,
    taken: usize,
    middle_ns: i64,
    conductance: Mean,
    temperature: Mean,
}

#[derive(Default)]
struct Mean {
    sum: f64,
    count: usize,
}

impl CausalEda {
    pub(super) fn new(settings: &Settings, rate_hz: f64) -> Result<CausalEda, SignalError> {
        checked_rate(rate_hz)?;
        let Threshold::Absolute(threshold_us) = settings.threshold else {
            let (name, value) = ("a relative threshold of a causal analysis", f64::NAN);
            return Err(SignalError::Setting { name, value, least: 0.0, most: 0.0 });
        };
        let size = (rate_hz / WORKING_HZ).floor().max(1.0) as usize;
        let working_hz = rate_hz / size as f64;
        let is_filtered = working_hz >= LEAST_FILTERED_HZ;
        let low = is_filtered.then(|| low_pass(ORDER, FASTEST_HZ, working_hz)).transpose()?;
        let delay_secs = low.as_ref().map_or(0.0, |low| low.group_delay_secs(0.1));
        let wait_secs = WAIT_SECS - delay_secs;
        Ok(CausalEda {
            store: Store::new(working_hz, settings.threshold, values::of_causal(threshold_us))?,
            group: Group::new(size),
            contact: SteadyContact::new(working_hz),
            held: f64::NAN,
            low: low.map(|design| Cascade::settled(&design)),
            delay: delay_secs * working_hz,
            high: Cascade::settled(&high_pass(2, PARTING_HZ, working_hz)?),
            detector: ResponseDetector::waiting(working_hz, threshold_us, wait_secs)?,
            missing: 0,
            longest_gap: (LONGEST_GAP_SECS * working_hz) as usize,
            falling_to: None,
            events: VecDeque::new(),
        })
    }

    fn take(&mut self, at_ns: i64, conductance: f64, temperature: Option<f64>) {
        self.store.raw.push(at_ns, conductance);
        if let Some(celsius) = temperature {
            self.store.temperature.push_back(celsius);
        }
        if let Some((at_ns, conductance)) = self.contact.push(at_ns, conductance) {
            self.take_steady(at_ns, conductance);
        }
    }

    fn take_steady(&mut self, at_ns: i64, conductance: f64) {
        self.hold(conductance);
        let held = self.held;
        let clean = self.low.as_mut().map_or(held, |low| low.push(held));
        let phasic = self.high.push(clean);
        let is_known = self.missing <= self.longest_gap;
        let known = |value: f64| if is_known { value } else { f64::NAN };
        self.store.tonic.push(at_ns, known(clean - phasic));
        self.store.phasic.push_back(known(phasic));
        self.store.push_slow(at_ns, known(clean));
        self.watch(at_ns, known(phasic));
    }

    /// Takes in a sample, or a missing one.
    fn hold(&mut self, conductance: f64) {
        if !is_usable(conductance) {
            self.missing = self.missing.saturating_add(1);
            return;
        }
        if self.missing > self.longest_gap {
            self.begin_anew(conductance);
        }
        (self.held, self.missing) = (conductance, 0);
    }

    /// Restarts after a long gap at any level.
    fn begin_anew(&mut self, level: f64) {
        self.low.iter_mut().for_each(|low| low.settle(level));
        self.high.settle(level);
        self.store.settle(level);
        self.detector.begin_anew();
        self.falling_to = None;
    }

    /// Detects responses, and the half recovery of the last one.
    fn watch(&mut self, at_ns: i64, phasic: f64) {
        if self.falling_to.is_some_and(|level| phasic <= level) {
            self.falling_to = None;
            let late_ns = (self.delay / self.store.raw.rate_hz() * 1e9) as i64;
            if let Some(last) = self.store.responses.back_mut() {
                last.recover(at_ns.saturating_sub(late_ns));
            }
        }
        let Some(found) = self.detector.push(phasic) else { return };
        if self.is_step(&found) {
            return;
        }
        let (onset, peak) = (found.onset - self.delay, found.peak - self.delay);
        let mut placed = found;
        (placed.onset, placed.peak) = (self.group.sample(onset), self.group.sample(peak));
        let peak_ns = self.store.raw.time_ns(peak).unwrap_or(at_ns);
        let placed = Placed::new(&placed, 1.0, |_| peak_ns);
        self.falling_to = Some(self.phasic_at(found.peak) - 0.5 * found.amplitude_us);
        if self.events.len() == MOST_EVENTS {
            self.events.pop_front();
        }
        self.events.push_back(placed.event());
        self.store.responses.push_back(placed);
    }

    fn is_step(&self, found: &Response) -> bool {
        let rate_hz = self.store.raw.rate_hz();
        is_step(&self.store.clean(rise(found, rate_hz)), rate_hz, found.amplitude_us)
    }

    fn phasic_at(&self, place: f64) -> f64 {
        let first = self.store.tonic.held().start;
        let held = (place as usize).checked_sub(first).and_then(|k| self.store.phasic.get(k));
        held.copied().unwrap_or(f64::NEG_INFINITY)
    }
}

impl Windows for CausalEda {
    fn values(&self) -> &[Value] {
        self.store.values()
    }

    fn measure(&self, span: Span) -> Measured {
        self.store.measure(span)
    }
}

impl Causal for CausalEda {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        let conductance = channels.first().copied().unwrap_or(f64::NAN);
        if let Some((at_ns, conductance, temperature)) =
            self.group.push(at_ns, conductance, channels.get(1).copied())
        {
            self.take(at_ns, conductance, temperature);
        }
    }

    fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    fn forget(&mut self, before_ns: i64) {
        self.store.forget(before_ns);
    }
}

impl Group {
    fn new(size: usize) -> Group {
        let (conductance, temperature) = (Mean::default(), Mean::default());
        Group { size, taken: 0, middle_ns: 0, conductance, temperature }
    }

    /// The sample position of a group mean.
    fn sample(&self, place: f64) -> f64 {
        place * self.size as f64 + (self.size - 1) as f64 / 2.0
    }

    /// Takes in a sample; returns the means of the group that it completes.
    fn push(
        &mut self,
        at_ns: i64,
        conductance: f64,
        temperature: Option<f64>,
    ) -> Option<(i64, f64, Option<f64>)> {
        if self.taken == self.size / 2 {
            self.middle_ns = at_ns;
        }
        self.taken += 1;
        self.conductance.push(conductance);
        if let Some(celsius) = temperature {
            self.temperature.push(celsius);
        }
        if self.taken < self.size {
            return None;
        }
        self.taken = 0;
        let celsius = self.temperature.take();
        Some((self.middle_ns, self.conductance.take(), temperature.map(|_| celsius)))
    }
}

impl Mean {
    fn push(&mut self, value: f64) {
        if is_usable(value) {
            self.sum += value;
            self.count += 1;
        }
    }

    /// The mean, NaN if empty; resets the group.
    fn take(&mut self) -> f64 {
        let mean = self.sum / self.count as f64;
        *self = Mean::default();
        mean
    }
}
