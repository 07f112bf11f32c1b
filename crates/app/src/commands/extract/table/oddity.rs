//! Oddities of a table's rows.

/// How often an oddity occurred, and where first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Oddity {
    /// How often.
    pub count: usize,
    /// The first line, from 1; 0 where there is none.
    pub first_line: usize,
}

impl Oddity {
    /// Counts occurrences in a line.
    pub fn add(&mut self, count: usize, line: usize) {
        if self.count == 0 && count > 0 {
            self.first_line = line;
        }
        self.count += count;
    }
}

/// The oddities of the rows that were read so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Oddities {
    /// Cells that contain no number.
    pub missing: Oddity,
    /// Rows that end before a wanted cell.
    pub short: Oddity,
    /// Rows with another number of cells, which can't be assigned to columns.
    pub other: Oddity,
}

impl Oddities {
    /// The note on each oddity.
    pub fn notes(&self, rows: usize) -> impl Iterator<Item = String> {
        let Oddities { missing, short, other } = *self;
        [
            (
                short,
                "rows have fewer cells than the others",
                "the cells that they lack count as missing",
            ),
            (other, "rows have more cells than the others", "all of their cells count as missing"),
            (missing, "cells hold no number", "those samples count as missing"),
        ]
        .into_iter()
        .filter(|(oddity, ..)| oddity.count > 0)
        .map(move |(Oddity { count, first_line }, what, so)| {
            format!("{count} {what}, the first in line {first_line}: {so} (of all {rows} rows)")
        })
    }
}
