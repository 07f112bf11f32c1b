//! What people do is stamped by the session's own clock when they do it, and may arrive later.

use teampulse_timefilter::clock::Stamps;

use crate::session_streams::session_events;
use crate::stream::Stream;

/// How long ago an act may have been, and how far it may be ahead, as the clock of a browser is known from probes
/// only [ns]. What is annotated began up to ten minutes before, and may be under way for another.
const UNDER_WAY_NANOS: i64 = 660_000_000_000;
const AHEAD_NANOS: i64 = 1_000_000_000;

/// When an event of the session was done by its own clock; `None` for any other reading.
///
/// Such an event has the session's clock as that of its device. Whose clock stamps others on the same topic
/// does not matter for it.
pub(super) fn done_at(stream: &Stream, stamps: &Stamps) -> Option<i64> {
    let arrival = stamps.arrival;
    let at = stamps.device.filter(|at| stamps.source.unwrap_or(arrival) == *at)?;
    let delay_nanos = arrival.saturating_sub(at);
    let is_believed = (-AHEAD_NANOS..=UNDER_WAY_NANOS).contains(&delay_nanos);
    (is_believed && stream.name == session_events().name).then_some(at)
}
