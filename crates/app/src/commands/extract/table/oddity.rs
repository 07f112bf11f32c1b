//! Oddities of a table's rows.

use teampulse_core::counted::counted;

/// How often an oddity occurred, and in which line first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Oddity {
    /// The number of occurrences.
    pub count: usize,
    /// The first line, from 1; 0 if there is none.
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

    /// Describes the oddity: how often it occurred, and in which line first.
    pub fn words(self, one: &str, several: &str) -> String {
        let first = if self.count == 1 { "" } else { "the first " };
        format!("{}, {first}in line {}", counted(self.count, one, several), self.first_line)
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
    /// Returns a note on each oddity.
    pub fn notes(&self, rows: usize) -> impl Iterator<Item = String> {
        let Oddities { missing, short, other } = *self;
        [
            (
                short,
                ["row has fewer cells than the others", "rows have fewer cells than the others"],
                "absent cells count as missing",
            ),
            (
                other,
                ["row has more cells than the others", "rows have more cells than the others"],
                "all cells of such a row count as missing",
            ),
            (
                missing,
                ["cell is not a number", "cells are not numbers"],
                "counted as missing samples",
            ),
        ]
        .into_iter()
        .filter(|(oddity, ..)| oddity.count > 0)
        .map(move |(oddity, [one, several], so)| {
            format!("{}: {so} (of {rows} rows)", oddity.words(one, several))
        })
    }
}
