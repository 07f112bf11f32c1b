//! One CSV file per stream.

mod table;
mod layout;
mod cells;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_bag::private;
use teampulse_core::data::Data;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Record;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};
use teampulse_core::stream::{Shape, Stream, StreamId};
use teampulse_core::text::file_name;

use self::table::Table;
use crate::SinkContext;

pub(crate) use self::cells::{cell, exact_secs, number, quoted};

/// The longest wait for a batch of input.
const PATIENCE: Duration = Duration::from_secs(1);
/// The maximum number of open files; others are reopened when needed.
const MOST_OPEN: usize = 64;

/// One CSV file per stream, in the folder `tables_<name>` beside the bag's folder: a row for each sample, with its
/// times in seconds since 1970 (UTC) and its values in the units of the header; waves have a row for each of their
/// samples. If a list in a message grows, rows gain cells, whose names are in the header once the session has ended.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Csv {}

impl Component<dyn Sink, SinkContext> for Csv {
    const EXAMPLE: &'static str = "";

    fn build(self, context: &SinkContext) -> Result<Box<dyn Sink>, SettingsError> {
        Ok(Box::new(Tables::new(tables_beside(&context.bag))))
    }
}

/// The folder of a session's tables, beside the folder of its bag. Its name starts with another word, so that
/// `sessions/my_team_*` matches only bags.
pub fn tables_beside(bag: &Path) -> PathBuf {
    let name = bag.file_name().unwrap_or_default().to_string_lossy();
    bag.with_file_name(format!("tables_{name}"))
}

impl Csv {
    /// A sink that writes its tables into this folder, which it creates. At the end, `undecoded` is the number of
    /// messages that could not be decoded.
    pub fn into_folder(folder: PathBuf, undecoded: &Arc<AtomicU64>) -> Box<dyn Sink> {
        Box::new(Tables { undecoded: Arc::clone(undecoded), ..Tables::new(folder) })
    }

    /// Like [`Csv::into_folder`], but without the health of streams, which would be newly computed: for recordings that
    /// have none.
    pub fn without_health(folder: PathBuf, undecoded: &Arc<AtomicU64>) -> Box<dyn Sink> {
        let undecoded = Arc::clone(undecoded);
        Box::new(Tables { has_health: false, undecoded, ..Tables::new(folder) })
    }
}

/// The tables of a session.
struct Tables {
    folder: PathBuf,
    by_stream: BTreeMap<StreamId, Table>,
    /// The names of the files in lower case, as some file systems ignore case.
    names: BTreeSet<String>,
    /// The streams with an open file, the last one written at the end.
    open: VecDeque<StreamId>,
    /// Whether there is a table of the health of streams.
    has_health: bool,
    /// The number of messages that could not be decoded, known at the end.
    undecoded: Arc<AtomicU64>,
}

impl Tables {
    fn new(folder: PathBuf) -> Tables {
        let (by_stream, names, open) = (BTreeMap::new(), BTreeSet::new(), VecDeque::new());
        Tables { folder, by_stream, names, open, has_health: true, undecoded: Arc::default() }
    }

    fn write(&mut self, record: &Record) -> io::Result<()> {
        match record.sample.data {
            Data::Description(_) => return Ok(()),
            Data::Status(_) if !self.has_health => return Ok(()),
            _ => {}
        }
        let id = record.sample.stream;
        if !self.by_stream.contains_key(&id) {
            let name = format!("{}.csv", self.name_of(&record.stream));
            let path = self.folder.join(name);
            self.by_stream.insert(id, Table::new(record.stream.name.clone(), path));
        }
        self.make_room(id)?;
        self.by_stream.get_mut(&id).map_or(Ok(()), |table| table.take(record))
    }

    /// Closes the least recently written file, if too many are open.
    fn make_room(&mut self, id: StreamId) -> io::Result<()> {
        if self.open.back() == Some(&id) {
            return Ok(());
        }
        self.open.retain(|open| *open != id);
        self.open.push_back(id);
        if self.open.len() <= MOST_OPEN {
            return Ok(());
        }
        let oldest = self.open.pop_front().and_then(|oldest| self.by_stream.get_mut(&oldest));
        oldest.map_or(Ok(()), Table::close)
    }

    /// The name of a stream's file; a second type on a topic gets its own file, named after the type.
    fn name_of(&mut self, stream: &Stream) -> String {
        let plain = stream.name.trim_matches('/').replace('/', "__");
        let plainly = file_name(&plain);
        let mut name = plainly.clone();
        if let (Shape::Message(schema), true) = (&stream.shape, self.names.contains(&lower(&name)))
        {
            name = file_name(&format!("{plain}__{}", schema.name.replace('/', "_")));
        }
        let first = name.clone();
        let mut number = 2;
        while !self.names.insert(lower(&name)) {
            name = format!("{first}_{number}");
            number += 1;
        }
        if name != plainly {
            tracing::warn!(
                "{}: its table is named {name}.csv, as another stream has {plainly}.csv",
                stream.name
            );
        }
        name
    }

    fn finish(&mut self) -> io::Result<()> {
        self.by_stream.values_mut().try_for_each(Table::conclude)?;
        let undecoded = self.by_stream.values().map(Table::undecoded).sum();
        self.undecoded.fetch_add(undecoded, Ordering::AcqRel);
        self.by_stream.values_mut().try_for_each(Table::finish)
    }
}

impl Sink for Tables {
    fn name(&self) -> &'static str {
        "csv"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn run(mut self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let lost = |folder: &PathBuf, error: &io::Error| SinkError::Lost {
            message: format!("write tables into {}: {error}", folder.display()),
            hint: "check the free disk space and the folder's permissions".into(),
        };
        private::create_folders(&self.folder).map_err(|error| lost(&self.folder, &error))?;
        loop {
            match inbox.receive(PATIENCE) {
                Received::Batch(batch) => {
                    let written = batch.iter().try_for_each(|record| self.write(record));
                    written.map_err(|error| lost(&self.folder, &error))?;
                }
                Received::Silence => {}
                Received::Closed => {
                    return self.finish().map_err(|error| lost(&self.folder, &error));
                }
            }
        }
    }
}

fn lower(name: &str) -> String {
    name.to_lowercase()
}

#[cfg(test)]
mod tests;
