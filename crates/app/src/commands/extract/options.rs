//! The values that options of `extract` may have, and the messages about unreadable tables.

use teampulse_core::counted::counted;

use super::found::Found;
use super::rows::Rows;
use super::table::TableError;
use crate::exit::Exit;
use crate::failure::Failure;

/// Shortest window, and shortest time between two windows [s].
const SHORTEST_SECS: f64 = 0.1;

/// The error shown for a table that can't be read.
pub fn failure(error: TableError) -> Failure {
    let hint = error.hint();
    let exit = match error {
        TableError::Twice { .. }
        | TableError::NoColumn { .. }
        | TableError::WhichColumn { .. }
        | TableError::TextColumn { .. }
        | TableError::WhichComma { .. }
        | TableError::Ragged { .. }
        | TableError::Bursts { .. }
        | TableError::Coarse { .. }
        | TableError::NoRate { .. }
        | TableError::NoStep { .. } => Exit::BadArguments,
        _ => Exit::Failed,
    };
    Failure::to(error).hint(hint).exit(exit)
}

/// Prints notes on what the table lacks on standard error.
pub fn warn(read: &Rows, found: &mut Found) {
    let (rows, missing, left_out) = (read.table().rows(), found.missing, found.left_out);
    read.oddities().chain(read.overlapping()).for_each(|note| found.note(note));
    if missing > 0 {
        let lacking = counted(missing, "row is", "rows are");
        let besides = counted(rows, "row", "rows");
        found.note(format!(
            "{lacking} missing according to the times: their samples count as missing (the table has {besides})"
        ));
    }
    if left_out.count > 0 {
        found.note(format!(
            "{}: skipped (of {rows} rows)",
            left_out.words(
                "row is not later than the row before",
                "rows are not later than the row before them"
            )
        ));
    }
}

pub fn rate(text: &str) -> Result<f64, String> {
    let rate_hz = text.parse::<f64>().ok().filter(|rate_hz| (1e-3..=1e6).contains(rate_hz));
    rate_hz.ok_or_else(|| "expected a rate from 0.001 to 1000000 Hz".into())
}

pub fn mains(text: &str) -> Result<f64, String> {
    match text {
        "50" => Ok(50.0),
        "60" => Ok(60.0),
        _ => Err("expected a mains frequency of 50 or 60 Hz".into()),
    }
}

pub fn seconds(text: &str) -> Result<f64, String> {
    let secs = text.parse::<f64>().ok().filter(|secs| (SHORTEST_SECS..=1e6).contains(secs));
    secs.ok_or_else(|| format!("expected seconds, from {SHORTEST_SECS} to 1000000"))
}

pub fn factor(text: &str) -> Result<f64, String> {
    let factor = text.parse::<f64>().ok().filter(|factor| factor.is_finite() && *factor != 0.0);
    factor.ok_or_else(|| "expected a number that is not 0".into())
}
