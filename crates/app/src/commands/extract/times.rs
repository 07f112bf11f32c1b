//! The times of a table's rows.

use teampulse_features::analyses::Analysis;

use super::table::{Grid, Row, Table};

/// The times of successive rows: from a column of times; otherwise from the rate, starting at the table's start time or
/// at zero; for intervals, from their sum.
pub struct Times {
    signal: &'static Analysis,
    rate_hz: f64,
    /// The even times behind the stamps of an evenly sampled signal.
    grid: Option<Grid>,
    rows: usize,
    begin_ns: i64,
    last_ns: i64,
    sum_ns: i64,
    step_ns: i64,
    /// The start time that the table states [ns].
    dated_ns: i64,
}

/// A pause longer than this, a day, is not a gap in a recording [s].
const LONGEST_SECS: f64 = 86_400.0;
/// Intervals that are reported at once, or out of order by at most this, keep their order [ns].
const AT_ONCE_NS: i64 = 1_500_000_000;

impl Times {
    /// Creates the times of a table's rows; the first interval starts at `begin_ns` [ns].
    pub fn new(signal: &'static Analysis, table: &Table, begin_ns: i64) -> Times {
        let rate_hz = table.rate_hz();
        let dated_ns = table.begin_ns().unwrap_or(0);
        let (last_ns, sum_ns) = (i64::MIN, begin_ns);
        let grid = table.sampling().filter(|_| signal.is_even()).map(Grid::new);
        Times { signal, rate_hz, grid, rows: 0, begin_ns, last_ns, sum_ns, step_ns: 0, dated_ns }
    }

    /// The number of times after the next row that are needed to place it.
    pub fn needs(&self, row: &Row) -> usize {
        self.grid.as_ref().zip(row.at_ns).map_or(0, |(grid, at_ns)| grid.needs(at_ns))
    }

    /// Returns when the next row was measured [ns]; `following_ns` are the times of the rows after it.
    pub fn of(&mut self, row: &Row, following_ns: &[i64]) -> i64 {
        let even_ns = (self.rows as f64 / self.rate_hz * 1e9).round() as i64 + self.dated_ns;
        let is_even = self.signal.is_even();
        let placed_ns = self.grid.as_mut().and_then(|grid| match row.at_ns {
            Some(at_ns) => Some(grid.place(at_ns, following_ns).at_ns),
            None => grid.after_last(),
        });
        let at_ns = match placed_ns.or(row.at_ns) {
            Some(at_ns) if is_even => at_ns,
            Some(at_ns) => self.in_turn(at_ns),
            None if is_even => even_ns,
            None => self.after(row),
        };
        if self.rows == 0 && is_even {
            self.begin_ns = at_ns;
        }
        let is_first = self.rows == 0;
        self.rows += 1;
        self.step_ns = if is_first { 0 } else { at_ns.saturating_sub(self.last_ns) };
        self.last_ns = self.last_ns.max(at_ns);
        at_ns
    }

    /// The pause before the last row [s], if it is too long for a gap in a recording.
    pub fn jump_secs(&self) -> Option<f64> {
        let secs = self.step_ns as f64 / 1e9;
        (secs > LONGEST_SECS).then_some(secs)
    }

    /// How far the last row lies before an earlier one [s], if that is too far for rows that are only slightly out of
    /// order.
    pub fn back_secs(&self) -> Option<f64> {
        (self.step_ns < -AT_ONCE_NS).then_some(-self.step_ns as f64 / 1e9)
    }

    /// Whether the last row is later than all before it.
    pub fn is_later(&self) -> bool {
        self.rows <= 1 || self.step_ns > 0
    }

    /// The number of samples that may be missing before the last row.
    pub fn skipped(&self) -> usize {
        let rate_hz = if self.signal.is_even() { self.rate_hz } else { 0.0 };
        (self.step_ns as f64 / 1e9 * rate_hz) as usize
    }

    /// When the first row was measured, or the first interval started [ns].
    pub fn begin_ns(&self) -> i64 {
        self.begin_ns
    }

    /// When the row after the last one would have been measured [ns].
    pub fn end_ns(&self) -> i64 {
        let step_ns = if self.signal.is_even() { (1e9 / self.rate_hz).round() as i64 } else { 1 };
        self.last_ns.saturating_add(step_ns)
    }

    /// The end of an interval reported at this time [ns]; one reported at once with the previous interval is placed
    /// just after it.
    fn in_turn(&mut self, at_ns: i64) -> i64 {
        let is_at_once = at_ns <= self.last_ns && self.last_ns - at_ns <= AT_ONCE_NS;
        self.sum_ns = if is_at_once { self.last_ns + 1 } else { at_ns };
        self.sum_ns
    }

    /// The end of an interval that starts where the last one ended [ns]; an interval without a number counts as one
    /// second.
    fn after(&mut self, row: &Row) -> i64 {
        let interval_ms = row.values.first().copied().filter(|each| (0.0..1e6).contains(each));
        self.sum_ns = self.sum_ns.saturating_add((interval_ms.unwrap_or(1e3) * 1e6).round() as i64);
        self.sum_ns
    }
}
