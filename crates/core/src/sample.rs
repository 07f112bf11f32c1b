//! Samples, which the pump passes to features and sinks.

use std::sync::Arc;

use bytes::Bytes;

use crate::data::Data;
use crate::stream::{Stream, StreamId};
use crate::time::Time;

/// A sample with its time and its position in its stream.
#[derive(Clone, Debug)]
pub struct Sample {
    /// The stream that it belongs to.
    pub stream: StreamId,
    /// When it was measured, by the session's clock, as corrected by the time filter: the time of
    /// the first sample of a wave, or of the end of a feature's window.
    pub measured: Time,
    /// When the pump took it; never goes back. A derived sample has the log time of its cause.
    pub log_time: Time,
    /// The device's own clock [ns]; `None` when it has none.
    pub device_time: Option<i64>,
    /// The stamp of its source, by the clock of the source's host.
    pub source_time: Option<Time>,
    /// From one sample of a wave to the next, by the session's clock [ns]; 0 for anything else.
    pub period_ns: f64,
    /// Its number in the stream; a jump is a gap.
    pub index: u64,
    /// Whether it arrived in order.
    pub turn: Turn,
    /// Its content.
    pub data: Data,
}

/// Whether a sample arrived in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// After all samples that were measured before it.
    OnTime,
    /// After one that was measured later; it keeps its true time.
    Late,
    /// A duplicate; recorded, not fed to features.
    Duplicate,
    /// Beyond the limit for features; recorded, not fed to features.
    Excess,
}

/// A sample for sinks: with its stream, and encoded once for all of them.
#[derive(Clone, Debug)]
pub struct Record {
    /// The stream, as it was declared when the sample was taken.
    pub stream: Arc<Stream>,
    /// The sample.
    pub sample: Sample,
    /// The sample as a ROS message: CDR with its four-byte header.
    pub cdr: Bytes,
}

/// The memory of reference counts and of the place in a queue, beside the record itself [bytes].
const OVERHEAD_BYTES: usize = 64;

impl Record {
    /// Its memory in a queue, by which queues are bounded [bytes]: its data and its message, which share their bytes if
    /// the message is from another program. Its stream is shared by all its records.
    #[must_use]
    pub fn held_bytes(&self) -> usize {
        let data_bytes = match &self.sample.data {
            Data::Message(_) => 0,
            data => data.held_bytes(),
        };
        size_of::<Record>() + OVERHEAD_BYTES + data_bytes + self.cdr.len()
    }
}
