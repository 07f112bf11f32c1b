//! Times during which this process itself was suspended: it was stopped, or the machine slept.
//!
//! Silence during that time says nothing about a stream. A standstill is reported in band, as an event of
//! the session, so that a replay judges streams as the original run did.

use std::time::Duration;

use crate::data::{Data, Event, EventKind};
use crate::fault::passing;

/// The start of the event's label.
const STOOD_STILL: &str = "teampulse itself stood still";

/// The event that reports that this process was suspended for this long.
pub(crate) fn stood_still(lasted: Duration) -> Event {
    let secs = lasted.as_secs_f64();
    let label = format!(
        "{STOOD_STILL} for {secs:.1} s: it was stopped, or the machine slept or was overloaded"
    );
    Event { duration_secs: secs, ..passing(label) }
}

/// The duration of a standstill, if an event of the session reports one.
pub(crate) fn standstill(data: &Data) -> Option<Duration> {
    let Data::Event(event) = data else { return None };
    let is_standstill = event.kind == EventKind::Fault && event.label.starts_with(STOOD_STILL);
    Duration::try_from_secs_f64(event.duration_secs).ok().filter(|_| is_standstill)
}
