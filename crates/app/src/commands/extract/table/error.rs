use std::io;
use std::path::PathBuf;

use thiserror::Error;

/// Why a table could not be read; completes "failed to".
#[derive(Debug, Error)]
pub enum TableError {
    /// The file can't be opened.
    #[error("open {}: {error}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// The reason.
        error: io::Error,
    },
    /// Reading failed.
    #[error("read line {line}: {error}")]
    Read {
        /// The line number, from 1.
        line: usize,
        /// The reason.
        error: io::Error,
    },
    /// There are no lines.
    #[error("find a line of numbers: the table is empty")]
    Empty,
    /// There are only words.
    #[error("find a line of numbers: the table has none")]
    NoNumbers,
    /// The file is not a table.
    #[error("read line {line}: the file is not a text table")]
    NoTable {
        /// The line number, from 1.
        line: usize,
    },
    /// The file is a sound file.
    #[error("read line 1: the file is a WAV file, not a text table")]
    Wav,
    /// A cell holds text where a number was expected.
    #[error("read line {line}: column {column} holds \"{text}\" where a number was expected")]
    Text {
        /// The line number, from 1.
        line: usize,
        /// The column's name, or its number from 1.
        column: String,
        /// The text.
        text: String,
    },
    /// A whole column holds text.
    #[error("take column {column}: it holds text (\"{text}\"), not numbers")]
    TextColumn {
        /// The column's name, or its number from 1.
        column: String,
        /// The first text in it.
        text: String,
    },
    /// The named column does not exist.
    #[error("find the column {wanted}; the table has: {}", listed(.there))]
    NoColumn {
        /// The requested column.
        wanted: String,
        /// The existing columns.
        there: Vec<String>,
    },
    /// A column is named twice.
    #[error("use the column {column} twice")]
    Twice {
        /// The column's name, or its number from 1.
        column: String,
    },
    /// Several columns match.
    #[error("choose the column with {signal}; the table has: {}", listed(.there))]
    WhichColumn {
        /// The signal that was looked for.
        signal: &'static str,
        /// The columns that match.
        there: Vec<String>,
    },
    /// A comma may be decimal, or separate two columns.
    #[error("interpret the comma in line {line}: \"{text}\" may be one number or two")]
    WhichComma {
        /// The line number, from 1.
        line: usize,
        /// The line.
        text: String,
    },
    /// There are more cells than names, and commas may be decimal.
    #[error(
        "interpret the commas in line {line}: it has {cells} cells, and there are {names} names"
    )]
    Ragged {
        /// The line number, from 1.
        line: usize,
        /// The number of cells, if all commas separate cells.
        cells: usize,
        /// The number of names.
        names: usize,
    },
    /// Nothing states the rate.
    #[error("find the sampling rate: neither the table nor --rate states it")]
    NoRate {
        /// A column that may hold times.
        time: Option<String>,
    },
    /// Times never increase.
    #[error("find the sampling rate: the times in column {column} never increase")]
    NoStep {
        /// The column with the times.
        column: String,
    },
    /// Rows come in bursts.
    #[error(
        "find the sampling rate: by column {column}, rows come in bursts, at {within_hz:.0} Hz within a burst and {whole_hz:.0} Hz overall"
    )]
    Bursts {
        /// The column with the times.
        column: String,
        /// The rate within a burst [Hz].
        within_hz: f64,
        /// The rate overall [Hz].
        whole_hz: f64,
    },
    /// Several rows share each time.
    #[error("find the sampling rate: several rows share each time in column {column}")]
    Coarse {
        /// The column with the times.
        column: String,
        /// Rows per second [Hz].
        whole_hz: f64,
    },
    /// Two successive rows are too far apart in time.
    #[error("follow the times: line {line} is {step_secs:.0} s after the one before it")]
    Jump {
        /// The line number, from 1.
        line: usize,
        /// The time between the rows [s].
        step_secs: f64,
    },
    /// A row is earlier than one before it.
    #[error("follow the times: line {line} is {step_secs:.1} s before an earlier line")]
    Back {
        /// The line number, from 1.
        line: usize,
        /// How much earlier the row is [s].
        step_secs: f64,
    },
    /// The table starts like a file of Empatica's E4 but is not one.
    #[error("interpret the first line: {value} looks like a time, but no rate follows it")]
    Begin {
        /// The first value.
        value: String,
    },
}

impl TableError {
    /// The remedy.
    pub fn hint(&self) -> String {
        match self {
            TableError::Open { .. } | TableError::Read { .. } => String::new(),
            TableError::Empty | TableError::NoNumbers | TableError::NoTable { .. } => {
                "a table has one number per line, or several separated by commas, semicolons, bars, tabs or spaces"
                    .into()
            }
            TableError::Wav => {
                "write its samples as a table, as with `sox voice.wav voice.dat`, and give voice.dat with --column 2"
                    .into()
            }
            TableError::Text { .. } => {
                "leave the cell of a missing sample empty, or write NaN into it; give the unit of times \
                 that are not in seconds as in --time timer:ms (also timer:mm:ss, timer:excel)"
                    .into()
            }
            TableError::Twice { .. } => "each column is a separate channel: name it only once".into(),
            TableError::TextColumn { .. }
            | TableError::NoColumn { .. }
            | TableError::WhichColumn { .. } => {
                "name it with --column NAME, or by its number from 1".into()
            }
            TableError::WhichComma { .. } => {
                "give --decimal comma for one number per line, or --decimal point for two columns"
                    .into()
            }
            TableError::Ragged { .. } => {
                "if commas are decimal, save the table with semicolons or tabs, or with its cells in quotes; \
                 if they are not, give --decimal point"
                    .into()
            }
            TableError::NoRate { time: Some(time) } => {
                format!("give --rate HZ, or --time \"{time}\" if that column holds times")
            }
            TableError::NoRate { time: None } => {
                "give --rate HZ, or name the column with the times: --time NAME".into()
            }
            TableError::NoStep { .. } => {
                "sort the table by its times, or give the device's rate with --rate HZ".into()
            }
            TableError::Bursts { column, .. } => format!(
                "these are arrival times: give the device's rate with --rate HZ, or --time \"{column}\" \
                 if nothing was measured between the bursts"
            ),
            TableError::Coarse { whole_hz, .. } => {
                format!("give the device's rate with --rate HZ: there are {whole_hz:.1} rows per second")
            }
            TableError::Jump { .. } => {
                "correct that time, or split the table there; give another unit as in --time timer:ms"
                    .into()
            }
            TableError::Back { .. } => {
                "sort the table by its times, or split it at that line and use the parts one by one"
                    .into()
            }
            TableError::Begin { .. } => "start the table with its samples".into(),
        }
    }
}

/// The most column names that are listed.
const MOST_LISTED: usize = 30;

/// Lists names of columns; of many, only the first.
fn listed(names: &[String]) -> String {
    match names.len().saturating_sub(MOST_LISTED) {
        0 => names.join(", "),
        more => format!("{} and {more} more", names[..MOST_LISTED].join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_columns_the_first_are_listed() {
        let there: Vec<String> = (1..=75_000).map(|number| number.to_string()).collect();
        let message = TableError::WhichColumn { signal: "ecg", there }.to_string();
        assert!(message.ends_with("29, 30 and 74970 more") && message.len() < 200, "{message}");
    }
}
