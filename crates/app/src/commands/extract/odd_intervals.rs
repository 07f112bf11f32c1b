//! Odd intervals between heartbeats: zero or negative, very long, or overlapping.

use super::analyses::BEATS_ASTRAY_SECS;
use super::plausible::INTERVALS_MS;
use super::table::{Oddity, Row};

/// The odd intervals among the rows that were read so far.
#[derive(Clone, Copy, Debug)]
pub struct OddIntervals {
    left_out: Oddity,
    long: Oddity,
    /// Intervals that start before the previous beat, if times are times of beats.
    overlapping: Oddity,
    /// Whether each time is that of the beat that ends the interval.
    are_of_beats: bool,
    /// The end of the latest interval [ms]; NaN before the first.
    end_ms: f64,
}

impl OddIntervals {
    /// Starts without intervals.
    pub fn new(are_of_beats: bool) -> OddIntervals {
        let none = Oddity::default();
        let (left_out, long, overlapping) = (none, none, none);
        OddIntervals { left_out, long, overlapping, are_of_beats, end_ms: f64::NAN }
    }

    /// Checks a row and returns whether it is kept: an interval of zero or less [ms] is left out.
    pub fn takes(&mut self, row: &Row) -> bool {
        let Some(&interval_ms) = row.values.first() else { return true };
        let is_above = interval_ms.is_nan() || interval_ms > 0.0;
        // Where the table states times, a long interval does not shift later beats.
        let is_long = interval_ms > INTERVALS_MS.1 && row.at_ns.is_none();
        self.left_out.add(usize::from(!is_above), row.line);
        self.long.add(usize::from(is_long), row.line);
        if let Some(at_ns) = row.at_ns.filter(|_| self.are_of_beats && is_above) {
            let is_overlapping = self.overlaps(at_ns as f64 / 1e6, interval_ms);
            self.overlapping.add(usize::from(is_overlapping), row.line);
        }
        is_above
    }

    /// Whether an interval [ms] that ends at a beat, when appended to the previous one, extends too far beyond that
    /// beat, so that the analysis leaves it out.
    fn overlaps(&mut self, at_ms: f64, interval_ms: f64) -> bool {
        let end_ms = self.end_ms + interval_ms;
        let (ahead_ms, most_ms) = (end_ms - at_ms, 1e3 * BEATS_ASTRAY_SECS);
        self.end_ms = if ahead_ms.abs() <= most_ms { end_ms } else { at_ms };
        ahead_ms > most_ms
    }

    /// Returns a note on the intervals that an analysis of beats leaves out because of their times.
    pub fn overlapping(self, rows: usize) -> Option<String> {
        let what = self.overlapping.words(
            "interval is longer than the time since the beat before",
            "intervals are longer than the time since the beat before them",
        );
        (self.overlapping.count > 0).then(|| {
            format!("{what}: their beats are used, but not the intervals (of {rows} rows)")
        })
    }

    /// Returns a note on each kind of odd interval.
    pub fn notes(self, rows: usize) -> impl Iterator<Item = String> {
        let long = |verb| format!("{verb} longer than {} s", INTERVALS_MS.1 / 1e3);
        let (is_long, are_long) = (long("interval is"), long("intervals are"));
        let left_out = self.left_out.words("interval is not above 0", "intervals are not above 0");
        let long = self.long.words(&is_long, &are_long);
        [
            (self.left_out, left_out, "left out"),
            (
                self.long,
                long,
                "times are sums of intervals, so all later beats are shifted by as much",
            ),
        ]
        .into_iter()
        .filter(|(oddity, ..)| oddity.count > 0)
        .map(move |(_, what, so)| format!("{what}: {so} (of {rows} rows)"))
    }
}
