//! The owner of a clock.

use std::fmt;

use crate::stream::{StreamId, Subject};

/// The owner of a clock.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Owner {
    /// The clock belongs to this host.
    Host,
    /// The clock belongs to this host, and the stream's late joiners receive earlier samples.
    Kept(StreamId),
    /// The clock belongs to this host, and a worker derived the readings from samples with corrected times.
    Worker,
    /// The clock belongs to a device.
    Device(Subject, String),
    /// The device has no clock: each of its streams has its own model.
    Counted(StreamId, String),
    /// The clock belongs to a computer that stamps messages.
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
