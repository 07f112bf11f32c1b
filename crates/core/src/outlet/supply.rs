//! What a source has declared and handed over so far: a device may connect and send nothing.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::stream::{Signal, Stream, StreamId};

/// What a source has declared and handed over so far; clones share it.
#[derive(Clone, Debug, Default)]
pub struct Supply(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    /// One of the constants below.
    stage: AtomicU8,
    /// The source's streams that should have samples.
    awaited: Mutex<BTreeSet<StreamId>>,
}

/// Nothing has been declared.
const NOTHING: u8 = 0;
/// Streams were declared, all of which may be silent.
const DECLARED: u8 = 1;
/// None of the streams that should have samples has any.
const AWAITED: u8 = 2;
/// A stream that should have samples has some, or one was stopped on purpose.
const SENT: u8 = 3;

impl Supply {
    /// Why the source counts as missing: it has declared no stream, or none of its streams that should have samples has
    /// any. `None` if it is not missing. Events, markers, and the state of a link or a battery may be silent.
    pub fn lack(&self) -> Option<&'static str> {
        match self.0.stage.load(Ordering::Acquire) {
            NOTHING => Some("nothing was received from it"),
            AWAITED => Some("it sends no samples"),
            _ => None,
        }
    }

    /// Notes a declaration; streams without health, such as the session's own events, do not count.
    pub(super) fn declared(&self, id: StreamId, stream: &Stream) {
        if !stream.has_health() {
            return;
        }
        let may_be_silent =
            stream.is_irregular() || matches!(stream.signal, Signal::Link | Signal::Battery);
        if may_be_silent {
            self.rise(DECLARED);
        } else {
            self.awaited().insert(id);
            self.rise(AWAITED);
        }
    }

    /// Notes a reading.
    pub(super) fn sent(&self, id: StreamId) {
        // From the first sample on, this costs only a load.
        if self.0.stage.load(Ordering::Acquire) == AWAITED && self.awaited().contains(&id) {
            self.rise(SENT);
        }
    }

    /// Notes that a stream was stopped on purpose.
    pub(super) fn stopped(&self) {
        self.rise(SENT);
    }

    fn rise(&self, stage: u8) {
        self.0.stage.fetch_max(stage, Ordering::AcqRel);
    }

    fn awaited(&self) -> MutexGuard<'_, BTreeSet<StreamId>> {
        self.0.awaited.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session_streams::session_events;
    use crate::stream::{Shape, Subject};

    fn stream(signal: Signal, shape: Shape) -> Stream {
        Stream {
            signal,
            ..Stream::raw("/humans/persons/p001/box/x", Subject::person("p001"), shape)
        }
    }

    #[test]
    fn a_source_lacks_something_until_a_stream_that_should_have_samples_has_one() {
        let (supply, link, ecg) = (Supply::default(), StreamId(1), StreamId(2));
        supply.declared(StreamId(0), &session_events());
        assert_eq!(supply.lack(), Some("nothing was received from it"));
        supply.declared(link, &stream(Signal::Link, Shape::Sample));
        assert_eq!(supply.lack(), None, "its only stream may be silent");
        supply.declared(ecg, &stream(Signal::Ecg, Shape::Wave));
        supply.sent(link);
        assert_eq!(supply.lack(), Some("it sends no samples"));
        supply.sent(ecg);
        supply.declared(StreamId(3), &stream(Signal::Eda, Shape::Sample));
        assert_eq!(supply.lack(), None, "one of several streams is its own matter");
    }

    #[test]
    fn a_source_that_was_stopped_on_purpose_lacks_nothing() {
        let supply = Supply::default();
        supply.declared(StreamId(0), &stream(Signal::Ecg, Shape::Wave));
        supply.stopped();
        assert_eq!(supply.lack(), None);
    }

    #[test]
    fn a_source_of_events_lacks_nothing_once_it_has_declared_them() {
        let supply = Supply::default();
        supply.declared(StreamId(0), &stream(Signal::Event, Shape::Event));
        assert_eq!(supply.lack(), None);
    }
}
