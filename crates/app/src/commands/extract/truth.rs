//! Events that an expert marked.

use std::path::Path;

use super::table::{Table, TableError, Wanted};

/// Reads the places of true events [samples] from a table's column `sample`, or `time_secs`, or from
/// the first column of a table without names.
pub fn read(path: &Path, rate_hz: f64) -> Result<Vec<f64>, TableError> {
    match column(path, "sample") {
        Err(TableError::NoColumn { there, .. }) if there.iter().any(|name| name == "time_secs") => {
            let times_secs = column(path, "time_secs")?;
            Ok(times_secs.into_iter().map(|secs| secs * rate_hz).collect())
        }
        Err(TableError::NoColumn { there, .. })
            if there.first().is_some_and(|name| name == "1") =>
        {
            column(path, "1")
        }
        read => read,
    }
}

/// The columns with the times of events [s]: of tables that `extract` reads and writes, of `events.tsv`, and of events
/// that `export` writes.
const TIMES: [&str; 3] = ["time_secs", "onset", "measured_secs"];

/// Reads the times of events [s] from a table's column `time_secs`, `onset` or `measured_secs`, or `sample` where
/// samples have times.
pub fn times_secs(
    path: &Path,
    of_sample: Option<&dyn Fn(f64) -> f64>,
) -> Result<Vec<f64>, TableError> {
    let there = match column(path, TIMES[0]) {
        Err(TableError::NoColumn { there, .. }) => there,
        read => return read,
    };
    let is_there = |wanted: &str| there.iter().any(|name| name == wanted);
    match (TIMES.into_iter().find(|name| is_there(name)), of_sample) {
        (Some(times), _) => column(path, times),
        (None, Some(of_sample)) if is_there("sample") => {
            Ok(column(path, "sample")?.into_iter().map(of_sample).collect())
        }
        _ => Err(TableError::NoColumn { wanted: TIMES[0].to_owned(), there }),
    }
}

fn column(path: &Path, name: &str) -> Result<Vec<f64>, TableError> {
    let wanted = Wanted {
        signal: "true events",
        words: &[],
        takes_all: false,
        channels: None,
        unit: None,
        is_even: true,
        least_hz: 0.0,
        columns: vec![name.to_owned()],
        time: None,
        decimal: None,
    };
    let mut table = Table::open(path, &wanted, Some(1.0))?;
    let mut places = Vec::new();
    while let Some(row) = table.next_row()? {
        places.extend(row.values.iter().filter(|place| place.is_finite()));
    }
    Ok(places)
}
