//! The table of one stream.

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;

use teampulse_bag::private;
use teampulse_core::sample::Record;
use teampulse_core::stream::{Shape, Stream};
use teampulse_messages::definition::Definition;
use teampulse_messages::readout;

use super::cells::{Columns, exact_secs};

/// The maximum number of records, and of bytes, that wait until the names of a stream's values are known.
const MOST_WAITING: usize = 2000;
const MOST_WAITING_BYTES: usize = 16 << 20;

/// The table of one stream, whose file may be open or closed.
pub(super) struct Table {
    /// The name of the stream.
    stream: String,
    path: PathBuf,
    file: Option<BufWriter<File>>,
    columns: Option<Columns>,
    /// Records that arrived before the columns were known.
    waiting: Vec<Record>,
    waiting_bytes: usize,
}

impl Table {
    /// A table for a file, which is created with the first row.
    pub(super) fn new(stream: String, path: PathBuf) -> Table {
        Table { stream, path, file: None, columns: None, waiting: Vec::new(), waiting_bytes: 0 }
    }

    /// Writes a record, or keeps it until its columns are known.
    pub(super) fn take(&mut self, record: &Record) -> io::Result<()> {
        if self.columns.is_some() {
            return self.write(record);
        }
        let definition = definition_of(&record.stream);
        let is_known = is_described(&record.stream, definition.as_ref());
        let is_full =
            self.waiting.len() >= MOST_WAITING || self.waiting_bytes >= MOST_WAITING_BYTES;
        if !is_known && !is_full {
            self.waiting_bytes += record.held_bytes();
            self.waiting.push(record.clone());
            return Ok(());
        }
        self.begin(record, definition)
    }

    /// Writes the header for the columns of this record, and then all waiting records.
    fn begin(&mut self, record: &Record, definition: Option<Definition>) -> io::Result<()> {
        let waiting = std::mem::take(&mut self.waiting);
        let first = waiting.first().unwrap_or(record);
        let columns = Columns::of(first, &record.stream, definition);
        let header = columns.layout().header();
        self.columns = Some(columns);
        self.file = Some(BufWriter::new(private::create(&self.path)?));
        let file = self.file()?;
        writeln!(file, "{header}")?;
        waiting.iter().chain([record]).try_for_each(|record| self.write(record))
    }

    fn write(&mut self, record: &Record) -> io::Result<()> {
        let Some(mut columns) = self.columns.take() else { return Ok(()) };
        let (index, logged) = (record.sample.index, exact_secs(record.sample.log_time));
        let file = self.file()?;
        let written = columns.rows(record, |at, cells| {
            writeln!(file, "{},{logged},{index},{}", exact_secs(at), cells.join(","))
        });
        self.columns = Some(columns);
        written
    }

    /// Returns the file, reopened if it was closed.
    fn file(&mut self) -> io::Result<&mut BufWriter<File>> {
        let file = match self.file.take() {
            Some(file) => file,
            None => BufWriter::new(OpenOptions::new().append(true).open(&self.path)?),
        };
        Ok(self.file.insert(file))
    }

    /// Closes the file, if it is open.
    pub(super) fn close(&mut self) -> io::Result<()> {
        self.file.take().map_or(Ok(()), |mut file| file.flush())
    }

    /// Finishes the table: waiting records are written as far as their columns are known, and every row gets the
    /// columns that were found after its header.
    pub(super) fn finish(&mut self) -> io::Result<()> {
        self.conclude()?;
        for lack in self.lacks() {
            tracing::warn!("{}: {lack}", self.stream);
        }
        let columns = self.columns.take();
        columns.map_or(Ok(()), |columns| columns.layout().complete(&self.path))
    }

    /// Writes the records that are still waiting, and closes the file.
    pub(super) fn conclude(&mut self) -> io::Result<()> {
        if let Some(last) = self.waiting.pop() {
            self.begin(&last, None)?;
        }
        self.close()
    }

    /// The number of messages that could not be decoded; before the table is finished, of those written so far.
    pub(super) fn undecoded(&self) -> u64 {
        self.columns.as_ref().map_or(0, Columns::undecoded)
    }

    /// The data of the stream that the table lacks, each as a sentence.
    pub(super) fn lacks(&self) -> Vec<String> {
        self.columns.as_ref().map(Columns::lacks).unwrap_or_default()
    }
}

fn definition_of(stream: &Stream) -> Option<Definition> {
    match &stream.shape {
        Shape::Message(schema) => readout::definition(schema),
        _ => None,
    }
}

/// Whether the names of a stream's values are known.
fn is_described(stream: &Stream, definition: Option<&Definition>) -> bool {
    match &stream.shape {
        Shape::Message(_) => definition.is_some(),
        Shape::Sample | Shape::Wave => !stream.channels.is_empty(),
        _ => true,
    }
}
