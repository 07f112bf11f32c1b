//! Sources: components that originate data.

use async_trait::async_trait;
use thiserror::Error;

use crate::data::Data;
use crate::outlet::Outlet;
use crate::stream::StreamId;
use crate::time::Time;

/// A component that originates data: a device, robots, a simulation, a recording.
///
/// A source declares its streams and hands its readings to the [`Outlet`] as they arrive. It returns
/// `Ok` when it has no more data (a recording ended) and an error when its device goes away; the
/// supervisor then calls `run` again after a pause, so a source holds no retry loop of its own. It
/// must return soon after [`Outlet::closed`].
///
/// A source of a study counts as missing while it has declared no stream, or none of its streams that should have
/// samples has any (see [`Supply`](crate::outlet::Supply)): `check` is no-go, a running session reports it after ten
/// seconds, and at the end if it was missing throughout. So declare streams once the device is there, before their
/// first samples.
#[async_trait]
pub trait Source: Send {
    /// Runs until there is no more data, the device goes away or the outlet is closed.
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError>;

    /// Whether nothing may come from it without anything being wrong, as from a port for markers; or whether what it
    /// lacks is reported otherwise, as by a pattern of topics that need not all be published.
    fn may_be_silent(&self) -> bool {
        false
    }
}

/// A reading of a source: one sample with its original stamps.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The stream that it belongs to.
    pub stream: StreamId,
    /// The number given by its publisher or its recording; `None` when it has none. It numbers readings: a wave has one
    /// number, however many samples it has, and the next wave the next. A device that numbers its samples, as readings of
    /// the crate `devices` do, gives `None` with a wave and reports gaps by [`Outlet::lost`].
    pub index: Option<u64>,
    /// The device's own clock [ns]; `None` when it has none.
    pub device_time: Option<i64>,
    /// The stamp of its source, by the clock of the source's host.
    pub source_time: Option<Time>,
    /// Its content.
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
