//! The header of a table.

use std::collections::BTreeMap;

use super::beats;
use super::clock::unit_ns;
use super::dates::{is_date, minutes_ns, time_of_day_ns};
use super::dialect::{Decimal, separator};
use super::empatica::E4;
use super::error::TableError;
use super::line::{Separator, number};
use super::line_reader::{LineReader, TextLine, is_comment, is_rule};
use super::units::in_brackets;

/// The number of lines that are read ahead to detect the format.
const SAMPLE_LINES: usize = 16;

/// The header of a table, and the form of its first lines of numbers.
pub struct Head {
    pub separator: Separator,
    /// Names of all columns; empty when the table has none.
    pub names: Vec<String>,
    /// The line below the names, if it contains units.
    pub units: Vec<String>,
    /// The number of columns.
    pub width: usize,
    /// The usual number of cells in lines of numbers, as counted by [`Separator::width`].
    usual_width: usize,
    /// The cells of the first lines of numbers, line by line.
    pub sample: Vec<Vec<String>>,
    /// The rate that the table states [Hz].
    pub rate_hz: Option<f64>,
    /// Whether the file was written by Empatica's E4.
    pub is_e4: bool,
    /// The start time that the table states [ns since 1970].
    pub begin_ns: Option<i64>,
    /// The first line of numbers.
    pub first: Option<TextLine>,
}

impl Head {
    /// Reads up to the first line of numbers. `takes_one` is set if one column is wanted and none is named.
    pub fn read(
        lines: &mut LineReader,
        takes_one: bool,
        decimal: Option<Decimal>,
    ) -> Result<Head, TableError> {
        let (mut rate_hz, top) = above(lines)?;
        let of_top = Separator::of(&top.text);
        let mut names = if is_names(&top.text) { names(&top.text) } else { Vec::new() };
        let line_of_names = top.text.trim().to_owned();
        let mut units = Vec::new();
        let mut first = top;
        if !names.is_empty() {
            first = lines.next_data()?.ok_or(TableError::NoNumbers)?;
            if is_names(&first.text) {
                units = Separator::of(&first.text).cells(&first.text).map(str::to_owned).collect();
                first = lines.next_data()?.ok_or(TableError::NoNumbers)?;
            }
        }
        // The header may have a different separator than the numbers.
        let sample = [vec![first.clone()], lines.peek(SAMPLE_LINES)?].concat();
        let is_counted = of_top != Separator::Spaces || names.len() == 1;
        let counted = if is_counted { names.len() } else { 0 };
        let of_names = (names.len() > 1 && of_top != Separator::Spaces).then_some(of_top);
        let separator = separator(&alike(&sample, of_names), counted, takes_one, decimal)?;
        let mut begin_ns = None;
        let e4 = if names.is_empty() { E4::read(&first, separator, lines)? } else { None };
        if let Some(e4) = &e4 {
            (begin_ns, rate_hz) = (Some(e4.begin_ns), e4.rate_hz);
            first = lines.next_data()?.ok_or(TableError::NoNumbers)?;
            if e4.rate_hz.is_none() {
                names = vec!["time".to_owned(), "ibi".to_owned()];
                units = vec!["s".to_owned(); 2];
            }
        }
        let sample = [vec![first.clone()], lines.peek(SAMPLE_LINES)?].concat();
        let usual_width = usual(sample.iter().map(|line| separator.width(&line.text)));
        let cells = |line: &TextLine| separator.cells(&line.text).map(str::to_owned).collect();
        let sample: Vec<Vec<String>> = sample.iter().map(cells).collect();
        if names.is_empty()
            && let Some(found) = beats::units(&sample)
        {
            names = ["time", "rr"].map(str::to_owned).to_vec();
            units = found.map(str::to_owned).to_vec();
        }
        if !is_counted && names.len() > 1 && sample[0].len() == 1 {
            // A single name that consists of several words.
            names = vec![line_of_names];
        }
        let width = width(&names, &sample);
        let (first, is_e4) = (Some(first), e4.is_some());
        let head = Head {
            separator,
            names,
            units,
            width,
            usual_width,
            sample,
            rate_hz,
            is_e4,
            begin_ns,
            first,
        };
        Ok(head)
    }

    /// Whether the last of the `filled` cells of a line belongs to no known column, so that its cells can't be
    /// assigned.
    pub fn is_of_other_width(&self, line: &str, filled: usize) -> bool {
        match self.separator {
            Separator::SecondComma => self.separator.width(line) != self.usual_width,
            _ => filled > self.usual_width.max(self.names.len()),
        }
    }

    /// The name of a column, or its number from 1 if it has none.
    pub fn name(&self, place: usize) -> String {
        let name = self.names.get(place).filter(|name| !name.is_empty());
        name.cloned().unwrap_or_else(|| (place + 1).to_string())
    }

    /// The first cells of a column.
    pub fn cells(&self, place: usize) -> Vec<&str> {
        self.sample.iter().filter_map(|line| line.get(place).map(String::as_str)).collect()
    }

    /// Whether the first cell of a column is text.
    pub fn is_text(&self, place: usize) -> bool {
        self.sample[0].get(place).is_some_and(|cell| number(cell).is_none())
    }

    /// Whether a column has neither a name nor text in its first cells, as before the first and after the last bar of a
    /// line.
    pub fn is_empty(&self, place: usize) -> bool {
        self.names.get(place).is_some_and(String::is_empty)
            && self.cells(place).iter().all(|cell| cell.is_empty())
    }

    /// Returns the name of a column that looks like times, by its name or else by its unit.
    pub fn time_like(&self) -> Option<String> {
        let has_unit = |name: &&String| in_brackets(name).and_then(unit_ns).is_some();
        let named = self.names.iter().find(|name| is_time_like(name));
        named.or_else(|| self.names.iter().find(has_unit)).cloned()
    }
}

/// Returns the lines with the same separator as the names, or all lines if there are none: a line that ends after its
/// first cell shows no separator.
fn alike(lines: &[TextLine], of_names: Option<Separator>) -> Vec<TextLine> {
    let is_alike = |line: &&TextLine| Some(Separator::of(&line.text)) == of_names;
    let alike: Vec<TextLine> = lines.iter().filter(is_alike).cloned().collect();
    if alike.is_empty() { lines.to_vec() } else { alike }
}

/// Counts the columns; columns after the last name count only if they are not empty.
fn width(names: &[String], sample: &[Vec<String>]) -> usize {
    let filled = |cells: &Vec<String>| cells.iter().rposition(|cell| !cell.is_empty());
    match names.len() {
        0 => sample[0].len(),
        count => sample.iter().filter_map(filled).map(|place| place + 1).fold(count, usize::max),
    }
}

/// The most frequent of these numbers; the largest one of a tie.
fn usual(widths: impl Iterator<Item = usize>) -> usize {
    let mut counts = BTreeMap::<usize, usize>::new();
    widths.for_each(|width| *counts.entry(width).or_default() += 1);
    counts.into_iter().max_by_key(|(width, count)| (*count, *width)).map_or(0, |(width, _)| width)
}

/// Splits a line into names; where spaces separate, a unit in brackets belongs to the name before it.
fn names(line: &str) -> Vec<String> {
    let separator = Separator::of(line);
    let mut names: Vec<String> = Vec::new();
    for cell in separator.cells(line) {
        match names.last_mut() {
            Some(name) if separator == Separator::Spaces && cell.starts_with(['[', '(']) => {
                *name = format!("{name} {cell}");
            }
            _ => names.push(cell.to_owned()),
        }
    }
    // A separator at the end of the line does not start a column.
    names.truncate(separator.width(line).max(1).min(names.len()));
    names
}

/// Reads the rate stated in comments [Hz], and the first line that is not a comment.
fn above(lines: &mut LineReader) -> Result<(Option<f64>, TextLine), TableError> {
    let mut rate_hz = None;
    loop {
        let Some(mut line) = lines.next()? else { return Err(TableError::Empty) };
        line.text = line.text.trim_start_matches('\u{feff}').to_owned();
        // A line `sep=` sets the separator for Excel.
        let is_for_excel = line.text.trim_matches('"').starts_with("sep=");
        let is_drawn = is_comment(&line.text) || is_rule(&line.text);
        if line.text.trim().is_empty() || is_drawn || is_for_excel {
            rate_hz = rate_hz.or_else(|| stated_rate_hz(&line.text));
        } else {
            return Ok((rate_hz, line));
        }
    }
}

/// Whether a column with such a name contains the time or the number of each row.
pub fn is_time_like(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    let words = ["time", "timer", "t", "index", "sample", "seconds", "date", "datetime"];
    let first = name.split([' ', '(', '[', '_']).next().unwrap_or_default();
    words.contains(&name.as_str())
        || words.contains(&first)
        || name.contains("timestamp")
        || ["measured_secs", "log_time_secs", "unix_secs"].contains(&name.as_str())
}

/// Whether a column that looks like times contains row numbers.
pub fn is_count_like(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    name.starts_with("index") || name.starts_with("sample")
}

/// Parses the sampling rate in a comment [Hz].
fn stated_rate_hz(comment: &str) -> Option<f64> {
    let lower = comment.to_ascii_lowercase();
    let after = lower.find("sampling").or_else(|| lower.find("sample rate"))?;
    let after = &lower[after..];
    let rate = after[after.find("rate")? + 4..].trim_start_matches(|c: char| !c.is_ascii_digit());
    let end = rate.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(rate.len());
    rate[..end].trim_end_matches('.').parse().ok().filter(|rate_hz: &f64| *rate_hz > 0.0)
}

/// Whether no cell of a line contains a number or a time.
fn is_names(line: &str) -> bool {
    let cells = || Separator::of(line).cells(line);
    cells().all(|cell| number(cell).is_none_or(f64::is_nan) && !is_time(cell))
        && cells().any(|cell| number(cell).is_none())
}

/// Whether a cell holds a time that is not a plain number.
fn is_time(cell: &str) -> bool {
    is_date(cell) || time_of_day_ns(cell).is_some() || minutes_ns(cell).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_may_give_the_rate() {
        assert_eq!(stated_rate_hz("# Sampling Rate (Hz):= 1000.00"), Some(1000.0));
        assert_eq!(stated_rate_hz("# sampling_rate_hz=1000; plux, 16 bit"), Some(1000.0));
        assert_eq!(stated_rate_hz("%Sample Rate = 250 Hz"), Some(250.0));
        assert_eq!(stated_rate_hz("# Resolution:= 12"), None);
        assert_eq!(stated_rate_hz("# sampling rate: unknown"), None);
    }

    #[test]
    fn times_and_row_numbers_are_not_signals() {
        for name in [
            "time",
            "Time (s)",
            "timestamp",
            "Phone timestamp",
            "sensor timestamp [ns]",
            "Shimmer_40AC_Timestamp_Unix_CAL",
            "measured_secs",
            "Sample Index",
            "index",
        ] {
            assert!(is_time_like(name), "{name}");
        }
        for name in ["temperature", "ECG", "Tx", "EXG Channel 0"] {
            assert!(!is_time_like(name), "{name}");
        }
    }

    #[test]
    fn a_unit_after_a_space_belongs_to_its_name() {
        assert_eq!(names("time [ms] ecg (mV) x"), ["time [ms]", "ecg (mV)", "x"]);
        assert_eq!(names("a b;[c]"), ["a b", "[c]"]);
    }

    #[test]
    fn a_line_with_a_date_is_not_a_header() {
        assert!(is_names("Phone timestamp;ecg [uV]") && is_names("ms;uS;"));
        assert!(!is_names("2021-04-05T15:48:04.834;start") && !is_names("1;2"));
        assert!(!is_names("00:01.250;start") && !is_names("15:48:04;start"));
    }
}
