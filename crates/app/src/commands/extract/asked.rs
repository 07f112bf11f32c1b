//! What can be asked of a table of samples, by every command that reads one.

use std::path::Path;

use clap::Args;

use super::analyses::Signal;
use super::options::{factor, failure, rate};
use super::rows::{Rows, Said};
use super::table::{Decimal, Table};
use crate::failure::Failure;

/// How a table of samples is read, where it does not tell by itself.
#[derive(Clone, Debug, Args)]
pub struct TableArgs {
    /// Samples a second [Hz]; without it what the table tells
    #[arg(long, value_name = "HZ", value_parser = rate, allow_negative_numbers = true)]
    rate: Option<f64>,
    /// The column, by its name or its number from 1; several for a signal with several channels
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    column: Vec<String>,
    /// The column with the times: dates, or numbers of the unit behind the colon, of that which the table
    /// tells, or else of that which their size and the rate that they make tell. `:excel` is days since 1900,
    /// `:mm:ss` minutes and seconds
    #[arg(long, value_name = "NAME[:UNIT]")]
    time: Option<String>,
    /// Multiplies every sample, to bring it into the signal's unit
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = factor, allow_negative_numbers = true)]
    scale: f64,
    /// What the samples are in after that; without it what the table tells, or the signal's own unit. What
    /// is analysed in one unit is converted to it: skin resistance in kohm to uS, intervals in s to ms
    #[arg(long, value_name = "UNIT")]
    unit: Option<String>,
    /// What stands before decimals; without it what the table looks like
    #[arg(long, value_name = "MARK")]
    decimal: Option<Decimal>,
}

impl TableArgs {
    /// Opens a table of a signal; `-` is standard input.
    pub fn open(&self, path: &Path, signal: Signal) -> Result<Table, Failure> {
        let wanted = signal.wanted(self.column.clone(), self.time.clone(), self.decimal);
        Table::open(path, &wanted, self.rate).map_err(failure)
    }

    /// The rows of a table that was opened, in the signal's unit.
    pub fn rows(&self, signal: Signal, table: Table) -> Result<Rows, Failure> {
        Rows::new(signal, table, &Said { scale: self.scale, unit: self.unit() })
    }

    /// The unit that was asked for.
    pub fn unit(&self) -> Option<&str> {
        self.unit.as_deref()
    }
}
