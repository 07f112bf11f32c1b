//! The resting level of a muscle.

use std::collections::VecDeque;

use crate::error::{SignalError, checked};
use crate::gaps::is_usable;
use crate::robust::quantile_of_sorted;

/// The averaging time of the envelope before quantiles are taken [s].
const BLOCK_SECS: f64 = 0.1;
/// The quantile of the envelope at rest, and the quantile exceeded by loud activity.
const REST_SHARE: f64 = 0.1;
const LOUD_SHARE: f64 = 0.95;
/// The noise assumed for an amplifier that is silent at rest, as a share of the loud envelope: more than 40
/// dB is not a property of the muscle.
const LEAST_OF_LOUD: f64 = 0.01;
/// The smallest resting level as a share of the largest raw value, above rounding errors.
const LEAST_OF_RAW: f64 = 1e-9;
/// The fewest blocks for an estimate; the first ones, the filter's transient, are skipped.
const LEAST_BLOCKS: usize = 10;
const START_BLOCKS: usize = 3;
/// The longest memory: a week.
const MOST_BLOCKS: f64 = 6_048_000.0;

/// The envelope at rest: the 10 % quantile of its 0.1 s means within the memory.
#[derive(Clone, Debug)]
pub(super) struct Rest {
    block: usize,
    sum: f64,
    in_block: usize,
    blocks: usize,
    /// The number of samples since the last unusable one.
    since_gap: usize,
    newest: Newest,
    most_raw: f64,
    level: Option<f64>,
}

impl Rest {
    /// Creates an estimate over the last `memory_secs` [s].
    pub(super) fn new(rate_hz: f64, memory_secs: f64) -> Result<Rest, SignalError> {
        let block = ((BLOCK_SECS * rate_hz).round() as usize).max(1);
        let length =
            checked("blocks of rest", (memory_secs / BLOCK_SECS).ceil(), (1.0, MOST_BLOCKS))?;
        let newest = Newest::new(length as usize);
        let (sum, in_block, blocks, most_raw) = (0.0, 0, 0, 0.0);
        let since_gap = usize::MAX / 2;
        Ok(Rest { block, sum, in_block, blocks, since_gap, newest, most_raw, level: None })
    }

    /// Takes in the next envelope sample, NaN where unknown, and the raw sample.
    pub(super) fn push(&mut self, envelope: f64, raw: f64) {
        if is_usable(raw) {
            self.most_raw = self.most_raw.max(raw.abs());
        }
        // In a gap, and while the filters settle after it, the envelope is not that of the muscle.
        self.since_gap = if is_usable(raw) { self.since_gap.saturating_add(1) } else { 0 };
        let is_settled = self.since_gap > START_BLOCKS * self.block;
        self.sum += if is_settled { envelope } else { f64::NAN };
        self.in_block += 1;
        if self.in_block < self.block {
            return;
        }
        let mean = self.sum / self.in_block as f64;
        (self.sum, self.in_block) = (0.0, 0);
        self.blocks += 1;
        if self.blocks > START_BLOCKS {
            self.newest.push(mean);
            self.level = self.ranked();
        }
    }

    /// The resting level, once it is known.
    pub(super) fn level(&self) -> Option<f64> {
        self.level
    }

    fn ranked(&self) -> Option<f64> {
        let ascending = &self.newest.ascending;
        if ascending.len() < LEAST_BLOCKS {
            return None;
        }
        let rest = quantile_of_sorted(ascending, REST_SHARE);
        let loud = quantile_of_sorted(ascending, LOUD_SHARE);
        let level = rest.max(LEAST_OF_LOUD * loud).max(LEAST_OF_RAW * self.most_raw);
        Some(level).filter(|&level| level > 0.0)
    }
}

/// The newest values, sorted: for a thousand or so, a list is faster than a tree.
#[derive(Clone, Debug)]
struct Newest {
    length: usize,
    values: VecDeque<f64>,
    /// The usable values, ascending.
    ascending: Vec<f64>,
}

impl Newest {
    fn new(length: usize) -> Newest {
        Newest { length, values: VecDeque::new(), ascending: Vec::new() }
    }

    fn push(&mut self, value: f64) {
        if self.values.len() == self.length
            && let Some(oldest) = self.values.pop_front()
            && is_usable(oldest)
        {
            let place = self.ascending.partition_point(|each| *each < oldest);
            self.ascending.remove(place);
        }
        self.values.push_back(value);
        if is_usable(value) {
            let place = self.ascending.partition_point(|each| *each < value);
            self.ascending.insert(place, value);
        }
    }
}

/// The resting level at each sample of a whole recording, from `memory_secs` [s] around it; `None` where
/// unknown.
pub(super) fn levels(
    signal: &[f64],
    envelope: &[f64],
    rate_hz: f64,
    memory_secs: f64,
) -> Result<impl Iterator<Item = Option<f64>>, SignalError> {
    let mut rest = Rest::new(rate_hz, memory_secs)?;
    // There is no transient to skip, and the memory extends equally forwards and backwards.
    rest.blocks = START_BLOCKS;
    let ahead = ((memory_secs / 2.0 * rate_hz).round() as usize).min(signal.len());
    let beyond = std::iter::repeat_n((f64::NAN, f64::NAN), ahead);
    let samples = envelope.iter().copied().zip(signal.iter().copied()).chain(beyond);
    let levels = samples.map(move |(envelope, raw)| {
        rest.push(envelope, raw);
        rest.level()
    });
    Ok(levels.skip(ahead))
}
