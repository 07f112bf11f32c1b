//! The order of a table's columns, which may be added to while rows are written.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::Path;

use teampulse_bag::private;

use super::cells::quoted;

/// The columns before the values.
const TIMES: [&str; 3] = ["measured_secs", "log_time_secs", "index"];
/// The maximum number of columns that a table may gain after its header.
const MOST_GAINED: usize = 10_000;

/// The columns of a table. Rows have them in the order in which they were found; in the finished table, a new column is
/// beside the one that it follows in its message.
#[derive(Default)]
pub(super) struct Layout {
    /// The names, in the order of the rows.
    names: Vec<String>,
    /// The index within a row of each column of the finished table.
    order: Vec<usize>,
    places: BTreeMap<String, usize>,
    /// The number of columns in the header.
    headed: usize,
}

impl Layout {
    pub(super) fn new(names: Vec<String>) -> Layout {
        let mut layout = Layout { headed: names.len(), ..Layout::default() };
        for name in names {
            layout.add(name, layout.order.len());
        }
        layout
    }

    /// The number of columns.
    pub(super) fn width(&self) -> usize {
        self.names.len()
    }

    /// Returns the index in a row of a value that follows the one at `before`. Adds a column if the name is new;
    /// returns `None` if the table would have too many columns.
    pub(super) fn place(&mut self, name: &str, before: Option<usize>) -> Option<usize> {
        let next = before.map_or(0, |before| before + 1);
        // Usually the same values arrive in the same order.
        if self.names.get(next).is_some_and(|known| known == name) {
            return Some(next);
        }
        if let Some(place) = self.places.get(name) {
            return Some(*place);
        }
        if self.names.len() >= self.headed + MOST_GAINED {
            return None;
        }
        let after = before.and_then(|before| self.order.iter().position(|place| *place == before));
        self.add(name.to_owned(), after.map_or(0, |after| after + 1));
        Some(self.names.len() - 1)
    }

    fn add(&mut self, name: String, at: usize) {
        self.order.insert(at, self.names.len());
        self.places.insert(name.clone(), self.names.len());
        self.names.push(name);
    }

    /// The header of the finished table, as far as it is known.
    pub(super) fn header(&self) -> String {
        let names = self.order.iter().map(|place| quoted(&self.names[*place]));
        let all = TIMES.into_iter().map(str::to_owned).chain(names);
        all.collect::<Vec<_>>().join(",")
    }

    /// Adds the columns that the table has gained since its header was written: in their places, and in every row.
    pub(super) fn complete(&self, table: &Path) -> io::Result<()> {
        if self.names.len() == self.headed {
            return Ok(());
        }
        let unfinished = table.with_extension("csv.unfinished");
        let written = self.rewrite(table, &unfinished);
        written.and_then(|()| fs::rename(&unfinished, table)).inspect_err(|_| {
            drop(fs::remove_file(&unfinished));
        })
    }

    fn rewrite(&self, table: &Path, to: &Path) -> io::Result<()> {
        let mut rows = BufReader::new(File::open(table)?);
        let mut to = BufWriter::new(private::create(to)?);
        let mut row = String::new();
        read_row(&mut rows, &mut row)?;
        writeln!(to, "{}", self.header())?;
        while read_row(&mut rows, &mut row)? {
            let cells: Vec<&str> = split(row.trim_end_matches('\n'));
            let (times, values) = cells.split_at(TIMES.len().min(cells.len()));
            write!(to, "{}", times.join(","))?;
            for place in &self.order {
                write!(to, ",{}", values.get(*place).copied().unwrap_or_default())?;
            }
            writeln!(to)?;
        }
        to.flush()
    }
}

/// Reads the next row, whose quoted cells may span several lines; returns whether there was one.
fn read_row(rows: &mut impl BufRead, row: &mut String) -> io::Result<bool> {
    row.clear();
    while rows.read_line(row)? > 0 {
        if row.matches('"').count().is_multiple_of(2) {
            return Ok(true);
        }
    }
    Ok(!row.is_empty())
}

/// Splits a row into its cells, which keep their quotes.
fn split(row: &str) -> Vec<&str> {
    let mut is_quoted = false;
    let outside = |letter: char| {
        is_quoted ^= letter == '"';
        letter == ',' && !is_quoted
    };
    row.split(outside).collect()
}
