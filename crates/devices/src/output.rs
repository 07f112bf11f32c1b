use std::time::Duration;

use crate::{Error, Reading, Stream};

/// An output of a session to its caller; `R` is the type of requests on its kind of link.
#[derive(Clone, Debug, PartialEq)]
pub enum Output<R> {
    /// A request, to be carried out before the next one.
    Request(R),
    /// A stream begins, or its scale or rate changed.
    Stream(Stream),
    /// Samples.
    Reading(Reading),
    /// Anything else that became known.
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
        /// Which part.
        part: Identity,
        /// As the device wrote it.
        value: String,
    },
    /// Samples are missing before the next reading of this stream.
    Gap {
        /// The stream.
        stream: &'static str,
        /// How many, if that is known; the next index has jumped by that number.
        samples: Option<u64>,
    },
    /// Bytes that mean nothing or can't be placed arrived, and were skipped.
    Discarded {
        /// Where they came from: a stream, a service or a protocol.
        source: &'static str,
        /// How many.
        bytes: usize,
    },
    /// A stream was silent for too long; the session requests it again.
    Stalled {
        /// The stream.
        stream: &'static str,
        /// How long it was silent.
        quiet: Duration,
    },
    /// The device refused a stream, or has none with this name; the other streams go on.
    Refused {
        /// The stream.
        stream: &'static str,
        /// Why, in the protocol's words.
        reason: String,
    },
    /// The device's clock was set: device times before and after can't be compared.
    ClockSet {
        /// The stream on which this was detected.
        stream: &'static str,
    },
    /// Something that happened at one time: a press, a pose, a tap.
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
    /// The name that its owner gave it.
    Name,
}
