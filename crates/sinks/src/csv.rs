//! Tables: one CSV file for each stream.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::Data;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Record;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};
use teampulse_core::stream::{Shape, Stream, StreamId};
use teampulse_core::time::Time;
use teampulse_messages::definition::Definition;
use teampulse_messages::value::flatten;

use crate::SinkContext;

/// How long to wait for something new before looking again.
const PATIENCE: Duration = Duration::from_secs(1);
/// Longer arrays than this are summarised instead of spread over columns.
const LONGEST_ARRAY: usize = 64;

/// One CSV file for each stream, beside the bag: a row for each sample, with its times in seconds
/// since 1970 (UTC) and its numbers in the units of the header.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Csv {}

impl Component<dyn Sink, SinkContext> for Csv {
    const EXAMPLE: &'static str = "";

    fn build(self, context: &SinkContext) -> Result<Box<dyn Sink>, SettingsError> {
        let mut folder = context.bag.clone().into_os_string();
        folder.push("_csv");
        Ok(Box::new(Tables::new(folder.into())))
    }
}

impl Csv {
    /// A sink that writes its tables into this folder, which is made.
    pub fn into_folder(folder: PathBuf) -> Box<dyn Sink> {
        Box::new(Tables::new(folder))
    }
}

/// The tables of a session.
struct Tables {
    folder: PathBuf,
    tables: BTreeMap<StreamId, Table>,
}

/// The table of one stream.
struct Table {
    file: BufWriter<File>,
    columns: Vec<String>,
    definition: Option<Definition>,
    began: bool,
}

impl Tables {
    fn new(folder: PathBuf) -> Tables {
        Tables { folder, tables: BTreeMap::new() }
    }

    fn write(&mut self, record: &Record) -> io::Result<()> {
        if matches!(record.sample.data, Data::Description(_)) {
            return Ok(());
        }
        let id = record.sample.stream;
        if !self.tables.contains_key(&id) {
            let table = Table::create(&self.folder, &record.stream)?;
            self.tables.insert(id, table);
        }
        self.tables.get_mut(&id).map_or(Ok(()), |table| table.write(record))
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
            hint: "look at the disk's free space and at the folder's permissions".into(),
        };
        fs::create_dir_all(&self.folder).map_err(|error| lost(&self.folder, &error))?;
        loop {
            match inbox.receive(PATIENCE) {
                Received::Batch(batch) => {
                    let written = batch.iter().try_for_each(|record| self.write(record));
                    written.map_err(|error| lost(&self.folder, &error))?;
                }
                Received::Silence => {}
                Received::Closed => {
                    let mut tables = self.tables.values_mut();
                    let flushed = tables.try_for_each(|table| table.file.flush());
                    return flushed.map_err(|error| lost(&self.folder, &error));
                }
            }
        }
    }
}

impl Table {
    fn create(folder: &std::path::Path, stream: &Arc<Stream>) -> io::Result<Table> {
        let name = stream.name.trim_matches('/').replace('/', "__");
        let definition = match &stream.shape {
            Shape::Message(schema) => Definition::parse(&schema.name, &schema.text).ok(),
            _ => None,
        };
        Ok(Table {
            file: BufWriter::new(File::create(folder.join(format!("{name}.csv")))?),
            columns: columns(stream),
            definition,
            began: false,
        })
    }

    fn write(&mut self, record: &Record) -> io::Result<()> {
        let values = self.values(record);
        if !self.began {
            self.began = true;
            let columns = self.columns.iter().map(|column| quoted(column));
            let header: Vec<String> = columns.collect();
            writeln!(self.file, "measured_secs,log_time_secs,index,{}", header.join(","))?;
        }
        let sample = &record.sample;
        let (measured, logged) = (exact_secs(sample.measured), exact_secs(sample.log_time));
        writeln!(self.file, "{measured},{logged},{},{}", sample.index, values.join(","))
    }

    /// The values of a record; those of a message tell their columns with the first one.
    fn values(&mut self, record: &Record) -> Vec<String> {
        match &record.sample.data {
            Data::Sample(values) => values.iter().map(f64::to_string).collect(),
            Data::Wave(wave) => {
                let samples = wave.samples.iter().map(f64::to_string);
                vec![wave.period_ns.to_string(), quoted(&samples.collect::<Vec<_>>().join(" "))]
            }
            Data::Feature(feature) => {
                let mut cells = vec![feature.window_secs.to_string()];
                cells.extend([feature.coverage, feature.quality].map(|each| each.to_string()));
                for (k, value) in feature.values.iter().enumerate() {
                    cells.push(number(*value));
                    cells.push(number(feature.sigmas.get(k).copied().unwrap_or(f64::NAN)));
                    cells.push(feature.reasons.get(k).map_or(String::new(), ToString::to_string));
                }
                cells
            }
            Data::Event(event) => vec![
                event.kind.to_string(),
                quoted(&event.label),
                number(event.value),
                number(event.duration_secs),
            ],
            Data::Status(status) => vec![
                quoted(&status.name),
                status.state.to_string(),
                quoted(&status.reason),
                number(status.rate_hz),
                number(status.age_secs),
                status.received.to_string(),
                status.lost_source.map_or(String::new(), |lost| lost.to_string()),
                status.lost_queue.to_string(),
                status.late.to_string(),
                status.duplicates.to_string(),
                status.clock.to_string(),
                status.epoch.to_string(),
                number(status.offset_secs),
                number(status.skew_ppm),
                number(status.jitter_secs),
                number(status.sigma_secs),
                number(status.latency_secs),
            ],
            Data::Description(_) => Vec::new(),
            Data::Message(bytes) => self.fields(bytes),
        }
    }

    fn fields(&mut self, cdr: &[u8]) -> Vec<String> {
        let Some(definition) = &self.definition else {
            if !self.began {
                self.columns = vec!["cdr_bytes".into()];
            }
            return vec![cdr.len().to_string()];
        };
        let fields = flatten(definition, cdr, LONGEST_ARRAY).unwrap_or_default();
        if !self.began {
            self.columns = fields.iter().map(|(path, _)| path.clone()).collect();
        }
        let value = |column: &String| {
            let field = fields.iter().find(|(path, _)| path == column);
            field.map_or(String::new(), |(_, value)| quoted(&value.to_string()))
        };
        self.columns.iter().map(value).collect()
    }
}

/// The columns of a stream of ours, each with its unit in brackets.
fn columns(stream: &Stream) -> Vec<String> {
    let own = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    let united = stream.channels.iter().zip(&stream.units);
    match &stream.shape {
        Shape::Sample => united.map(|(name, unit)| format!("{name} [{unit}]")).collect(),
        Shape::Wave => own(&["period_ns", "samples"]),
        Shape::Feature => {
            let mut columns: Vec<String> = own(&["window_secs", "coverage", "quality"]);
            for (name, unit) in united {
                columns.push(format!("{name} [{unit}]"));
                columns.push(format!("{name}_sigma [{unit}]"));
                columns.push(format!("{name}_reason"));
            }
            columns
        }
        Shape::Event => own(&["kind", "label", "value", "duration_secs"]),
        Shape::Status => own(&[
            "name",
            "state",
            "reason",
            "rate_hz",
            "age_secs",
            "received",
            "lost_source",
            "lost_queue",
            "late",
            "duplicates",
            "clock",
            "epoch",
            "offset_secs",
            "skew_ppm",
            "jitter_secs",
            "sigma_secs",
            "latency_secs",
        ]),
        Shape::Description | Shape::Message(_) => Vec::new(),
    }
}

/// A time as seconds with all of its nanoseconds.
pub(crate) fn exact_secs(time: Time) -> String {
    let nanos = time.nanos();
    let sign = if nanos < 0 { "-" } else { "" };
    format!(
        "{sign}{}.{:09}",
        nanos.unsigned_abs() / 1_000_000_000,
        nanos.unsigned_abs() % 1_000_000_000
    )
}

/// A number; an empty cell where there is none.
pub(crate) fn number(value: f64) -> String {
    if value.is_nan() { String::new() } else { value.to_string() }
}

/// A text as a CSV cell (RFC 4180).
pub(crate) fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
