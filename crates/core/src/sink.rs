//! Sinks: components that store, show or publish data.

mod queue;

use thiserror::Error;

pub(crate) use queue::Gate;
pub use queue::{Batch, Inbox, Limits, Post, Posted, Received, queue, queue_within};

use crate::stream::Stream;

/// A component that stores, shows or publishes data: a bag, a screen, ROS.
///
/// Each sink runs on its own thread, so it may block on its disk or its socket.
pub trait Sink: Send {
    /// The sink's name in messages: `bag`, `terminal`.
    fn name(&self) -> &'static str;

    /// What happens when the sink can't keep up with the samples.
    fn delivery(&self) -> Delivery;

    /// Which streams the sink receives.
    fn wants(&self) -> Wants {
        Wants::Everything
    }

    /// Whether the sink may receive streams that are only [shown live](crate::stream::Audience::Live), such as cameras
    /// that the study does not record. Such a sink shows them and stores nothing of them.
    fn shows_live(&self) -> bool {
        false
    }

    /// The verbs of the [commands](crate::command::Command) that the sink carries out when it receives their events.
    fn carries_out(&self) -> &'static [&'static str] {
        &[]
    }

    /// Takes records from the inbox until it is closed, then finishes its work.
    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError>;
}

/// What happens when a sink can't keep up with the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// The sink gets every sample; when its queue is full, the pump waits for up to five seconds. Then the sink is cut
    /// off, which counts as a loss, and the session goes on.
    Lossless,
    /// The sink gets the newest samples; those that it can't keep up with are skipped and counted.
    Fresh,
}

/// Which streams a sink or a worker receives.
pub enum Wants {
    /// All streams.
    Everything,
    /// The streams for which this function returns true.
    Only(Box<dyn Fn(&Stream) -> bool + Send>),
}

impl Wants {
    /// Whether a stream is wanted.
    pub fn include(&self, stream: &Stream) -> bool {
        match self {
            Wants::Everything => true,
            Wants::Only(wanted) => wanted(stream),
        }
    }
}

/// Why a sink ended early. The message fits after "failed to".
#[derive(Debug, Error)]
pub enum SinkError {
    /// Not all data were stored: exit code 3.
    #[error("{message}")]
    Lost {
        /// The failure.
        message: String,
        /// The hint for the user; may be empty.
        hint: String,
    },
    /// The sink could not do its work at all: exit code 1.
    #[error("{message}")]
    Failed {
        /// What failed.
        message: String,
        /// What the user can do; may be empty.
        hint: String,
    },
}
