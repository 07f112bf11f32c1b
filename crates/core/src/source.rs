//! Sources: components that originate data.

use async_trait::async_trait;
use thiserror::Error;

use crate::data::Data;
use crate::outlet::Outlet;
use crate::stream::StreamId;
use crate::time::Time;

/// A component that originates data: a device, robots, a simulation, a recording.
///
/// A source declares its streams and hands its readings to the [`Outlet`] as they arrive. It returns `Ok` when it has
/// no more data (a recording ended) and an error when its device goes away; the supervisor then calls `run` again after
/// a pause, so a source needs no retry loop. It must return soon after [`Outlet::closed`].
///
/// A source of a study counts as missing while it has declared no stream, or none of its streams that should have
/// samples has any (see [`Supply`](crate::outlet::Supply)): `check` is no-go, a running session reports it after ten
/// seconds, and at the end if it was missing throughout. So declare streams once the device is there, before their
/// first samples.
#[async_trait]
pub trait Source: Send {
    /// Runs until there is no more data, the device goes away or the outlet is closed.
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError>;

    /// Whether the source may be silent without a fault, like a port for markers, or reports missing data in another
    /// way, like a pattern of topics that need not all be published.
    fn may_be_silent(&self) -> bool {
        false
    }
}

/// A reading of a source: one sample with its original stamps.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The stream that the reading belongs to.
    pub stream: StreamId,
    /// The number of the reading, from its publisher or its recording; `None` if it has none. Readings are numbered,
    /// not samples: a wave has one number however many samples it has. A device that numbers its samples, like those in
    /// the crate `devices`, gives `None` with a wave and reports gaps by [`Outlet::lost`].
    pub index: Option<u64>,
    /// The time by the device's own clock [ns]; `None` if it has no clock.
    pub device_time: Option<i64>,
    /// The source's stamp, by the clock of the source's host.
    pub source_time: Option<Time>,
    /// The content of the reading.
    pub data: Data,
}

/// Why a source stopped. The message fits after "failed to".
#[derive(Debug, Error)]
pub enum SourceError {
    /// A temporary failure: the supervisor tries again.
    #[error("{message}")]
    Gone {
        /// What failed.
        message: String,
        /// What the user can do; may be empty.
        hint: String,
    },
    /// A permanent failure: the session ends.
    #[error("{message}")]
    Fatal {
        /// What failed.
        message: String,
        /// What the user can do; may be empty.
        hint: String,
    },
}

impl SourceError {
    /// What the user can do; may be empty.
    pub fn hint(&self) -> &str {
        match self {
            SourceError::Gone { hint, .. } | SourceError::Fatal { hint, .. } => hint,
        }
    }
}
