use std::io;
use std::path::PathBuf;

use thiserror::Error;

/// Why a table could not be read; fits behind "failed to".
#[derive(Debug, Error)]
pub enum TableError {
    /// The file can't be opened.
    #[error("open {}: {error}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// Why not.
        error: io::Error,
    },
    /// Reading broke off.
    #[error("read line {line}: {error}")]
    Read {
        /// From 1.
        line: usize,
        /// Why.
        error: io::Error,
    },
    /// There are no numbers.
    #[error("find a line of numbers: the table is empty")]
    Empty,
    /// The file is something else.
    #[error("read line {line}: the file is no table of text")]
    NoTable {
        /// From 1.
        line: usize,
    },
    /// A cell holds text where a number was expected.
    #[error("read line {line}: column {column} holds \"{text}\" where a number was expected")]
    Text {
        /// From 1.
        line: usize,
        /// Its name, or its number from 1.
        column: String,
        /// What stands there.
        text: String,
    },
    /// A whole column holds text.
    #[error("take column {column}: it holds text (\"{text}\"), no numbers")]
    TextColumn {
        /// Its name, or its number from 1.
        column: String,
        /// What stands there first.
        text: String,
    },
    /// The named column is not there.
    #[error("find the column {wanted}; there are: {}", .there.join(", "))]
    NoColumn {
        /// What was asked for.
        wanted: String,
        /// What there is.
        there: Vec<String>,
    },
    /// Several columns could be meant.
    #[error("tell which column holds {signal}; there are: {}", .there.join(", "))]
    WhichColumn {
        /// What was looked for.
        signal: &'static str,
        /// What there is.
        there: Vec<String>,
    },
    /// A comma may be a decimal one, or stand between two columns.
    #[error("tell what the comma in line {line} is: \"{text}\" may be one number or two")]
    WhichComma {
        /// From 1.
        line: usize,
        /// The line.
        text: String,
    },
    /// There are more cells than names, and commas may be decimal ones.
    #[error(
        "tell the commas in line {line} apart: it has {cells} cells, and there are {names} names"
    )]
    Ragged {
        /// From 1.
        line: usize,
        /// How many cells it has, if all commas separate.
        cells: usize,
        /// How many names there are.
        names: usize,
    },
    /// Nothing tells the rate.
    #[error("tell the sampling rate: neither the table nor --rate says it")]
    NoRate {
        /// A column that may hold times.
        time: Option<String>,
    },
    /// Rows come in bursts.
    #[error(
        "tell the sampling rate: by column {column} rows come in bursts, with {within_hz:.0} Hz within them and \
         {whole_hz:.0} Hz on the whole"
    )]
    Bursts {
        /// The column with the times.
        column: String,
        /// Within a burst [Hz].
        within_hz: f64,
        /// On the whole [Hz].
        whole_hz: f64,
    },
    /// Several rows share each time.
    #[error("tell the sampling rate: several rows share each time in column {column}")]
    Coarse {
        /// The column with the times.
        column: String,
        /// Rows a second [Hz].
        whole_hz: f64,
    },
    /// Two successive rows lie too far apart.
    #[error("follow the times: line {line} is {step_secs:.0} s after the one before it")]
    Jump {
        /// From 1.
        line: usize,
        /// How far [s].
        step_secs: f64,
    },
    /// It begins like a file of Empatica's, and is none.
    #[error("tell what the first line means: {value} looks like a time, and no rate follows it")]
    Begin {
        /// What stands there.
        value: String,
    },
}

impl TableError {
    /// What the user can do.
    pub fn hint(&self) -> String {
        match self {
            TableError::Open { .. } | TableError::Read { .. } => String::new(),
            TableError::Empty | TableError::NoTable { .. } => {
                "a table has a number a line, or several between commas, semicolons, bars, tabs or spaces"
                    .into()
            }
            TableError::Text { .. } => {
                "leave the cell of a missing sample empty, or write NaN into it; times in another unit \
                 than seconds are named as in --time timer:ms (also timer:mm:ss, timer:excel)"
                    .into()
            }
            TableError::TextColumn { .. }
            | TableError::NoColumn { .. }
            | TableError::WhichColumn { .. } => {
                "name it with --column NAME, or by its number from 1".into()
            }
            TableError::WhichComma { .. } => {
                "give --decimal comma for one number a line, or --decimal point for two columns"
                    .into()
            }
            TableError::Ragged { .. } => {
                "where commas are decimal, save the table with semicolons or tabs, or its cells in quotes; \
                 give --decimal point where they are not"
                    .into()
            }
            TableError::NoRate { time: Some(time) } => {
                format!("give --rate HZ, or --time \"{time}\" if that column holds times")
            }
            TableError::NoRate { time: None } => "give --rate HZ".into(),
            TableError::Bursts { column, .. } => format!(
                "these are the times of arrival: give --rate HZ, as the device has it, or --time \"{column}\" \
                 if nothing was measured between the bursts"
            ),
            TableError::Coarse { whole_hz, .. } => {
                format!("give --rate HZ, as the device has it: {whole_hz:.1} rows come a second")
            }
            TableError::Jump { .. } => {
                "mend that time, or cut the table there; a column in another unit is named as in \
                 --time timer:ms"
                    .into()
            }
            TableError::Begin { .. } => "begin the table with its samples".into(),
        }
    }
}
