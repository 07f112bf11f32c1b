//! Samples, which the pump passes to features and sinks.

use std::sync::Arc;

use bytes::Bytes;

use crate::data::Data;
use crate::stream::{Stream, StreamId};
use crate::time::Time;

/// A sample with its time and its position in its stream.
#[derive(Clone, Debug)]
pub struct Sample {
    /// The stream that the sample belongs to.
    pub stream: StreamId,
    /// When the sample was measured, by the session's clock, as corrected by the time filter. For a wave it is the time
    /// of the first sample; for a feature, the end of the window.
    pub measured: Time,
    /// When the pump took the sample; never goes back. A derived sample has the log time of its cause.
    pub log_time: Time,
    /// The time by the device's own clock [ns]; `None` if it has no clock.
    pub device_time: Option<i64>,
    /// The source's stamp, by the clock of the source's host.
    pub source_time: Option<Time>,
    /// The time from one sample of a wave to the next, by the session's clock [ns]; 0 for other shapes.
    pub period_ns: f64,
    /// The sample's number in its stream; a jump means a gap.
    pub index: u64,
    /// Whether the sample arrived in order.
    pub turn: Turn,
    /// The sample's content.
    pub data: Data,
}

/// Whether a sample arrived in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// It arrived after all samples that were measured before it.
    OnTime,
    /// It arrived after a sample that was measured later; it keeps its true time.
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

/// The memory of reference counts and of a queue entry, in addition to the record itself [bytes].
const OVERHEAD_BYTES: usize = 64;

impl Record {
    /// The record's memory in a queue, which limits the size of queues [bytes]: its data and its message, which share
    /// their bytes if the message is from another program. The stream is not counted, as all its records share it.
    #[must_use]
    pub fn held_bytes(&self) -> usize {
        let data_bytes = match &self.sample.data {
            Data::Message(_) => 0,
            data => data.held_bytes(),
        };
        size_of::<Record>() + OVERHEAD_BYTES + data_bytes + self.cdr.len()
    }
}
