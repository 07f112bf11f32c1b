//! When the rows of a table were measured.

use super::analyses::Signal;
use super::table::{Row, Table};

/// The times of rows, one after the other: what a column tells; else as the rate says, from zero; of
/// intervals their sum.
pub struct Times {
    signal: Signal,
    rate_hz: f64,
    rows: usize,
    begin_ns: i64,
    last_ns: i64,
    sum_ns: i64,
    skipped: usize,
    /// When the table says that it begins [ns].
    told_ns: i64,
    /// The first intervals.
    first_ms: Vec<f64>,
}

/// A longer silence is no gap in a recording [s]: a day.
const LONGEST_SECS: f64 = 86_400.0;
/// How many intervals tell what is usual, and what can be [ms].
pub const FIRST: usize = 20;
const USUAL_MS: std::ops::RangeInclusive<f64> = 200.0..=3000.0;

impl Times {
    pub fn new(signal: Signal, table: &Table) -> Times {
        let rate_hz = table.rate_hz();
        let told_ns = table.begin_ns().unwrap_or(0);
        Times {
            signal,
            rate_hz,
            rows: 0,
            begin_ns: 0,
            last_ns: i64::MIN,
            sum_ns: 0,
            skipped: 0,
            told_ns,
            first_ms: Vec::new(),
        }
    }

    /// When the next row was measured [ns].
    pub fn of(&mut self, row: &Row) -> i64 {
        let even_ns = (self.rows as f64 / self.rate_hz * 1e9).round() as i64 + self.told_ns;
        let at_ns = match row.at_ns {
            Some(at_ns) => at_ns,
            None if self.signal.is_even() => even_ns,
            None => self.after(row),
        };
        if self.rows == 0 {
            self.begin_ns = if self.signal.is_even() { at_ns } else { 0 };
        }
        self.rows += 1;
        self.skipped = self.samples_until(at_ns);
        self.last_ns = self.last_ns.max(at_ns);
        at_ns
    }

    /// How long it was silent before the last row [s], if that is no gap of a recording.
    pub fn jump_secs(&self) -> Option<f64> {
        let secs = self.skipped as f64 / self.rate_hz;
        (self.signal.is_even() && secs > LONGEST_SECS).then_some(secs)
    }

    /// The usual interval [ms], if no heart has such ones.
    pub fn odd_interval_ms(&self) -> Option<f64> {
        let mut first_ms = self.first_ms.clone();
        first_ms.sort_unstable_by(f64::total_cmp);
        let usual_ms = first_ms.get(first_ms.len() / 2).copied()?;
        (!USUAL_MS.contains(&usual_ms)).then_some(usual_ms)
    }

    /// How many samples may be missing before the last row.
    pub fn skipped(&self) -> usize {
        self.skipped
    }

    fn samples_until(&self, at_ns: i64) -> usize {
        let rate_hz = if self.signal.is_even() { self.rate_hz } else { 0.0 };
        let is_first = self.last_ns == i64::MIN;
        let step_ns = if is_first { 0 } else { at_ns.saturating_sub(self.last_ns) };
        (step_ns as f64 / 1e9 * rate_hz) as usize
    }

    /// When the first row was measured, or the first interval began [ns].
    pub fn begin_ns(&self) -> i64 {
        self.begin_ns
    }

    /// When the row after the last one would have been measured [ns].
    pub fn end_ns(&self) -> i64 {
        let step_ns = if self.signal.is_even() { (1e9 / self.rate_hz).round() as i64 } else { 1 };
        self.last_ns.saturating_add(step_ns)
    }

    /// The end of an interval that begins where the last one ended; one without a number takes a second.
    fn after(&mut self, row: &Row) -> i64 {
        let interval_ms = row.values.first().copied().filter(|each| (0.0..1e6).contains(each));
        self.first_ms.extend(interval_ms.filter(|_| self.first_ms.len() < FIRST));
        self.sum_ns = self.sum_ns.saturating_add((interval_ms.unwrap_or(1e3) * 1e6).round() as i64);
        self.sum_ns
    }
}
