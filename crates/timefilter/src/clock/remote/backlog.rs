//! Messages that were held up on their way and come late, but in order.

/// How many streams of a computer are followed; more share places.
const STREAMS: usize = 16;
/// For so long may all be equally late [ns]: a backlog becomes less, a clock that was set back does
/// not.
const STEADY_NANOS: i64 = 1_000_000_000;
/// What is equally late [ns].
const EQUAL_NANOS: u64 = 100_000_000;
/// Nothing is believed that is later than this [ns].
const LATEST_NANOS: i64 = 600_000_000_000;

/// How each stream of a computer goes on.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Backlogs {
    streams: [Option<Course>; STREAMS],
    next: usize,
}

/// One stream's last message.
#[derive(Clone, Copy, Debug)]
struct Course {
    stream: u32,
    stamp: i64,
    /// Whether its stamp was believed.
    believed: bool,
    /// Since when messages are equally late, and how late [ns].
    late: Option<(i64, i64)>,
}

impl Backlogs {
    /// Whether a message that is too late goes on where its stream was: in order after a message
    /// that was believed, and not as late as those before it for long.
    pub fn goes_on(&mut self, stream: u32, stamp: i64, arrival: i64, late: i64) -> bool {
        let Some(course) = self.of(stream) else { return false };
        let steady = course.late.filter(|(_, before)| before.abs_diff(late) < EQUAL_NANOS);
        course.late = steady.or(Some((arrival, late)));
        let lasts = steady.map_or(0, |(since, _)| arrival.saturating_sub(since));
        let goes_on =
            course.believed && stamp > course.stamp && late < LATEST_NANOS && lasts < STEADY_NANOS;
        course.believed = goes_on;
        course.stamp = stamp;
        goes_on
    }

    /// A message was judged by how late it is alone.
    pub fn judged(&mut self, stream: u32, stamp: i64, believed: bool) {
        let course = Course { stream, stamp, believed, late: None };
        if let Some(known) = self.of(stream) {
            let newest = if believed { stamp.max(known.stamp) } else { stamp };
            *known = Course { stamp: newest, ..course };
            return;
        }
        self.streams[self.next] = Some(course);
        self.next = (self.next + 1) % STREAMS;
    }

    fn of(&mut self, stream: u32) -> Option<&mut Course> {
        self.streams.iter_mut().flatten().find(|course| course.stream == stream)
    }
}
