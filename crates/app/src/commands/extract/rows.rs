//! The rows of a table as input of an analysis: in the signal's unit, and with their times.

use teampulse_core::stream::Signal;
use teampulse_core::units::{Conversion, accepted};
use teampulse_features::analyses::Analysis;

use super::odd_intervals::OddIntervals;
use super::options::failure;
use super::plausible::{self, Plausible};
use super::table::{Row, Table, TableError, is_raw, is_unit};
use super::times::Times;
use crate::exit::Exit;
use crate::failure::Failure;

/// The number of intervals from which it is decided whether their times are times of beats.
const BEATS: usize = 64;
/// Combined rounding error of a time and an interval [ms].
const ROUNDING_MS: f64 = 2.5;

/// The rows of a table, read one after the other.
pub struct Rows {
    table: Table,
    scaling: Scaling,
    times: Times,
    are_of_beats: bool,
    plausible: Plausible,
    /// Odd intervals, if the rows are intervals.
    intervals: Option<OddIntervals>,
}

/// What the user stated about the unit of all columns.
pub struct Said<'a> {
    /// A factor, applied first.
    pub scale: f64,
    /// The unit after scaling.
    pub unit: Option<&'a str>,
}

impl Rows {
    /// Creates the rows of a table. Fails if a column's unit can't be converted to the signal's.
    pub fn new(
        signal: &'static Analysis,
        mut table: Table,
        said: &Said<'_>,
    ) -> Result<Rows, Failure> {
        let scaling = Scaling::new(signal, &table, said)?;
        let begin_ns = if signal.is_even() { 0 } else { begin_ns(&mut table, &scaling)? };
        let times = Times::new(signal, &table, begin_ns);
        let are_of_beats = !signal.is_even() && are_of_beats(&mut table, &scaling)?;
        let intervals = (!signal.is_even()).then(|| OddIntervals::new(are_of_beats));
        let plausible = Plausible::new(signal.signal);
        Ok(Rows { table, scaling, times, are_of_beats, plausible, intervals })
    }

    /// Whether the time of each interval is that of the beat that ends it, as in the files of an E4 and in our own;
    /// otherwise it is the time at which a strap sent the interval.
    pub fn are_of_beats(&self) -> bool {
        self.are_of_beats
    }

    /// The table that the rows are read from.
    pub fn table(&self) -> &Table {
        &self.table
    }

    /// The times of the rows that were read so far.
    pub fn times(&self) -> &Times {
        &self.times
    }

    /// Describes the oddities of the rows.
    pub fn oddities(&self) -> impl Iterator<Item = String> {
        let rows = self.table.rows();
        let intervals = self.intervals.into_iter().flat_map(move |odd| odd.notes(rows));
        self.table.oddities().chain(intervals).chain(self.plausible.note())
    }

    /// Describes intervals between beats that are not used because of the times of the beats.
    pub fn overlapping(&self) -> Option<String> {
        self.intervals?.overlapping(self.table.rows())
    }

    /// Returns the next row in the signal's unit, and its time [ns].
    pub fn next(&mut self) -> Result<Option<(i64, Row)>, Failure> {
        let row = loop {
            let Some(mut row) = self.table.next_row().map_err(failure)? else {
                self.plausible.refused()?;
                self.plausible.too_small()?;
                return Ok(None);
            };
            self.scaling.apply(&mut row.values);
            self.plausible.take(&row.values);
            if self.table.rows() == plausible::FIRST {
                self.plausible.refused()?;
            }
            if self.intervals.as_mut().is_none_or(|intervals| intervals.takes(&row)) {
                break row;
            }
        };
        let following_ns = self.table.following_ns(self.times.needs(&row)).map_err(failure)?;
        let at_ns = self.times.of(&row, &following_ns);
        // A pause of more than a day is a wrong time, not a gap.
        match self.times.jump_secs() {
            Some(step_secs) => Err(failure(TableError::Jump { line: row.line, step_secs })),
            None => Ok(Some((at_ns, row))),
        }
    }

    /// Fails if times go back at the row in this line, which was read last.
    pub fn in_order(&self, line: usize) -> Result<(), Failure> {
        match self.times.back_secs() {
            Some(step_secs) => Err(failure(TableError::Back { line, step_secs })),
            None => Ok(()),
        }
    }
}

/// Returns when the first interval starts [ns]: at the start time that the file states, if any; otherwise its length
/// before its end.
fn begin_ns(table: &mut Table, scaling: &Scaling) -> Result<i64, Failure> {
    let dated_ns = table.begin_ns();
    let first = table.peek(1).map_err(failure)?.next().cloned();
    let Some((end_ns, mut row)) = first.and_then(|row| Some((row.at_ns?, row))) else {
        return Ok(0);
    };
    scaling.apply(&mut row.values);
    // A table with only a column of times has no column of intervals.
    let first_ms = row.values.first().copied().filter(|first_ms| *first_ms > 0.0);
    let first_ns = first_ms.map_or(0, |first_ms| (first_ms * 1e6).round() as i64);
    Ok(dated_ns.unwrap_or(end_ns.saturating_sub(first_ns)))
}

/// Whether most intervals equal the time since the previous one.
fn are_of_beats(table: &mut Table, scaling: &Scaling) -> Result<bool, Failure> {
    let rows = table.peek(BEATS).map_err(failure)?;
    let mut beats: Vec<(i64, f64)> = Vec::new();
    for row in rows {
        let mut values = row.values.clone();
        scaling.apply(&mut values);
        beats.extend(row.at_ns.zip(values.first().copied()));
    }
    let is_exact = |pair: &&[(i64, f64)]| {
        let since_ms = pair[1].0.saturating_sub(pair[0].0) as f64 / 1e6;
        (since_ms - pair[1].1).abs() <= ROUNDING_MS
    };
    Ok(2 * beats.windows(2).filter(is_exact).count() > beats.len().saturating_sub(1))
}

/// The conversion of each column to the unit in which the signal is analysed.
struct Scaling {
    scale: f64,
    conversions: Vec<Conversion>,
}

impl Scaling {
    fn new(signal: &'static Analysis, table: &Table, said: &Said<'_>) -> Result<Scaling, Failure> {
        let conversion = |in_table: &Option<String>| {
            let Some(to) = signal.unit() else {
                known(signal, said.unit)?;
                return Ok(Conversion::SAME);
            };
            // With a factor, the numbers are in the signal's own unit.
            let in_table = in_table.as_deref().filter(|_| said.scale.total_cmp(&1.0).is_eq());
            let from = said.unit.or(in_table).unwrap_or_default();
            Conversion::between(from, to).ok_or_else(|| refused(signal, from, to))
        };
        let conversions = table.units().iter().map(conversion).collect::<Result<_, _>>()?;
        Ok(Scaling { scale: said.scale, conversions })
    }

    fn apply(&self, values: &mut [f64]) {
        for (value, conversion) in values.iter_mut().zip(&self.conversions) {
            *value = conversion.of(*value * self.scale);
        }
    }
}

/// Fails if the unit of a voltage is not one of voltage; other signals that are not converted may have any unit.
fn known(signal: &'static Analysis, unit: Option<&str>) -> Result<(), Failure> {
    let is_voltage = matches!(signal.signal, Signal::Ecg | Signal::Emg);
    let is_of_voltage =
        |unit: &str| is_raw(unit) || unit == "1" || Conversion::between(unit, "mV").is_some();
    let Some(other) = unit.filter(|unit| is_voltage && !is_of_voltage(unit)) else { return Ok(()) };
    let what = if is_unit(other) { "not a unit of voltage" } else { "not a known unit" };
    let message = format!("--unit {other} for {} is {what}", signal.word());
    let hint = format!("known units are {}, and raw counts", accepted("mV").join(", "));
    Err(Failure::new(message).hint(hint).exit(Exit::BadArguments))
}

fn refused(signal: &'static Analysis, from: &str, to: &str) -> Failure {
    let hint = if is_raw(from) {
        format!("give --scale FACTOR to convert them to {to}, from the device's manual")
    } else {
        format!("give --unit {}, or --scale FACTOR", accepted(to).join(", "))
    };
    let message = format!("{} in {from} can't be converted to {to}", signal.word());
    Failure::new(message).hint(hint).exit(Exit::BadArguments)
}

#[cfg(test)]
mod tests {
    use super::super::analyses::wanted;
    use super::*;

    /// The rows of a table with this text.
    fn rows(signal: Signal, text: &str, unit: Option<&str>) -> Result<Rows, Failure> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.csv");
        std::fs::write(&path, text).unwrap();
        let signal = Analysis::of(signal).unwrap();
        let table = Table::open(&path, &wanted(signal, Vec::new(), None, None), None).unwrap();
        Rows::new(signal, table, &Said { scale: 1.0, unit })
    }

    #[test]
    fn intervals_that_are_left_out_or_long_are_counted_with_their_first_line() {
        let text = "800\n0\n810\n-5\n790\n99999\n800\n".repeat(4);
        let mut rows = rows(Signal::Interval, &text, None).unwrap();
        let mut last_ns = 0;
        let mut count = 0;
        while let Some((at_ns, _)) = rows.next().unwrap() {
            assert!(at_ns > last_ns);
            (count, last_ns) = (count + 1, at_ns);
        }
        assert_eq!((count, last_ns), (20, 4 * (800 + 810 + 790 + 99_999 + 800) * 1_000_000));
        assert_eq!(
            rows.oddities().collect::<Vec<_>>(),
            [
                "8 intervals are not above 0, the first in line 2: left out (of 28 rows)",
                "4 intervals are longer than 3 s, the first in line 6: times are sums of intervals, so all later beats are shifted by as much (of 28 rows)",
            ]
        );
    }

    #[test]
    fn intervals_that_reach_beyond_their_beats_are_noted() {
        let noted = |steps_ms: fn(u32) -> u32| {
            let mut at_ms = 0;
            let row = |k: u32| {
                at_ms += steps_ms(k);
                format!("{},{},800\n", f64::from(at_ms) / 1e3, k)
            };
            let text =
                (0..60).map(row).fold("time_secs,n,rr_ms\n".to_owned(), |all, row| all + &row);
            let mut rows = rows(Signal::Interval, &text, None).unwrap();
            while rows.next().unwrap().is_some() {}
            rows.overlapping()
        };
        assert_eq!(noted(|_| 800), None);
        assert_eq!(noted(|k| if k == 9 { 1600 } else { 800 }), None);
        let note = noted(|k| if k % 20 == 19 { 650 } else { 800 }).unwrap();
        assert!(note.starts_with("3 intervals are longer than the time since the beat"), "{note}");
        assert!(note.contains("the first in line 21"), "{note}");
    }

    #[test]
    fn a_row_far_before_an_earlier_one_is_out_of_order() {
        let text = |back_ms: i32| {
            let time = |k: i32| k * 100 - if k < 20 { 0 } else { back_ms };
            let rows = (0..40).map(|k| format!("{},{k}\n", time(k)));
            rows.fold("time_ms,eda\n".to_owned(), |text, row| text + &row)
        };
        let out_of_order = |back_ms| {
            let mut rows = rows(Signal::Eda, &text(back_ms), None).unwrap();
            while let Some((_, row)) = rows.next().unwrap() {
                if let Err(failure) = rows.in_order(row.line) {
                    return Some(failure.words());
                }
            }
            None
        };
        let (message, hint) = out_of_order(10_100).unwrap();
        assert_eq!(message, "failed to follow the times: line 22 is 10.0 s before an earlier line");
        assert!(hint.starts_with("sort the table by its times, or split it"), "{hint}");
        assert_eq!(out_of_order(500), None);
    }

    #[test]
    fn the_unit_of_a_voltage_is_one_of_voltages() {
        let rated = |signal, unit| {
            let text = "# Sampling Rate: 100 Hz\nx\n1\n2\n";
            rows(signal, text, Some(unit)).map(|_| ()).map_err(|failure| failure.words())
        };
        let (message, hint) = rated(Signal::Ecg, "banana").unwrap_err();
        assert_eq!(message, "--unit banana for ecg is not a known unit");
        assert!(hint.contains("mV, V"), "{hint}");
        let (message, _) = rated(Signal::Ecg, "uS").unwrap_err();
        assert_eq!(message, "--unit uS for ecg is not a unit of voltage");
        for unit in ["mV", "uV", "millivolts", "counts", "1"] {
            assert!(rated(Signal::Ecg, unit).is_ok(), "{unit}");
        }
        assert!(rated(Signal::Other, "kPa").is_ok());
    }
}
