//! Actions of people: they are stamped by the session's clock when they happen, and may arrive later.

use teampulse_timefilter::clock::Stamps;

use crate::session_streams::session_events;
use crate::stream::Stream;

/// How far the time of an action may be in the past, and in the future [ns]. An annotation may begin up to ten minutes
/// before it is sent, and take another minute to arrive; a browser's clock is only known from probes.
const UNDER_WAY_NANOS: i64 = 660_000_000_000;
const AHEAD_NANOS: i64 = 1_000_000_000;

/// When an event of the session happened, by the session's own clock; `None` for any other reading.
///
/// The device clock of such an event is the session's clock, whichever clock stamps other events on the same topic.
pub(super) fn done_at(stream: &Stream, stamps: &Stamps) -> Option<i64> {
    let arrival = stamps.arrival;
    let at = stamps.device.filter(|at| stamps.source.unwrap_or(arrival) == *at)?;
    let delay_nanos = arrival.saturating_sub(at);
    let is_believed = (-AHEAD_NANOS..=UNDER_WAY_NANOS).contains(&delay_nanos);
    (is_believed && stream.name == session_events().name).then_some(at)
}
