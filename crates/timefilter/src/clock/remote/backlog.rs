//! Late messages: those delayed in a backlog, which arrive in order, and those held by their receiver until
//! the clock was known.

/// The most streams of a computer that are followed; late messages of further ones are not accepted.
const MOST_STREAMS: usize = 1024;
/// How long messages may be equally late [ns]: a backlog shrinks, a clock that was set back does not.
const STEADY_NANOS: i64 = 1_000_000_000;
/// The largest difference at which messages count as equally late [ns].
const EQUAL_NANOS: u64 = 100_000_000;
/// The latest that a message may be and still be accepted [ns].
const LATEST_NANOS: i64 = 600_000_000_000;
/// The greatest lateness of the first message of a stream [ns]: its receiver holds it until probes are
/// answered.
const HELD_NANOS: i64 = 5_000_000_000;

/// The state of each stream of a computer, ordered by stream.
#[derive(Clone, Debug, Default)]
pub(super) struct Backlogs(Vec<LastMessage>);

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
    /// The most memory that they use, themselves excluded [B].
    pub const BYTES: usize = MOST_STREAMS * size_of::<LastMessage>();

    /// Whether a late message continues its stream: in order after an accepted message, and not equally
    /// late for too long.
    pub fn goes_on(&mut self, stream: u32, stamp: i64, arrival: i64, late: i64) -> bool {
        let Some(last) = self.of(stream) else { return false };
        let steady = last.late.filter(|(_, before)| before.abs_diff(late) < EQUAL_NANOS);
        last.late = steady.or(Some((arrival, late)));
        let lasts = steady.map_or(0, |(since, _)| arrival.saturating_sub(since));
        let goes_on =
            last.believed && stamp > last.stamp && late < LATEST_NANOS && lasts < STEADY_NANOS;
        last.believed = goes_on;
        last.stamp = stamp;
        goes_on
    }

    /// Whether a late message is the first of its stream, and so may have been held until the clock was known.
    /// From then on the stream is followed.
    pub fn begins(&mut self, stream: u32, stamp: i64, arrival: i64, late: i64) -> bool {
        let is_new = self.of(stream).is_none() && self.0.len() < MOST_STREAMS;
        let begins = late < HELD_NANOS && is_new;
        if begins {
            let late = Some((arrival, late));
            self.follow(LastMessage { stream, stamp, believed: true, late });
        }
        begins
    }

    /// Records a message that was judged by its lateness alone.
    pub fn judged(&mut self, stream: u32, stamp: i64, believed: bool) {
        let last = LastMessage { stream, stamp, believed, late: None };
        if let Some(known) = self.of(stream) {
            let newest = if believed { stamp.max(known.stamp) } else { stamp };
            *known = LastMessage { stamp: newest, ..last };
            return;
        }
        self.follow(last);
    }

    fn follow(&mut self, last: LastMessage) {
        let place = self.0.partition_point(|known| known.stream < last.stream);
        if self.0.len() < MOST_STREAMS {
            self.0.insert(place, last);
        }
    }

    fn of(&mut self, stream: u32) -> Option<&mut LastMessage> {
        let place = self.0.binary_search_by_key(&stream, |known| known.stream).ok()?;
        self.0.get_mut(place)
    }
}
