//! The owner of a clock.

use std::fmt;

use crate::stream::{StreamId, Subject};

/// The owner of a clock.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Owner {
    /// This host.
    Host,
    /// This host, for a stream whose late joiners receive earlier samples.
    Kept(StreamId),
    /// This host, for readings that a worker derived from samples with corrected times.
    Worker,
    /// A device with a clock.
    Device(Subject, String),
    /// A device without a clock: one model for each of its streams.
    Counted(StreamId, String),
    /// A computer that stamps messages.
    Computer(String),
}

impl fmt::Display for Owner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Owner::Host | Owner::Kept(_) | Owner::Worker => f.write_str("this host"),
            Owner::Device(subject, device) if subject.id.is_empty() => f.write_str(device),
            Owner::Device(subject, device) => write!(f, "{device} of {}", subject.id),
            Owner::Counted(_, device) => f.write_str(device),
            Owner::Computer(name) => f.write_str(name),
        }
    }
}
