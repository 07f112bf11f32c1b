//! Intervals that are not those between two beats of a heart.

use super::plausible::INTERVALS_MS;
use super::table::{Oddity, Row};

/// The odd intervals among the rows that were read so far.
#[derive(Clone, Copy, Debug, Default)]
pub struct OddIntervals {
    left_out: Oddity,
    long: Oddity,
}

impl OddIntervals {
    /// Whether a row is one with an interval [ms], or without a number; an interval of zero or less is left out.
    pub fn takes(&mut self, row: &Row) -> bool {
        let Some(&interval_ms) = row.values.first() else { return true };
        let is_above = interval_ms.is_nan() || interval_ms > 0.0;
        // By the times in a table it takes no time.
        let is_long = interval_ms > INTERVALS_MS.1 && row.at_ns.is_none();
        self.left_out.add(usize::from(!is_above), row.line);
        self.long.add(usize::from(is_long), row.line);
        is_above
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
