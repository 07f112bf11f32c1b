//! What stands above the numbers of a table.

use super::error::TableError;
use super::line::{Separator, number};
use super::{Lines, is_data};

/// The earliest time that Empatica's files may begin with [s since 1970]: the year 2001.
const EARLIEST_SECS: f64 = 1e9;
/// The rates that they may tell [Hz].
const E4_RATES_HZ: [f64; 4] = [1.0, 4.0, 32.0, 64.0];

/// What stands above the numbers, and the first line of them.
pub struct Head {
    pub separator: Separator,
    /// Names of all columns; empty when the table tells none.
    pub names: Vec<String>,
    /// How many columns there are.
    pub width: usize,
    /// Columns whose first cell is text.
    pub texts: Vec<usize>,
    /// The rate that the table tells [Hz].
    pub rate_hz: Option<f64>,
    /// When it says that it begins [ns since 1970].
    pub begin_ns: Option<i64>,
    /// The first line of numbers.
    pub first: Option<String>,
}

impl Head {
    /// Reads up to the first line of numbers.
    pub fn read(lines: &mut Lines) -> Result<Head, TableError> {
        let mut rate_hz = None;
        let top = loop {
            let Some(line) = lines.next()? else { return Err(TableError::Empty) };
            let line = line.trim_start_matches('\u{feff}');
            // So Excel is told the separator.
            let is_for_excel = line.trim_matches('"').starts_with("sep=");
            if is_data(line) && !is_for_excel {
                break line.to_owned();
            }
            rate_hz = rate_hz.or_else(|| told_rate_hz(line));
        };
        let separator = Separator::of(&top);
        let numbers = || separator.cells(&top).map(|cell| number(cell, separator));
        let is_names = numbers().all(|each| each.is_none_or(f64::is_nan))
            && numbers().any(|each| each.is_none());
        let mut names: Vec<String> =
            if is_names { separator.cells(&top).map(str::to_owned).collect() } else { Vec::new() };
        let mut first = if is_names { next_data(lines)?.ok_or(TableError::Empty)? } else { top };
        if is_names && is_text(&first) {
            // A line of units.
            first = next_data(lines)?.ok_or(TableError::Empty)?;
        }
        // A line of names may be separated otherwise than the numbers; under one name, a comma is a
        // decimal one.
        let separator = match Separator::of(&first) {
            Separator::Mark(',') if names.len() == 1 => Separator::Spaces,
            separator => separator,
        };
        let mut begin_ns = None;
        if let Some((began_ns, told_hz, begin)) = empatica(&names, &first, separator, lines)? {
            (begin_ns, rate_hz, first) = (Some(began_ns), Some(told_hz), begin);
        }
        if let Some(begin) = empatica_intervals(&first, separator, lines)? {
            names = vec!["time".to_owned(), "ibi_secs".to_owned()];
            first = begin;
        }
        let width = separator.cells(&first).count().max(names.len());
        let texts = separator.cells(&first).enumerate();
        let texts = texts.filter(|(_, cell)| number(cell, separator).is_none());
        let texts = texts.map(|(place, _)| place).collect();
        Ok(Head { separator, names, width, texts, rate_hz, begin_ns, first: Some(first) })
    }

    /// What a column is called: its name, or its number from 1.
    pub fn name(&self, place: usize) -> String {
        let name = self.names.get(place).filter(|name| !name.is_empty());
        name.cloned().unwrap_or_else(|| (place + 1).to_string())
    }

    /// A column that seems to hold times.
    pub fn time_like(&self) -> Option<String> {
        self.names.iter().find(|name| is_time_like(name)).cloned()
    }
}

/// Whether a column of such a name holds the time, or the number, of a row.
pub fn is_time_like(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    let words = ["time", "timer", "timestamp", "t", "index", "sample", "seconds", "date"];
    let first = name.split([' ', '(', '[', '_']).next().unwrap_or_default();
    words.contains(&name.as_str())
        || words.contains(&first)
        || ["measured_secs", "log_time_secs"].contains(&name.as_str())
}

pub fn is_comment(line: &str) -> bool {
    line.trim_start().starts_with(['#', '%'])
}

/// The sampling rate that a comment tells [Hz].
fn told_rate_hz(comment: &str) -> Option<f64> {
    let lower = comment.to_ascii_lowercase();
    let after = lower.find("sampling").or_else(|| lower.find("sample rate"))?;
    let after = &lower[after..];
    let rate = after[after.find("rate")? + 4..].trim_start_matches(|c: char| !c.is_ascii_digit());
    let end = rate.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(rate.len());
    rate[..end].trim_end_matches('.').parse().ok().filter(|rate_hz: &f64| *rate_hz > 0.0)
}

/// Whether no cell of a line holds a number.
fn is_text(line: &str) -> bool {
    let separator = Separator::of(line);
    separator.cells(line).all(|cell| number(cell, separator).is_none_or(f64::is_nan))
        && separator.cells(line).any(|cell| number(cell, separator).is_none())
}

fn next_data(lines: &mut Lines) -> Result<Option<String>, TableError> {
    while let Some(line) = lines.next()? {
        if is_data(line) {
            return Ok(Some(line.to_owned()));
        }
    }
    Ok(None)
}

/// Empatica's E4 writes the time at which a file begins, then the rate, both in every column. When it
/// begins [ns], the rate, and the first line of numbers, if this is such a file.
fn empatica(
    names: &[String],
    first: &str,
    separator: Separator,
    lines: &mut Lines,
) -> Result<Option<(i64, f64, String)>, TableError> {
    let same = |line: &str| {
        let mut cells = separator.cells(line).map(|cell| number(cell, separator));
        let value = cells.next().flatten()?;
        cells.all(|cell| cell == Some(value)).then_some(value)
    };
    let began = same(first).filter(|&secs| secs >= EARLIEST_SECS && names.is_empty());
    let Some(began_secs) = began else { return Ok(None) };
    let Some(second) = next_data(lines)? else { return Ok(None) };
    let rate_hz = same(&second).filter(|rate_hz| E4_RATES_HZ.contains(rate_hz));
    let rate_hz = rate_hz.ok_or_else(|| TableError::Begin { value: first.to_owned() })?;
    let begin_ns = (began_secs * 1e9).round() as i64;
    Ok(Some((begin_ns, rate_hz, next_data(lines)?.ok_or(TableError::Empty)?)))
}

/// Of the intervals between beats, it writes the time at which the file begins and the word `IBI`; then
/// when each beat was [s after that], and its interval [s]. The first line of numbers of such a file.
fn empatica_intervals(
    first: &str,
    separator: Separator,
    lines: &mut Lines,
) -> Result<Option<String>, TableError> {
    let mut cells = separator.cells(first);
    let is_time = cells.next().and_then(|cell| cell.parse::<f64>().ok()).is_some();
    if is_time && cells.next() == Some("IBI") && cells.next().is_none() {
        return Ok(Some(next_data(lines)?.ok_or(TableError::Empty)?));
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_may_tell_the_rate() {
        assert_eq!(told_rate_hz("# Sampling Rate (Hz):= 1000.00"), Some(1000.0));
        assert_eq!(told_rate_hz("# sampling_rate_hz=1000; plux, 16 bit"), Some(1000.0));
        assert_eq!(told_rate_hz("%Sample Rate = 250 Hz"), Some(250.0));
        assert_eq!(told_rate_hz("# Resolution:= 12"), None);
        assert_eq!(told_rate_hz("# sampling rate: unknown"), None);
    }

    #[test]
    fn times_and_numbers_of_rows_are_no_signals() {
        for name in ["time", "Time (s)", "timestamp", "measured_secs", "Sample Index", "index"] {
            assert!(is_time_like(name), "{name}");
        }
        for name in ["temperature", "ECG", "Tx", "EXG Channel 0"] {
            assert!(!is_time_like(name), "{name}");
        }
    }
}
