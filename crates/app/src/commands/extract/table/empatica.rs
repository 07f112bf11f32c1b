//! Files of Empatica's E4, whose first lines state the start time and the rate.

use super::error::TableError;
use super::line::{Separator, number};
use super::line_reader::{LineReader, TextLine};
use super::times::nanos;

/// The earliest start time of such files [s since 1970]: the year 2001.
const EARLIEST_SECS: f64 = 1e9;
/// The sampling rates of such files [Hz].
const RATES_HZ: [f64; 4] = [1.0, 4.0, 32.0, 64.0];
const SEC_NS: i64 = 1_000_000_000;

/// The header of a file of an E4.
pub struct E4 {
    /// The start time [ns since 1970].
    pub begin_ns: i64,
    /// The rate [Hz]; `None` for intervals, where each line states when the interval ended.
    pub rate_hz: Option<f64>,
}

impl E4 {
    /// Parses the header of an E4 file: the start time, then the rate, both in every column; for intervals between
    /// beats, the time and the word `IBI`. Lines after the first are consumed only if this is such a file.
    pub fn read(
        first: &TextLine,
        separator: Separator,
        lines: &mut LineReader,
    ) -> Result<Option<E4>, TableError> {
        let mut cells = separator.cells(&first.text);
        let begin_ns = cells.next().and_then(|cell| nanos(cell, SEC_NS).ok().flatten());
        let Some(begin_ns) = begin_ns else { return Ok(None) };
        if cells.next() == Some("IBI") && cells.next().is_none() {
            return Ok(Some(E4 { begin_ns, rate_hz: None }));
        }
        if !same(&first.text, separator).is_some_and(|secs| secs >= EARLIEST_SECS) {
            return Ok(None);
        }
        let Some(second) = lines.next_data()? else { return Ok(None) };
        let rate_hz = same(&second.text, separator).filter(|hz| RATES_HZ.contains(hz));
        let value = || first.text.chars().take(40).collect();
        let rate_hz = Some(rate_hz.ok_or_else(|| TableError::Begin { value: value() })?);
        Ok(Some(E4 { begin_ns, rate_hz }))
    }
}

/// Returns the number that all cells of a line contain, if they are equal.
fn same(line: &str, separator: Separator) -> Option<f64> {
    let mut cells = separator.cells(line).map(number);
    let value = cells.next().flatten()?;
    cells.all(|cell| cell == Some(value)).then_some(value)
}
