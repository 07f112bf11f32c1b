//! How loud a muscle is at rest.

use std::collections::VecDeque;

use crate::error::{SignalError, checked};
use crate::gaps::is_usable;
use crate::robust::quantile_of_sorted;

/// What the envelope is averaged over before it is ranked [s].
const BLOCK_SECS: f64 = 0.1;
/// At rest is the quietest tenth of the time; loud at times, what one twentieth exceeds.
const REST_SHARE: f64 = 0.1;
const LOUD_SHARE: f64 = 0.95;
/// With an amplifier that is silent at rest, this share of the loud envelope stands for its noise: more
/// than 40 dB are not a property of the muscle.
const LEAST_OF_LOUD: f64 = 0.01;
/// What counting rounding errors as activity begins at, of the largest number that came in.
const LEAST_OF_RAW: f64 = 1e-9;
/// With fewer blocks, nothing is known yet; the very first ones are the filter's start.
const LEAST_BLOCKS: usize = 10;
const START_BLOCKS: usize = 3;
/// No memory is longer: a week.
const MOST_BLOCKS: f64 = 6_048_000.0;

/// The height of the envelope at rest: the 10 % quantile of its means over 0.1 s in the time that is
/// remembered.
#[derive(Clone, Debug)]
pub(super) struct Rest {
    block: usize,
    sum: f64,
    in_block: usize,
    blocks: usize,
    newest: Newest,
    most_raw: f64,
    level: Option<f64>,
}

impl Rest {
    /// Of the last `memory_secs` [s].
    pub(super) fn new(rate_hz: f64, memory_secs: f64) -> Result<Rest, SignalError> {
        let block = ((BLOCK_SECS * rate_hz).round() as usize).max(1);
        let length =
            checked("blocks of rest", (memory_secs / BLOCK_SECS).ceil(), (1.0, MOST_BLOCKS))?;
        let newest = Newest::new(length as usize);
        let (sum, in_block, blocks, most_raw) = (0.0, 0, 0, 0.0);
        Ok(Rest { block, sum, in_block, blocks, newest, most_raw, level: None })
    }

    /// Takes in the next sample's envelope, NaN where it is unknown, and what was measured.
    pub(super) fn push(&mut self, envelope: f64, raw: f64) {
        if is_usable(raw) {
            self.most_raw = self.most_raw.max(raw.abs());
        }
        self.sum += envelope;
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

    /// The height at rest, as far as it is known.
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

/// The newest values, in order: of a thousand or so, a list is quicker than a tree.
#[derive(Clone, Debug)]
struct Newest {
    length: usize,
    values: VecDeque<f64>,
    /// The usable ones among them.
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

/// The height at rest at each sample of a whole recording, from `memory_secs` [s] around it; `None`
/// where it is not known.
pub(super) fn levels(
    signal: &[f64],
    envelope: &[f64],
    rate_hz: f64,
    memory_secs: f64,
) -> Result<impl Iterator<Item = Option<f64>>, SignalError> {
    let mut rest = Rest::new(rate_hz, memory_secs)?;
    // There is no start to leave out, and the memory reaches as far ahead as back.
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
