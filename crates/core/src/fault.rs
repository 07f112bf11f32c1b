//! Faults of the session itself, as events.

use crate::data::{Event, EventKind};
use crate::session_streams::{own_events, session_events};
use crate::stream::{Origin, Stream};

/// The topic that reports features that panicked; a replay recomputes it.
pub const FAULTS: &str = "/teampulse/faults";

/// A fault that lasts: it is reported once and stays on the screen.
pub fn lasting(label: impl Into<String>) -> Event {
    fault(label, f64::NAN)
}

/// A momentary fault: the failed operation is retried.
pub fn passing(label: impl Into<String>) -> Event {
    fault(label, 0.0)
}

/// The text of a fault with what the user can do about it; an empty hint is left out.
pub(crate) fn with_hint(label: String, hint: &str) -> String {
    if hint.is_empty() { label } else { format!("{label}; {hint}") }
}

/// Whether an event is a lasting fault of the session itself.
pub fn is_lasting(stream: &Stream, event: &Event) -> bool {
    let is_own = stream.name == FAULTS || stream.name == session_events().name;
    is_own && event.kind == EventKind::Fault && event.duration_secs.is_nan()
}

fn fault(label: impl Into<String>, duration_secs: f64) -> Event {
    Event { kind: EventKind::Fault, label: label.into(), value: f64::NAN, duration_secs }
}

/// The stream that reports features that panicked.
pub(crate) fn faults() -> Stream {
    let doc = "features that panicked and are disabled from then on";
    Stream { origin: Origin::Derived, ..own_events(FAULTS, doc) }
}
