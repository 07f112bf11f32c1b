//! The last seconds, kept in memory while nothing is recorded.

use std::collections::VecDeque;

use teampulse_bag::Opening;
use teampulse_core::latched::Latched;
use teampulse_core::sample::Record;
use teampulse_core::time::Time;

/// The limits on what is kept.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// The longest time that is kept [s].
    pub secs: f64,
    /// The maximum size [bytes]; if the time needs more, less of it is kept.
    pub bytes: usize,
}

/// The newest records, and the state of the session before them.
#[derive(Debug)]
pub struct Kept {
    limits: Limits,
    held: Latched,
    records: VecDeque<Record>,
    bytes: usize,
    /// Whether records within the time limit were dropped because of the size limit.
    is_cut: bool,
}

impl Kept {
    /// An empty buffer, in a session with this state.
    pub fn new(limits: Limits, held: Latched) -> Kept {
        Kept { limits, held, records: VecDeque::new(), bytes: 0, is_cut: false }
    }

    /// Restores the buffer from the content of a recording that failed to start; also returns the records after the
    /// command.
    pub fn reopened(limits: Limits, opening: Opening) -> (Kept, Vec<Record>) {
        let Opening { held, kept, after } = opening;
        let bytes = kept.iter().map(Record::held_bytes).sum();
        (Kept { limits, held, records: kept.into(), bytes, is_cut: false }, after)
    }

    /// Adds the newest record, and drops the oldest ones beyond the limits.
    pub fn push(&mut self, record: &Record) {
        self.bytes += record.held_bytes();
        self.records.push_back(record.clone());
        let newest = record.sample.log_time;
        while let Some(oldest) = self.records.front() {
            let is_old = newest.secs_since(oldest.sample.log_time) > self.limits.secs;
            let is_large = self.bytes > self.limits.bytes;
            if !is_old && !is_large {
                return;
            }
            self.is_cut = !is_old;
            self.drop_oldest();
        }
    }

    fn drop_oldest(&mut self) {
        let Some(oldest) = self.records.pop_front() else { return };
        self.bytes -= oldest.held_bytes();
        self.held.take(&oldest);
    }

    /// The time span of the kept records [s].
    pub fn secs(&self) -> f64 {
        let log_time = |record: &Record| record.sample.log_time;
        let ends = self.records.front().map(log_time).zip(self.records.back().map(log_time));
        ends.map_or(0.0, |(oldest, newest): (Time, Time)| newest.secs_since(oldest))
    }

    /// Whether less time is kept than requested because of the size limit.
    pub fn is_cut(&self) -> bool {
        self.is_cut
    }

    /// The size of the kept records [bytes].
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// The content of a recording that starts now, with the records after the command.
    pub fn opening(self, after: Vec<Record>) -> Opening {
        Opening { held: self.held, kept: self.records.into(), after }
    }

    /// A copy of the content for a snapshot; the records are shared.
    pub fn snapshot(&self) -> Opening {
        let kept = self.records.iter().cloned().collect();
        Opening { held: self.held.clone(), kept, after: Vec::new() }
    }
}
