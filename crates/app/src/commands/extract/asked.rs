//! The options of every command that reads a table of samples.

use std::path::Path;

use clap::Args;
use teampulse_features::analyses::Analysis;

use super::analyses::wanted;
use super::options::{factor, failure, rate};
use super::rows::{Rows, Said};
use super::table::{Decimal, Table};
use crate::failure::Failure;

/// How to read a table of samples, where the table does not state it.
#[derive(Clone, Debug, Args)]
pub struct TableArgs {
    /// Samples per second [Hz]; by default what the table states
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate: Option<f64>,
    /// The column, by its name or its number from 1; several for a signal with several channels
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    column: Vec<String>,
    /// The column with the times: dates, or numbers. The unit of numbers is the one after the colon (`:h`, `:min`,
    /// `:s`, `:ms`, `:us` or `:ns`), else the one that the table states, else the one that fits their size and the
    /// rate. `:excel` means days since 1900, `:mm:ss` minutes and seconds
    #[arg(long, value_name = "NAME[:UNIT]")]
    time: Option<String>,
    /// Multiplies every sample, to convert it to the signal's unit
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = factor)]
    scale: f64,
    /// The unit of the samples after scaling; by default the one that the table states, or the signal's usual unit.
    /// Signals that are analysed in a fixed unit are converted to it: skin resistance in kohm to uS, intervals in s to
    /// ms
    #[arg(long, value_name = "UNIT")]
    unit: Option<String>,
    /// The decimal separator; by default detected
    #[arg(long, value_name = "MARK")]
    decimal: Option<Decimal>,
}

impl TableArgs {
    /// Opens a table of a signal; `-` is standard input.
    pub fn open(&self, path: &Path, signal: &'static Analysis) -> Result<Table, Failure> {
        let wanted = wanted(signal, self.column.clone(), self.time.clone(), self.decimal);
        Table::open(path, &wanted, self.rate).map_err(failure)
    }

    /// Returns the rows of an opened table, in the signal's unit.
    pub fn rows(&self, signal: &'static Analysis, table: Table) -> Result<Rows, Failure> {
        Rows::new(signal, table, &Said { scale: self.scale, unit: self.unit() })
    }

    /// Returns the requested unit.
    pub fn unit(&self) -> Option<&str> {
        self.unit.as_deref()
    }
}
