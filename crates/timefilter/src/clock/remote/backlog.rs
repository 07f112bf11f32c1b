//! Late messages: those delayed in a backlog, which arrive in order, and those held by their receiver until
//! the clock was known.

/// The maximum number of streams followed per computer; late messages of any others are rejected.
const MOST_STREAMS: usize = 1024;
/// How long messages may be equally late [ns]: a backlog shrinks, a clock that was set back does not.
const STEADY_NANOS: i64 = 1_000_000_000;
/// The largest difference at which messages count as equally late [ns].
const EQUAL_NANOS: u64 = 100_000_000;
/// The latest that a message may be and still be accepted [ns].
const LATEST_NANOS: i64 = 600_000_000_000;
/// The greatest lateness of the first message of a stream [ns]: its receiver holds it until probes are
/// answered. While a backlog of other streams arrives, it may be as late as those.
const HELD_NANOS: i64 = 5_000_000_000;
/// How long after a message of a backlog others of the same backlog arrive [ns].
const SAME_BACKLOG_NANOS: i64 = 1_000_000_000;

/// The state of each stream of a computer, ordered by stream.
#[derive(Clone, Debug, Default)]
pub(super) struct Backlogs {
    streams: Vec<LastMessage>,
    /// When the newest message of a backlog was accepted, and the greatest lateness in that backlog [ns].
    newest: Option<(i64, i64)>,
}

/// The last message of one stream.
#[derive(Clone, Copy, Debug)]
struct LastMessage {
    stream: u32,
    stamp: i64,
    /// Whether its timestamp was accepted.
    believed: bool,
    /// Since when messages have been equally late, and how late [ns].
    late: Option<(i64, i64)>,
}

impl Backlogs {
    /// The most memory that all streams use, excluding the struct itself [B].
    pub const BYTES: usize = MOST_STREAMS * size_of::<LastMessage>();

    /// Whether a late message continues its stream: in order after an accepted message, or that message again, and not
    /// equally late for too long. One that is out of order is not accepted, and changes nothing for those after it.
    pub fn goes_on(&mut self, stream: u32, stamp: i64, arrival: i64, late: i64) -> bool {
        let Some(last) = self.of(stream) else { return false };
        if stamp < last.stamp {
            return false;
        }
        let steady = last.late.filter(|(_, before)| before.abs_diff(late) < EQUAL_NANOS);
        last.late = steady.or(Some((arrival, late)));
        let lasts = steady.map_or(0, |(since, _)| arrival.saturating_sub(since));
        let goes_on = last.believed && late < LATEST_NANOS && lasts < STEADY_NANOS;
        last.believed = goes_on;
        last.stamp = stamp;
        if goes_on {
            let before = self.newest.filter(|newest| is_same_backlog(newest, arrival));
            self.newest = Some((arrival, before.map_or(late, |(_, latest)| latest.max(late))));
        }
        goes_on
    }

    /// Whether a late message is the first of its stream, and so may have been held until the clock was known.
    /// From then on the stream is followed.
    pub fn begins(&mut self, stream: u32, stamp: i64, arrival: i64, late: i64) -> bool {
        let is_new = self.of(stream).is_none() && self.streams.len() < MOST_STREAMS;
        let backlog = self.newest.filter(|newest| is_same_backlog(newest, arrival));
        let latest = backlog.map_or(HELD_NANOS, |(_, latest)| latest.max(HELD_NANOS));
        let begins = late < latest && is_new;
        if begins {
            let late = Some((arrival, late));
            self.follow(LastMessage { stream, stamp, believed: true, late });
        }
        begins
    }

    /// Forgets all streams, as after a jump of the clock.
    pub fn forget(&mut self) {
        self.streams.clear();
        self.newest = None;
    }

    /// Records a message that was judged by its lateness alone. A rejected one that is out of order changes nothing.
    pub fn judged(&mut self, stream: u32, stamp: i64, believed: bool) {
        let last = LastMessage { stream, stamp, believed, late: None };
        if let Some(known) = self.of(stream) {
            if !believed && stamp < known.stamp {
                return;
            }
            let newest = if believed { stamp.max(known.stamp) } else { stamp };
            *known = LastMessage { stamp: newest, ..last };
            return;
        }
        self.follow(last);
    }

    fn follow(&mut self, last: LastMessage) {
        let place = self.streams.partition_point(|known| known.stream < last.stream);
        if self.streams.len() < MOST_STREAMS {
            self.streams.insert(place, last);
        }
    }

    fn of(&mut self, stream: u32) -> Option<&mut LastMessage> {
        let place = self.streams.binary_search_by_key(&stream, |known| known.stream).ok()?;
        self.streams.get_mut(place)
    }
}

/// Whether a message arriving at `arrival` belongs to the same backlog as the newest message.
fn is_same_backlog((newest, _): &(i64, i64), arrival: i64) -> bool {
    arrival.saturating_sub(*newest) < SAME_BACKLOG_NANOS
}
