//! Tables of numbers, as written by people and devices.

mod beats;
mod clock;
mod columns;
mod dates;
mod dialect;
mod empatica;
mod error;
mod grid;
mod head;
mod line;
mod line_reader;
mod oddity;
mod sampling;
mod texts;
mod times;
mod units;
mod utf16;

use std::collections::VecDeque;
use std::path::Path;

pub use columns::Wanted;
pub use dialect::Decimal;
pub use error::TableError;
pub use grid::Grid;
pub use oddity::Oddity;
pub use sampling::Sampling;
pub use texts::{dates_secs, text_column};
pub use units::{is_raw, is_unit, without_unit};

use columns::{Columns, is_own_time};
use head::Head;
use line::number;
use line_reader::{LineReader, TextLine};
use oddity::Oddities;
use times::Uneven;

/// The most rows, and the most cells, from which the sampling is estimated.
const FIRST_ROWS: usize = 20_000;
const FIRST_CELLS: usize = 1 << 20;

/// A table that is read row by row.
///
/// Cells are separated by commas, semicolons, bars, tabs or spaces, with decimal points or commas; with or without a
/// header, and with or without a line of units below it. Empty lines are ignored, except in a table of only a column of
/// samples, where an empty line between others is a missing sample. Comments start with `#` or `%`; a sampling rate in
/// them is used, as are the first two lines of a file of Empatica's E4. Times are numbers in any unit, or dates. Parsed
/// here, not by a library: half of the tables in this field are columns of text between comments, not CSV.
pub struct Table {
    lines: LineReader,
    /// Rows that were read ahead to estimate the rate.
    ahead: VecDeque<Row>,
    columns: Columns,
    head: Head,
    /// Whether an empty line between others is a missing sample: only if each line holds one sample and nothing else.
    counts_empty: bool,
    sampling: Sampling,
    /// The number of rows returned so far.
    rows: usize,
    oddities: Oddities,
}

/// The wanted cells of a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// A number for each wanted column, NaN where there is none.
    pub values: Vec<f64>,
    /// When it was measured [ns]; `None` without a column of times.
    pub at_ns: Option<i64>,
    /// The number of its line, from 1.
    pub line: usize,
    /// How the number of cells in its line compares with that of other lines.
    width: Width,
}

/// How the number of cells in a line compares with that of other lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Width {
    Usual,
    /// The line ends before a wanted cell.
    Short,
    /// The cells can't be assigned to columns.
    Other,
}

impl Table {
    /// Opens a table and finds the wanted columns in it; `-` is standard input.
    pub fn open(path: &Path, wanted: &Wanted, rate_hz: Option<f64>) -> Result<Table, TableError> {
        let mut lines = LineReader::open(path)?;
        let takes_one = !wanted.takes_all && wanted.columns.is_empty();
        let head = Head::read(&mut lines, takes_one, wanted.decimal)?;
        let columns = Columns::choose(&head, wanted, rate_hz)?;
        let counts_empty = wanted.is_even && head.width == 1 && !lines.is_double_spaced();
        let mut table = Table {
            lines,
            counts_empty,
            ahead: VecDeque::new(),
            columns,
            sampling: Sampling::even(1.0),
            rows: 0,
            oddities: Oddities::default(),
            head,
        };
        table.sampling = table.learnt(wanted, rate_hz.or(table.head.rate_hz))?;
        Ok(table)
    }

    /// The start time that the table states [ns since 1970].
    pub fn begin_ns(&self) -> Option<i64> {
        self.head.begin_ns.or(self.columns.begin_ns)
    }

    /// Samples per second [Hz].
    pub fn rate_hz(&self) -> f64 {
        self.sampling.rate_hz
    }

    /// How rows with times are sampled; `None` without a column of times.
    pub fn sampling(&self) -> Option<Sampling> {
        self.columns.time.is_some().then_some(self.sampling)
    }

    /// Returns the times of up to `count` of the next rows [ns].
    pub fn following_ns(&mut self, count: usize) -> Result<Vec<i64>, TableError> {
        Ok(self.peek(count)?.filter_map(|row| row.at_ns).collect())
    }

    /// Names of the columns that are read.
    pub fn names(&self) -> &[String] {
        &self.columns.names
    }

    /// The unit of each column that is read, as far as the table states it.
    pub fn units(&self) -> &[Option<String>] {
        &self.columns.units
    }

    /// Notes on choices made in reading the table that the user did not ask for.
    pub fn notes(&self) -> &[String] {
        &self.columns.notes
    }

    /// The fraction of the file that was read [0..1]; `None` if its length is not known.
    pub fn read_share(&self) -> Option<f64> {
        self.lines.read_share()
    }

    /// The number of rows read so far.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Describes the oddities of the rows.
    pub fn oddities(&self) -> impl Iterator<Item = String> {
        self.oddities.notes(self.rows)
    }

    /// Returns up to `count` of the next rows without consuming them.
    pub fn peek(&mut self, count: usize) -> Result<impl Iterator<Item = &Row>, TableError> {
        while self.ahead.len() < count
            && let Some(row) = self.read_row()?
        {
            self.ahead.push_back(row);
        }
        Ok(self.ahead.iter().take(count))
    }

    /// Returns the next row.
    pub fn next_row(&mut self) -> Result<Option<Row>, TableError> {
        let next = match self.ahead.pop_front() {
            Some(row) => Some(row),
            None => self.read_row()?,
        };
        if let Some(row) = &next {
            self.rows += 1;
            self.judge(row);
        }
        Ok(next)
    }

    /// Counts the oddities of a row.
    fn judge(&mut self, row: &Row) {
        let Oddities { missing, short, other } = &mut self.oddities;
        let (oddity, count) = match row.width {
            Width::Usual => (missing, row.values.iter().filter(|value| value.is_nan()).count()),
            Width::Short => (short, 1),
            Width::Other => (other, 1),
        };
        oddity.add(count, row.line);
    }

    /// Estimates the sampling of the rows, at the known rate if there is one [Hz].
    fn learnt(&mut self, wanted: &Wanted, known_hz: Option<f64>) -> Result<Sampling, TableError> {
        if !wanted.is_even {
            return Ok(Sampling::even(known_hz.unwrap_or(1.0)));
        }
        let Some(time) = &self.columns.time else {
            let no_rate = || TableError::NoRate { time: self.head.time_like() };
            return known_hz.map(Sampling::even).ok_or_else(no_rate);
        };
        let column = self.head.name(time.place);
        let rows = FIRST_ROWS.min(FIRST_CELLS / self.columns.places.len().max(1));
        let times_ns = self.following_ns(rows)?;
        let sampling = match known_hz {
            Some(known_hz) => Some(Sampling::at(&times_ns, known_hz)),
            None => Sampling::of(&times_ns),
        };
        let Some(sampling) = sampling else {
            return Err(match times_ns.len() {
                0 | 1 => TableError::NoRate { time: None },
                _ => TableError::NoStep { column },
            });
        };
        let is_chosen = known_hz.is_some() || wanted.time.is_some() || is_own_time(&column);
        if let Some(uneven) = Uneven::of(&times_ns).filter(|_| !is_chosen) {
            match uneven {
                Uneven::Coarse { .. } if sampling.is_steady(times_ns.len()) => {}
                Uneven::Coarse { whole_hz } => return Err(TableError::Coarse { column, whole_hz }),
                Uneven::Bursts { within_hz, whole_hz } => {
                    return Err(TableError::Bursts { column, within_hz, whole_hz });
                }
            }
        }
        self.columns.notes.extend(sampling.note(&column));
        Ok(sampling)
    }

    fn next_line(&mut self) -> Result<Option<TextLine>, TableError> {
        if self.counts_empty { self.lines.next_data_or_empty() } else { self.lines.next_data() }
    }

    /// Reads the next row: a line with data or, where empty lines are missing samples, an empty line. `None` at the end.
    fn read_row(&mut self) -> Result<Option<Row>, TableError> {
        let line = match self.head.first.take() {
            Some(first) => first,
            None => match self.next_line()? {
                Some(line) => line,
                None => return Ok(None),
            },
        };
        let mut row = Row {
            values: vec![f64::NAN; self.columns.places.len()],
            at_ns: None,
            line: line.number,
            width: Width::Usual,
        };
        let head = &self.head;
        let text = |place: usize, cell: &str| TableError::Text {
            line: line.number,
            column: head.name(place),
            text: cell.chars().take(40).collect(),
        };
        let (mut cells, mut filled) = (0, 0);
        for (place, cell) in head.separator.cells(&line.text).enumerate() {
            cells = place + 1;
            filled = if cell.is_empty() { filled } else { cells };
            if let Some(time) = self.columns.time.as_mut().filter(|time| time.place == place) {
                row.at_ns = time.clock.read(cell).map_err(|()| text(place, cell))?;
            }
            for (value, &wanted) in row.values.iter_mut().zip(&self.columns.places) {
                if wanted == place {
                    *value = number(cell).ok_or_else(|| text(place, cell))?;
                }
            }
        }
        if head.is_of_other_width(&line.text, filled) {
            (row.width, row.values) = (Width::Other, vec![f64::NAN; row.values.len()]);
        } else if self.columns.places.iter().any(|&place| place >= cells) {
            row.width = Width::Short;
        }
        Ok(Some(row))
    }
}

#[cfg(test)]
mod tests;
