use std::time::Duration;

use crate::{Error, Reading, Stream};

/// An output of a session to its caller; `R` is the type of the link's requests.
#[derive(Clone, Debug, PartialEq)]
pub enum Output<R> {
    /// A request, to be carried out before the next one.
    Request(R),
    /// A stream begins, or its scale or rate changed.
    Stream(Stream),
    /// Samples.
    Reading(Reading),
    /// Something else that the session reports.
    Event(Event),
    /// The session has ended: close the link. After an error, connect again later and
    /// [`start`](crate::Session::start) the session again.
    Done(Result<(), Error>),
}

/// Events that a session reports, in addition to samples.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// A part of the device's identity.
    Identified {
        /// The part of the identity.
        part: Identity,
        /// The value as the device wrote it.
        value: String,
    },
    /// Samples are missing before the next reading of this stream.
    Gap {
        /// The name of the stream.
        stream: &'static str,
        /// The number of missing samples, if known; the next index has jumped by it.
        samples: Option<u64>,
    },
    /// Bytes arrived that are invalid or can't be placed, and were skipped.
    Discarded {
        /// The origin of the bytes: a stream, a service or a protocol.
        source: &'static str,
        /// The number of bytes.
        bytes: usize,
    },
    /// A stream was silent for too long; the session requests it again.
    Stalled {
        /// The name of the stream.
        stream: &'static str,
        /// How long the stream was silent.
        quiet: Duration,
    },
    /// The device refused a stream, or has no such stream; the other streams continue.
    Refused {
        /// The name of the stream.
        stream: &'static str,
        /// The reason, in the protocol's words.
        reason: String,
    },
    /// The device's clock was set: device times before and after can't be compared.
    ClockSet {
        /// The stream on which this was detected.
        stream: &'static str,
    },
    /// Something that happened at a single time: a press, a pose, a tap.
    Marker {
        /// What happened, such as `tag`.
        name: &'static str,
        /// The device's clock at that time \[ns\], if it has one.
        device_time_ns: Option<i64>,
    },
    /// The link between a base station and its wearable: lost, or up again.
    Wearable {
        /// Whether the link is up.
        connected: bool,
    },
}

/// The parts of a device's identity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Identity {
    /// The manufacturer.
    Manufacturer,
    /// Model or hardware version.
    Model,
    /// Serial number.
    Serial,
    /// Firmware version.
    Firmware,
    /// The name given by its owner.
    Name,
}
