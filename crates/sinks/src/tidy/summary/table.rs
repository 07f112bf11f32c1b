//! A Markdown table that is readable as text.

use std::fmt;

use crate::tidy::file::on_one_line;

/// Rows of cells below a header, numbers aligned right.
#[derive(Debug)]
pub(super) struct Table {
    rows: Vec<Vec<String>>,
    /// The number of leading text columns.
    texts: usize,
}

impl Table {
    /// An empty table with this header and number of text columns.
    pub(super) fn new(head: impl IntoIterator<Item = String>, texts: usize) -> Table {
        let mut table = Table { rows: Vec::new(), texts };
        table.push(head);
        table
    }

    pub(super) fn push(&mut self, row: impl IntoIterator<Item = String>) {
        self.rows
            .push(row.into_iter().map(|cell| on_one_line(&cell).replace('|', "\\|")).collect());
    }

    pub(super) fn is_empty(&self) -> bool {
        self.rows.len() == 1
    }

    fn widths(&self) -> Vec<usize> {
        let width = |k: usize| {
            self.rows.iter().filter_map(|row| row.get(k)).map(|cell| cell.chars().count()).max()
        };
        (0..self.rows[0].len()).map(|k| width(k).unwrap_or(0).max(3)).collect()
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let widths = self.widths();
        for (number, row) in self.rows.iter().enumerate() {
            for (k, (cell, width)) in row.iter().zip(&widths).enumerate() {
                if k < self.texts {
                    write!(f, "| {cell:<width$} ")?;
                } else {
                    write!(f, "| {cell:>width$} ")?;
                }
            }
            writeln!(f, "|")?;
            if number == 0 {
                for (k, width) in widths.iter().enumerate() {
                    let line = "-".repeat(*width);
                    let end = if k < self.texts { "-" } else { ":" };
                    write!(f, "|-{line}{end}")?;
                }
                writeln!(f, "|")?;
            }
        }
        Ok(())
    }
}
