//! Tables of numbers, as people and devices write them.

mod columns;
mod error;
mod head;
mod line;
mod times;

use std::collections::VecDeque;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

pub use columns::Wanted;
pub use error::TableError;

use columns::Columns;
use head::Head;
use line::number;
use times::{nanos, usual_rate_hz};

/// Rows that the rate is told from, where nothing else tells it.
const FIRST_ROWS: usize = 2000;
/// Longest line [bytes]: what is longer is no table.
const LONGEST_LINE: u64 = 1 << 20;

/// A table that is read row by row.
///
/// Separated by commas, semicolons (decimal commas allowed), tabs or spaces; with or without a line
/// of names; comments begin with `#` or `%`, and a sampling rate that they tell is believed, as are
/// the two first lines of Empatica's E4. Split here, not by a library: half of the tables in this
/// field are columns of text between comments, no CSV.
pub struct Table {
    lines: Lines,
    /// Rows that were read to learn the rate.
    ahead: VecDeque<Row>,
    columns: Columns,
    head: Head,
    rate_hz: f64,
    /// Rows that were given out.
    rows: usize,
    /// Cells of them that hold no number.
    missing: usize,
}

/// The wanted cells of a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// A number for each wanted column, NaN where there is none.
    pub values: Vec<f64>,
    /// When it was measured [ns]; `None` where no column tells.
    pub at_ns: Option<i64>,
    /// The number of its line, from 1.
    pub line: usize,
}

impl Table {
    /// Opens a table and finds the wanted columns in it; `-` is standard input.
    pub fn open(path: &Path, wanted: &Wanted, rate_hz: Option<f64>) -> Result<Table, TableError> {
        let opened = |error| TableError::Open { path: path.to_owned(), error };
        let (input, bytes): (Box<dyn Read>, u64) = if path == Path::new("-") {
            (Box::new(std::io::stdin()), 0)
        } else {
            let file = File::open(path).map_err(opened)?;
            let bytes = file.metadata().map_err(opened)?.len();
            (Box::new(file), bytes)
        };
        let mut lines = Lines {
            input: BufReader::with_capacity(1 << 18, input),
            number: 0,
            text: String::new(),
            read: 0,
            bytes,
        };
        let head = Head::read(&mut lines)?;
        let columns = Columns::choose(&head, wanted)?;
        let mut table = Table {
            lines,
            ahead: VecDeque::new(),
            columns,
            rate_hz: 0.0,
            rows: 0,
            missing: 0,
            head,
        };
        table.rate_hz = match rate_hz.or(table.head.rate_hz) {
            Some(rate_hz) => rate_hz,
            None => table.learnt_rate_hz(wanted)?,
        };
        Ok(table)
    }

    /// When the table says that it begins [ns since 1970].
    pub fn begin_ns(&self) -> Option<i64> {
        self.head.begin_ns
    }

    /// Samples a second [Hz].
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Names of the columns that are read.
    pub fn names(&self) -> &[String] {
        &self.columns.names
    }

    /// The share of the file that was read [0..1]; `None` when its length is not known.
    pub fn read_share(&self) -> Option<f64> {
        (self.lines.bytes > 0).then(|| self.lines.read as f64 / self.lines.bytes as f64)
    }

    /// How many rows were read.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// How many cells of them hold no number.
    pub fn missing(&self) -> usize {
        self.missing
    }

    /// The next row.
    pub fn next_row(&mut self) -> Result<Option<Row>, TableError> {
        let next = match self.ahead.pop_front() {
            Some(row) => Some(row),
            None => self.read_row()?,
        };
        if let Some(row) = &next {
            self.rows += 1;
            self.missing += row.values.iter().filter(|value| value.is_nan()).count();
        }
        Ok(next)
    }

    fn learnt_rate_hz(&mut self, wanted: &Wanted) -> Result<f64, TableError> {
        if !wanted.is_even {
            return Ok(1.0);
        }
        if self.columns.time.is_none() {
            return Err(TableError::NoRate { time: self.head.time_like() });
        }
        while self.ahead.len() < FIRST_ROWS
            && let Some(row) = self.read_row()?
        {
            self.ahead.push_back(row);
        }
        let times_ns: Vec<i64> = self.ahead.iter().filter_map(|row| row.at_ns).collect();
        usual_rate_hz(&times_ns).ok_or(TableError::NoRate { time: None })
    }

    /// Reads the next line with data.
    fn read_row(&mut self) -> Result<Option<Row>, TableError> {
        let separator = self.head.separator;
        let line = match self.head.first.take() {
            Some(first) => first,
            None => loop {
                match self.lines.next()? {
                    None => return Ok(None),
                    Some(text) if is_data(text) => break text.to_owned(),
                    Some(_) => {}
                }
            },
        };
        let mut row = Row {
            values: vec![f64::NAN; self.columns.places.len()],
            at_ns: None,
            line: self.lines.number,
        };
        for (place, cell) in separator.cells(&line).enumerate() {
            let time = self.columns.time.filter(|time| time.place == place);
            if let Some(time) = time {
                row.at_ns = nanos(cell, time.ns).map_err(|()| self.text(place, cell))?;
            }
            for (value, &wanted) in row.values.iter_mut().zip(&self.columns.places) {
                if wanted == place {
                    *value = number(cell, separator).ok_or_else(|| self.text(place, cell))?;
                }
            }
        }
        Ok(Some(row))
    }

    fn text(&self, place: usize, cell: &str) -> TableError {
        TableError::Text {
            line: self.lines.number,
            column: self.head.name(place),
            text: cell.chars().take(40).collect(),
        }
    }
}

fn is_data(line: &str) -> bool {
    !(line.trim().is_empty() || head::is_comment(line))
}

/// The lines of a file, counted.
struct Lines {
    input: BufReader<Box<dyn Read>>,
    number: usize,
    text: String,
    read: u64,
    bytes: u64,
}

impl Lines {
    fn next(&mut self) -> Result<Option<&str>, TableError> {
        let mut bytes = std::mem::take(&mut self.text).into_bytes();
        bytes.clear();
        self.number += 1;
        let read = (&mut self.input).take(LONGEST_LINE).read_until(b'\n', &mut bytes);
        let read = read.map_err(|error| TableError::Read { line: self.number, error })? as u64;
        self.read += read;
        if read == LONGEST_LINE || bytes.contains(&0) {
            return Err(TableError::NoTable { line: self.number });
        }
        self.text = String::from_utf8_lossy(&bytes).into_owned();
        Ok((read > 0).then(|| self.text.trim_end_matches(['\n', '\r'])))
    }
}

#[cfg(test)]
mod tests;
