//! Sources: whatever originates data.

use async_trait::async_trait;
use thiserror::Error;

use crate::data::Data;
use crate::outlet::Outlet;
use crate::stream::StreamId;
use crate::time::Time;

/// Whatever originates data: a device, robots, a simulation, a recording.
///
/// A source declares its streams and hands its readings to the [`Outlet`] as they come. It returns
/// `Ok` when it has no more (a recording ended) and an error when its device went away; the
/// supervisor then calls `run` again after a pause, so a source holds no retry loop of its own. It
/// must return soon after [`Outlet::closed`].
#[async_trait]
pub trait Source: Send {
    /// Runs until there is no more to hand over, the device goes away or the outlet is closed.
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError>;
}

/// What a source hands over: one sample with the stamps that it came with.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The stream that it belongs to.
    pub stream: StreamId,
    /// Its number as its publisher or its recording has it; `None` when it has none.
    pub index: Option<u64>,
    /// The device's own clock [ns]; `None` when it has none.
    pub device_time: Option<i64>,
    /// The stamp that its source put on it, by the clock of the source's host.
    pub source_time: Option<Time>,
    /// What it holds.
    pub data: Data,
}

/// Why a source stopped. The message fits after "failed to".
#[derive(Debug, Error)]
pub enum SourceError {
    /// It may come back: the supervisor tries again.
    #[error("{message}")]
    Gone {
        /// What failed.
        message: String,
        /// What the user can do; may be empty.
        hint: String,
    },
    /// Trying again is of no use: the session ends.
    #[error("{message}")]
    Fatal {
        /// What failed.
        message: String,
        /// What the user can do; may be empty.
        hint: String,
    },
}
