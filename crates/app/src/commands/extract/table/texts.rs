//! Columns of text: labels, and dates in tables that have no numbers.

use std::path::Path;

use super::clock::Clock;
use super::dates::order;
use super::error::TableError;
use super::head::Head;
use super::line::Separator;
use super::line_reader::LineReader;

/// Returns the cells of a column by its name, row by row; `None` if the table has no such column.
pub fn text_column(path: &Path, name: &str) -> Result<Option<Vec<String>>, TableError> {
    let mut lines = LineReader::open(path)?;
    let mut head = Head::read(&mut lines, false, None)?;
    let Some(place) = head.names.iter().position(|each| each == name) else { return Ok(None) };
    // A space between a date and a time does not separate cells.
    let is_alone = head.names.len() == 1 && head.separator == Separator::Spaces;
    let mut cells = Vec::new();
    let mut line = head.first.take();
    while let Some(read) = line {
        let cell = head.separator.cells(&read.text).nth(place).unwrap_or_default();
        cells.push(if is_alone { read.text.trim() } else { cell }.to_owned());
        line = lines.next_data()?;
    }
    Ok(Some(cells))
}

/// Reads the cells of a column as dates [s since 1970], NaN where one is missing, with a note on how they are read,
/// empty if there is nothing to note. Returns `None` if the cells are not dates.
pub fn dates_secs(name: &str, cells: &[String]) -> Option<(Vec<f64>, String)> {
    let is_there = |cell: &&str| !["", "n/a", "nan"].contains(&&*cell.to_ascii_lowercase());
    let there: Vec<&str> = cells.iter().map(String::as_str).filter(is_there).collect();
    order(&there)?;
    let mut clock = Clock::recognised(name, &there, 0.0)?;
    let secs = |cell: &String| match clock.read(cell) {
        Ok(Some(at_ns)) => at_ns as f64 / 1e9,
        _ => f64::NAN,
    };
    let secs = cells.iter().map(secs).collect();
    Some((secs, clock.note))
}
