//! Causal pulse detection.

use std::collections::VecDeque;

use super::blocks::Blocks;
use super::clean::quick_band;
use super::judge::Judge;
use super::pulse::Pulse;
use super::shape::{SHORTEST_RISE_SECS, Wave};
use super::smooth::Smoothing;
use super::working::{Bridge, Grouping};
use crate::error::SignalError;
use crate::filter::Cascade;
use crate::history::History;

/// The part of the wave examined before a peak [s].
const BEFORE_SECS: f64 = 1.0;
/// The initial part from which the signal's level is estimated [s].
const FIRST_SECS: f64 = 1.0;
/// How long the newest samples are kept [s].
const KEPT_SECS: f64 = 2.5;

/// Detects pulses in a PPG sample by sample.
///
/// A pulse is reported about 0.4 s of data time after its peak, which half the averaging window of a beat (0.33 s)
/// requires. Pulses in the first second are reported after its end. The width is NaN when the pulse takes longer to
/// fall to half of its height. The output is bit-identical for any chunking, and no sample allocates. Samples that are
/// not [usable numbers](crate::gaps::is_usable) are bridged.
#[derive(Clone, Debug)]
pub struct PulseDetector {
    grouping: Grouping,
    bridge: Bridge,
    /// The number of groups before the first usable value.
    skipped: i64,
    band: Cascade,
    /// The first values, until the signal's level is known.
    first: Vec<f64>,
    /// Pulses that became known together and wait to be returned.
    found: VecDeque<Pulse>,
    blocks: Blocks,
    judge: Judge,
    newest: History,
    smoothing: Smoothing,
    smoothed: Vec<f64>,
    floor: i64,
}

impl PulseDetector {
    /// Creates a detector for samples at 20 to 2000 Hz, in any unit, with pulses upwards.
    ///
    /// Returns an error for another rate.
    pub fn new(rate_hz: f64) -> Result<PulseDetector, SignalError> {
        let grouping = Grouping::new(rate_hz)?;
        let rate_hz = grouping.rate_hz();
        let kept = (KEPT_SECS * rate_hz) as usize;
        Ok(PulseDetector {
            bridge: Bridge::default(),
            skipped: 0,
            band: Cascade::settled(&quick_band(rate_hz)?),
            first: Vec::with_capacity((FIRST_SECS * rate_hz) as usize),
            found: VecDeque::with_capacity(8),
            blocks: Blocks::new(rate_hz),
            judge: Judge::new(rate_hz),
            newest: History::new(kept),
            smoothing: Smoothing::new(rate_hz),
            smoothed: Vec::with_capacity(2 * kept),
            floor: 0,
            grouping,
        })
    }

    /// Takes in the next sample, and returns a pulse if one became known.
    pub fn push(&mut self, sample: f64) -> Option<Pulse> {
        let mean = self.grouping.push(sample)?;
        self.take(mean).map(|pulse| pulse.in_groups_of(self.grouping.group()))
    }

    /// Takes in the next value at the working rate, and returns a pulse there.
    pub(super) fn take(&mut self, mean: f64) -> Option<Pulse> {
        let Some(value) = self.bridge.push(mean) else {
            self.skipped += 1;
            return None;
        };
        if self.first.len() < self.first.capacity() {
            self.first.push(value);
            if self.first.len() == self.first.capacity() {
                self.begin();
            }
        } else {
            self.find(value);
        }
        self.found.pop_front()
    }

    /// Processes the first values, assuming the signal was at their mean before.
    fn begin(&mut self) {
        let first = std::mem::take(&mut self.first);
        self.band.settle(first.iter().sum::<f64>() / first.len() as f64);
        for &value in &first {
            self.find(value);
        }
        self.first = first;
    }

    fn find(&mut self, value: f64) {
        self.newest.push(value);
        let candidate = self.blocks.push(self.band.push(value));
        if let Some(candidate) = candidate.filter(|candidate| self.judge.take(*candidate)) {
            let pulse = self.pulse(candidate.place);
            self.found.extend(pulse);
        }
    }

    fn pulse(&mut self, place: i64) -> Option<Pulse> {
        let rate_hz = self.grouping.rate_hz();
        let begin = (place - (BEFORE_SECS * rate_hz) as i64).max(0);
        self.smoothed.clear();
        let around = self.newest.at(begin..self.newest.count);
        self.smoothing.smooth_into(around, &mut self.smoothed);
        let wave = Wave { smoothed: &self.smoothed, rate_hz };
        let floor = (self.floor - begin).max(0) as usize;
        let pulse = wave.pulse_near((place - begin) as usize, floor)?;
        self.floor = begin + pulse.sample.round() as i64;
        let has_risen = begin as f64 + pulse.sample >= SHORTEST_RISE_SECS * rate_hz;
        (has_risen && pulse.amplitude > 0.0).then(|| pulse.later_by((begin + self.skipped) as f64))
    }
}
