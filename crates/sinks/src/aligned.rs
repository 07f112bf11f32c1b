//! One table of many streams at common times.

mod event_cells;

use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use teampulse_bag::private;
use teampulse_core::counted::counted;
use teampulse_core::data::Data;
use teampulse_core::pump::TICK;
use teampulse_core::sample::{Record, Sample, Turn};
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};
use teampulse_core::stream::{Channel, Shape, Stream, StreamId};
use teampulse_core::time::Time;
use teampulse_messages::definition::{Kind, Number};
use teampulse_messages::fields;
use teampulse_messages::readout::{Readout, definition};
use teampulse_timefilter::Ticks;
use teampulse_timefilter::align::{
    AlignError, Aligner, Cell, Mode, Output, Policy, Row, RowTimes, Run, SourceId, SourceSettings,
};

use self::event_cells::EventCells;
use crate::csv::{exact_secs, number, quoted};

/// The longest wait for a batch of input.
const PATIENCE: Duration = Duration::from_secs(1);
/// How late a sample may arrive within its stream and still be placed [ns]: a recording is read far faster than it was
/// made, so rows can wait for samples that a strap sends in batches or after an outage.
const LATENESS_NANOS: i64 = 10_000_000_000;
/// The shortest and the longest time that rows wait for a silent stream [ns].
const LEAST_IDLE_NANOS: i64 = 60_000_000_000;
const MOST_IDLE_NANOS: i64 = 600_000_000_000;
/// How long uncertainties are kept for rows still to come [s].
const LONGEST_WAIT_SECS: usize = 700;
/// The number of samples kept per stream while rows wait for another stream: two minutes at 1 kHz.
const CAPACITY: usize = 1 << 17;
/// The maximum number of values kept per stream, whatever its number of channels.
const KEPT_NUMBERS: usize = 1 << 22;

/// One CSV file with many streams at common times: for each stream its values, the age of the newest sample that they
/// are based on, their validity, and the 95 % uncertainty of its times.
pub struct Aligned {
    path: PathBuf,
    members: Vec<Member>,
    aligner: Aligner,
    undecoded: Arc<AtomicU64>,
}

/// A stream of the table.
struct Member {
    stream: Stream,
    source: SourceId,
    readout: Option<Readout>,
    /// The number of messages without values, as they could not be decoded.
    undecoded: u64,
}

impl Aligned {
    /// A sink that writes `path`, with these streams from left to right. If rows are placed at the samples of a pivot,
    /// the pivot is the first stream; it may be a stream of events. At the end, `undecoded` is the number of messages
    /// that could not be decoded.
    pub fn new(
        path: &Path,
        onto: RowTimes,
        streams: impl IntoIterator<Item = (Stream, Policy)>,
        undecoded: &Arc<AtomicU64>,
    ) -> Result<Aligned, AlignError> {
        let mut aligner = Aligner::new(onto, Mode::Reproducible)?;
        let mut members = Vec::new();
        for (stream, policy) in streams {
            let channels = match stream.shape {
                Shape::Event => EventCells::CHANNELS,
                _ => stream.channels.len(),
            };
            let settings = SourceSettings {
                channels,
                lateness_nanos: LATENESS_NANOS,
                idle_nanos: idle_nanos(policy),
                capacity: CAPACITY.min(KEPT_NUMBERS / channels.max(1)),
                ..SourceSettings::new(policy)
            };
            let source = aligner.add(settings)?;
            if stream.shape != Shape::Event {
                aligner.hold(source, &held(&stream))?;
            }
            let readout = Readout::of(&stream);
            members.push(Member { stream, source, readout, undecoded: 0 });
        }
        Ok(Aligned { path: path.to_owned(), members, aligner, undecoded: Arc::clone(undecoded) })
    }
}

impl Sink for Aligned {
    fn name(&self) -> &'static str {
        "aligned"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let path = self.path.clone();
        let lost = |error: &io::Error| SinkError::Lost {
            message: format!("write {}: {error}", path.display()),
            hint: "check the free disk space and the folder's permissions".into(),
        };
        let mut table = AlignedTable::open(*self).map_err(|error| lost(&error))?;
        loop {
            match inbox.receive(PATIENCE) {
                Received::Batch(batch) => {
                    let written = batch.iter().try_for_each(|record| table.take(record));
                    written.map_err(|error| lost(&error))?;
                }
                Received::Silence => {}
                Received::Closed => return table.finish().map_err(|error| lost(&error)),
            }
        }
    }
}

/// The running sink.
struct AlignedTable {
    members: Vec<Member>,
    /// The index of each of the session's streams in `members`; `None` if it is not in the table.
    places: BTreeMap<StreamId, Option<usize>>,
    aligner: Aligner,
    ticks: Ticks,
    table: Table,
    undecoded: Arc<AtomicU64>,
}

/// The file, and the first error in writing it.
struct Table {
    file: BufWriter<File>,
    failed: Option<io::Error>,
    /// The reported uncertainty of each stream's times.
    uncertainties: Vec<Uncertainties>,
    /// The events, if rows are placed at events.
    events: Option<EventCells>,
}

impl AlignedTable {
    fn open(sink: Aligned) -> io::Result<AlignedTable> {
        if let Some(folder) = sink.path.parent() {
            private::create_folders(folder)?;
        }
        let mut file = BufWriter::new(private::create(&sink.path)?);
        let columns = sink.members.iter().flat_map(|member| columns(&member.stream));
        writeln!(file, "unix_secs,{}", columns.collect::<Vec<_>>().join(","))?;
        let uncertainties = sink.members.iter().map(|_| Uncertainties::default()).collect();
        let is_of_events =
            sink.members.first().is_some_and(|first| first.stream.shape == Shape::Event);
        Ok(AlignedTable {
            members: sink.members,
            places: BTreeMap::new(),
            aligner: sink.aligner,
            ticks: Ticks::every(TICK.as_nanos() as i64),
            table: Table {
                file,
                failed: None,
                uncertainties,
                events: is_of_events.then(EventCells::default),
            },
            undecoded: sink.undecoded,
        })
    }

    fn take(&mut self, record: &Record) -> io::Result<()> {
        let now = record.sample.log_time.nanos();
        for tick in self.ticks.until(now) {
            let table = &mut self.table;
            self.aligner.tick(tick, |output| table.take(output));
        }
        if let Data::Status(status) = &record.sample.data {
            let named = self.members.iter().position(|each| each.stream.name == status.name);
            if let Some(place) = named {
                self.table.uncertainties[place].take(now, status.uncertainty_secs());
            }
        } else if let Some(place) = self.place(record)
            && record.sample.turn != Turn::Duplicate
        {
            self.push(place, &record.sample, &record.stream);
        }
        self.table.failed.take().map_or(Ok(()), Err)
    }

    fn place(&mut self, record: &Record) -> Option<usize> {
        *self.places.entry(record.sample.stream).or_insert_with(|| {
            let (name, origin) = (&record.stream.name, record.stream.origin);
            let is_it = |each: &Member| each.stream.name == *name && each.stream.origin == origin;
            self.members.iter().position(is_it)
        })
    }

    fn push(&mut self, place: usize, sample: &Sample, stream: &Stream) {
        let (measured, arrival) = (sample.measured.nanos(), sample.log_time.nanos());
        if let (Data::Event(event), Some(events)) = (&sample.data, &mut self.table.events) {
            let values = events.push(event);
            let run = Run { measured, period_nanos: 0.0, arrival, values: &values };
            let (source, table) = (self.members[place].source, &mut self.table);
            let taken = self.aligner.push_run(source, run, |output| table.take(output));
            warn_of(taken, stream);
            return;
        }
        let member = &mut self.members[place];
        if member.readout.is_none() {
            let described = Stream { channels: member.stream.channels.clone(), ..stream.clone() };
            member.readout = Readout::of(&described);
        }
        let values = member.readout.as_mut().and_then(|readout| readout.read(&sample.data));
        let Some(values) = values else {
            member.undecoded += 1;
            return;
        };
        let run = Run { measured, period_nanos: sample.period_ns, arrival, values };
        let table = &mut self.table;
        let taken = self.aligner.push_run(member.source, run, |output| table.take(output));
        warn_of(taken, stream);
    }

    fn finish(mut self) -> io::Result<()> {
        for member in &self.members {
            if member.undecoded > 0 {
                let failed = counted(member.undecoded, "message has", "messages have");
                tracing::warn!(
                    "{}: {failed} no values in the table: they can't be decoded",
                    member.stream.name
                );
                self.undecoded.fetch_add(member.undecoded, Ordering::AcqRel);
            }
            let counts = self.aligner.counts(member.source).unwrap_or_default();
            if counts.late + counts.ahead + counts.crowded > 0 {
                tracing::warn!(
                    "{}: of {}, {} arrived too late for their row, {} have stamps after \
                     their arrival, {} did not fit while rows waited",
                    member.stream.name,
                    counted(counts.received, "sample", "samples"),
                    counts.late,
                    counts.ahead,
                    counts.crowded
                );
            }
        }
        if self.aligner.skipped() > 0 {
            tracing::warn!(
                "{}",
                counted(
                    self.aligner.skipped(),
                    "row without data in any stream was skipped",
                    "rows without data in any stream were skipped"
                )
            );
        }
        let table = &mut self.table;
        self.aligner.finish(|output| table.take(output));
        self.table.failed.take().map_or(Ok(()), Err)?;
        self.table.file.flush()
    }
}

fn warn_of(taken: Result<(), AlignError>, stream: &Stream) {
    if let Err(error) = taken {
        tracing::warn!("failed to align {}: {error}", stream.name);
    }
}

impl Table {
    fn take(&mut self, output: Output<'_>) {
        if let (Output::Row(row), None) = (output, &self.failed)
            && let Err(error) = self.write(row)
        {
            self.failed = Some(error);
        }
    }

    fn write(&mut self, row: &Row<'_>) -> io::Result<()> {
        write!(self.file, "{}", exact_secs(Time::from_nanos(row.at)))?;
        for (place, (_, cell)) in row.cells().enumerate() {
            if let (0, Some(events)) = (place, &mut self.events) {
                write!(self.file, ",{}", events.cells(cell.values))?;
                continue;
            }
            let uncertainty = self.uncertainties.get_mut(place);
            let uncertainty_secs =
                uncertainty.map_or(f64::NAN, |uncertainty| uncertainty.at(row.at));
            self.write_cell(&cell, uncertainty_secs)?;
        }
        writeln!(self.file)
    }

    fn write_cell(&mut self, cell: &Cell<'_>, uncertainty_secs: f64) -> io::Result<()> {
        for value in cell.values {
            write!(self.file, ",{}", number(*value))?;
        }
        let age_secs =
            if cell.age_nanos == i64::MAX { f64::NAN } else { cell.age_nanos as f64 / 1e9 };
        let is_there = cell.values.iter().any(|value| !value.is_nan());
        let uncertainty_secs = if is_there { uncertainty_secs } else { f64::NAN };
        let (age, uncertainty) = (number(age_secs), number(uncertainty_secs));
        write!(self.file, ",{age},{},{uncertainty}", cell.validity.word())
    }
}

/// The uncertainties of a stream's times, as reported second by second.
#[derive(Default)]
struct Uncertainties(VecDeque<(i64, f64)>);

impl Uncertainties {
    fn take(&mut self, at: i64, uncertainty_secs: f64) {
        if self.0.len() == LONGEST_WAIT_SECS {
            self.0.pop_front();
        }
        self.0.push_back((at, uncertainty_secs));
    }

    /// Returns the latest value reported up to a time, or the first one if the time is before all reports [s].
    fn at(&mut self, at: i64) -> f64 {
        while self.0.get(1).is_some_and(|(at_time, _)| *at_time <= at) {
            self.0.pop_front();
        }
        self.0.front().map_or(f64::NAN, |(_, uncertainty_secs)| *uncertainty_secs)
    }
}

/// Which channels of a stream are held rather than interpolated: fields that have no unit and aren't floating-point
/// numbers, as they may be flags, states or counts.
fn held(stream: &Stream) -> Vec<bool> {
    let definition = match &stream.shape {
        Shape::Message(schema) => definition(schema),
        _ => None,
    };
    let is_held = |channel: &Channel| {
        let kind = definition.as_ref().and_then(|known| fields::kind(known, &channel.name));
        let is_real = matches!(kind, Some(Kind::Number(Number::Float32 | Number::Float64)) | None);
        channel.unit.is_empty() && !is_real
    };
    stream.channels.iter().map(is_held).collect()
}

/// How long rows wait for a silent stream [ns], given how far its policy looks ahead.
fn idle_nanos(policy: Policy) -> i64 {
    let reach_nanos = match policy {
        Policy::Exact => 0,
        Policy::Nearest { tolerance_nanos: nanos }
        | Policy::Hold { max_age_nanos: nanos }
        | Policy::Linear { max_gap_nanos: nanos }
        | Policy::Window { length_nanos: nanos, .. } => nanos,
    };
    reach_nanos.clamp(LEAST_IDLE_NANOS, MOST_IDLE_NANOS)
}

/// The names of a stream's columns.
fn columns(stream: &Stream) -> Vec<String> {
    let name = &stream.name;
    if stream.shape == Shape::Event {
        return EventCells::COLUMNS.map(|word| quoted(&format!("{name}:{word}"))).to_vec();
    }
    let values = stream.channels.iter().map(|channel| match (&channel.name, &*channel.unit) {
        (channel, "") => format!("{name}:{channel}"),
        (channel, unit) => format!("{name}:{channel} [{unit}]"),
    });
    let about = ["age_secs", "validity", "uncertainty_secs"].map(|word| format!("{name}:{word}"));
    values.chain(about).map(|column| quoted(&column)).collect()
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use teampulse_core::stream::{Schema, Subject};
    use tempfile::tempdir;

    use super::*;

    /// A stream of messages with this definition.
    fn own(definition: &str) -> Stream {
        let schema = Schema {
            name: "own_msgs/msg/Own".into(),
            encoding: "ros2msg".into(),
            text: definition.into(),
            hash: String::new(),
        };
        Stream::raw("/r1/own", Subject::robot("r1"), Shape::Message(Arc::new(schema)))
    }

    #[test]
    fn only_measurements_are_interpolated() {
        let stream = own("bool on\nuint8[] states\nint32 raw\nfloat32 x\nfloat64[2] y");
        let channels = [("on", ""), ("states[0]", ""), ("raw", "uV"), ("x", ""), ("y[1]", "")];
        let stream = stream.with_channels(&channels);
        assert_eq!(held(&stream), [true, true, false, false, false]);
    }

    #[test]
    fn messages_that_cannot_be_decoded_are_counted() {
        let folder = tempdir().unwrap();
        let stream = own("float64 x").with_channels(&[("x", "m")]);
        let policy = Policy::Hold { max_age_nanos: 1_000_000_000 };
        let undecoded = Arc::default();
        let streams = [(stream.clone(), policy)];
        let path = folder.path().join("aligned.csv");
        let aligned = Aligned::new(&path, RowTimes::Pivot, streams, &undecoded).unwrap();
        let mut table = AlignedTable::open(aligned).unwrap();
        for message in [&[0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f][..], &[0, 1, 0, 0, 7]] {
            table.take(&record(&stream, message)).unwrap();
        }
        table.finish().unwrap();
        assert_eq!(undecoded.load(Ordering::Acquire), 1);
    }

    fn record(stream: &Stream, message: &[u8]) -> Record {
        let cdr = Bytes::copy_from_slice(message);
        let sample = Sample {
            stream: StreamId(0),
            measured: Time::from_nanos(1_500_000_000),
            log_time: Time::from_nanos(2_000_000_000),
            device_time: None,
            source_time: None,
            period_ns: 0.0,
            index: 0,
            turn: Turn::OnTime,
            data: Data::Message(cdr.clone()),
        };
        Record { stream: Arc::new(stream.clone()), sample, cdr }
    }
}
