//! Intervals that are not those between two beats of a heart.

use super::analyses::BEATS_ASTRAY_SECS;
use super::plausible::INTERVALS_MS;
use super::table::{Oddity, Row};

/// The odd intervals among the rows that were read so far.
#[derive(Clone, Copy, Debug)]
pub struct OddIntervals {
    left_out: Oddity,
    long: Oddity,
    /// Those that begin before the beat before them, where times are those of beats.
    overlapping: Oddity,
    /// Whether times are those of the beats that end the intervals.
    are_of_beats: bool,
    /// The end of the last one [ms]; NaN before the first.
    end_ms: f64,
}

impl OddIntervals {
    /// No intervals yet.
    pub fn new(are_of_beats: bool) -> OddIntervals {
        let none = Oddity::default();
        let (left_out, long, overlapping) = (none, none, none);
        OddIntervals { left_out, long, overlapping, are_of_beats, end_ms: f64::NAN }
    }

    /// Whether a row is one with an interval [ms], or without a number; an interval of zero or less is left out.
    pub fn takes(&mut self, row: &Row) -> bool {
        let Some(&interval_ms) = row.values.first() else { return true };
        let is_above = interval_ms.is_nan() || interval_ms > 0.0;
        // By the times in a table it takes no time.
        let is_long = interval_ms > INTERVALS_MS.1 && row.at_ns.is_none();
        self.left_out.add(usize::from(!is_above), row.line);
        self.long.add(usize::from(is_long), row.line);
        if let Some(at_ns) = row.at_ns.filter(|_| self.are_of_beats && is_above) {
            let is_overlapping = self.overlaps(at_ns as f64 / 1e6, interval_ms);
            self.overlapping.add(usize::from(is_overlapping), row.line);
        }
        is_above
    }

    /// Whether an interval that a beat ends reaches too far beyond that beat when appended to the last one, so that the
    /// analysis leaves it out [ms].
    fn overlaps(&mut self, at_ms: f64, interval_ms: f64) -> bool {
        let end_ms = self.end_ms + interval_ms;
        let (ahead_ms, most_ms) = (end_ms - at_ms, 1e3 * BEATS_ASTRAY_SECS);
        self.end_ms = if ahead_ms.abs() <= most_ms { end_ms } else { at_ms };
        ahead_ms > most_ms
    }

    /// The note on intervals that an analysis of beats leaves out, because of their times.
    pub fn overlapping(self, rows: usize) -> Option<String> {
        let what = self.overlapping.words(
            "interval is longer than the time since the beat before",
            "intervals are longer than the time since the beat before them",
        );
        (self.overlapping.count > 0)
            .then(|| format!("{what}: not used, only their beats (of all {rows} rows)"))
    }

    /// The note on each kind.
    pub fn notes(self, rows: usize) -> impl Iterator<Item = String> {
        let long = |verb| format!("{verb} longer than {} s", INTERVALS_MS.1 / 1e3);
        let (is_long, are_long) = (long("interval is"), long("intervals are"));
        let left_out = self.left_out.words("interval is not above 0", "intervals are not above 0");
        let long = self.long.words(&is_long, &are_long);
        [
            (self.left_out, left_out, "left out"),
            (self.long, long, "by the sum of all intervals, what follows is that much later"),
        ]
        .into_iter()
        .filter(|(oddity, ..)| oddity.count > 0)
        .map(move |(_, what, so)| format!("{what}: {so} (of all {rows} rows)"))
    }
}
