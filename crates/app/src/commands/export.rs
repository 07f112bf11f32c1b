//! `teampulse export`: exports a bag as tables.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use clap::{Args, ValueEnum};
use teampulse_bag::{Bag, Selection};
use teampulse_core::pattern::Pattern;
use teampulse_core::session::Session;
use teampulse_core::sink::Sink;
use teampulse_core::stream::{Channel, Origin, Shape, Stream};
use teampulse_messages::convert::encode;
use teampulse_messages::definition::{Definition, Kind};
use teampulse_messages::{fields, readout};
use teampulse_sinks::{Aligned, Csv};
use teampulse_timefilter::align::{Policy, RowTimes};

use crate::commands::info::{after_reading, open, warn_of_damage};
use crate::commands::replay::{clocks_of, source_of, study_of};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;
use crate::recorded::read_through;

/// Exports a bag as tables: one file per stream, or one table of many streams at common times.
///
/// In the table at common times, each stream has its numbers and three more columns: the age of the newest sample used
/// (negative if it was measured after the row's time, as in interpolation), its validity, and half the width of the
/// interval that contains the true time with a probability of 95 %.
///
/// The default policy is linear:1s. Only floating-point numbers, and other numbers with a unit, are interpolated:
/// flags, states and counts are held. The table has no text columns, and of each list in a message only the first
/// value; the tables of single streams, written without --grid and --pivot, have all of them.
///
/// The validity is `fresh` (as the policy requires), `held` (the last value, not too old), `stale` (the last value, too
/// old or of a silent stream), `gap` (samples too far apart), `missing` (no sample yet, or none near), or `late` (it
/// arrived more than a minute after its row). A row waits for a silent stream for as long as the stream's policy
/// reaches back, but at least a minute.
#[derive(Debug, Args)]
pub struct Export {
    /// The bag's folder, or one of its .mcap files
    bag: PathBuf,
    /// The kind of table
    #[arg(long, value_enum, default_value = "csv")]
    format: Format,
    /// Where to write the tables; by default next to the bag
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Writes one table of several streams, with this many rows per second
    #[arg(long, value_name = "HZ", value_parser = rate, group = "times")]
    grid: Option<f64>,
    /// Writes one table of several streams, with a row for each sample or event of this stream
    #[arg(long, value_name = "STREAM", group = "times")]
    pivot: Option<String>,
    /// How to compute the value at a row's time: exact, nearest:TIME, hold:TIME, linear:TIME (TIME is the largest gap
    /// between two samples), or mean:TIME, min:TIME, max:TIME, last:TIME or count:TIME over the time before the row.
    /// TIME is written as 20ms or 1s. Applies to all streams, or to some as in `/robot*/odom=hold:2s`; by default
    /// linear:1s
    #[arg(long, value_name = "[STREAM=]POLICY", value_parser = rule, requires = "times")]
    policy: Vec<Rule>,
    /// The streams in that table, as in `/robot*/odom`, or `/**` for all streams with numbers; by default all raw
    /// streams
    #[arg(long, value_name = "STREAM", value_parser = Pattern::parse, requires = "times")]
    stream: Vec<Pattern>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    /// Comma-separated values
    Csv,
}

/// A policy, for all streams or for those that match a pattern.
#[derive(Clone, Debug)]
struct Rule {
    streams: Option<Pattern>,
    policy: Policy,
}

/// The default policy.
const POLICY: Policy = Policy::Linear { max_gap_nanos: 1_000_000_000 };

/// The most numbers that are read from a message if its stream declares no channels.
const MOST_CHANNELS: usize = 64;

/// The most names in the list of what the table leaves out.
const MOST_SHOWN: usize = 5;

/// The file name of the table at common times.
const TABLE: &str = "aligned.csv";

impl Export {
    /// Runs the command.
    pub async fn run(self) -> Result<Exit, Failure> {
        let bag = Arc::new(open(&self.bag)?);
        warn_of_damage(&bag);
        let folder = self.out.clone().unwrap_or_else(|| self.bag.with_extension("csv"));
        let undecoded = Arc::new(AtomicU64::new(0));
        let (sink, written) = match self.onto() {
            Some(onto) => (self.aligned(onto, &bag, &folder, &undecoded)?, folder.join(TABLE)),
            None => match self.format {
                Format::Csv if has_health(&bag) => {
                    (Csv::into_folder(folder.clone(), &undecoded), folder)
                }
                Format::Csv => (Csv::without_health(folder.clone(), &undecoded), folder),
            },
        };
        let source = source_of(&bag, Selection::RawAndDerived);
        let unread = source.unread();
        let session = Session {
            sinks: vec![sink],
            ..Session::of_recording(
                source,
                clocks_of(&bag, study_of(&bag).ok().flatten().as_ref()),
                encode,
            )
        };
        let exit = read_through(session, &written).await;
        let mut exit = after_reading(&bag, &unread, exit);
        if exit == Exit::Fine && undecoded.load(Ordering::Acquire) > 0 {
            exit = Exit::DataLost;
        }
        if exit != Exit::Failed {
            if let Some(hz) = self.grid.filter(|_| !has_rows(&written)) {
                let (first, last) = bag.bounds().unwrap_or_default();
                output::note(no_row(hz, last.secs_since(first)));
            }
            output::line(written.display().to_string());
        }
        Ok(exit)
    }

    /// Returns the row times of the table at common times, if it was requested.
    fn onto(&self) -> Option<RowTimes> {
        let period_nanos = |hz: f64| (1e9 / hz).round() as i64;
        let grid = self.grid.map(|hz| RowTimes::Grid { period_nanos: period_nanos(hz) });
        grid.or(self.pivot.as_ref().map(|_| RowTimes::Pivot))
    }

    fn aligned(
        &self,
        onto: RowTimes,
        bag: &Bag,
        folder: &Path,
        undecoded: &Arc<AtomicU64>,
    ) -> Result<Box<dyn Sink>, Failure> {
        let wanted =
            bag.streams().iter().filter(|each| each.messages > 0 && self.wants(&each.stream));
        let mut streams: Vec<Stream> =
            wanted.clone().filter_map(|each| self.with_numbers(&each.stream)).collect();
        streams.sort_by(|a, b| a.name.cmp(&b.name));
        if let Some(pivot) = &self.pivot {
            let place = streams.iter().position(|stream| stream.name == *pivot);
            let place = place.ok_or_else(|| {
                Failure::new(format!("the bag has no stream {pivot} with numbers or events"))
                    .hint("`teampulse info` lists its streams")
            })?;
            streams[..=place].rotate_right(1);
        }
        if streams.is_empty() {
            return Err(Failure::new("the bag has no matching streams with numbers")
                .hint("`teampulse info` lists its streams"));
        }
        self.each_rule_names_some(&streams)?;
        if let Some(note) = note_of(wanted.map(|each| &*each.stream)) {
            output::note(note);
        }
        let streams = streams.into_iter().map(|stream| {
            let policy = self.policy_of(&stream);
            (stream, policy)
        });
        let aligned = Aligned::new(&folder.join(TABLE), onto, streams, undecoded);
        Ok(Box::new(
            aligned
                .map_err(|error| Failure::new(format!("the table can't be created: {error}")))?,
        ))
    }

    /// Fails if a policy matches no stream, which is a mistake.
    fn each_rule_names_some(&self, streams: &[Stream]) -> Result<(), Failure> {
        let named = self.policy.iter().filter_map(|rule| rule.streams.as_ref());
        let idle = |pattern: &&Pattern| !streams.iter().any(|each| pattern.matches(&each.name));
        match named.clone().find(idle) {
            None => Ok(()),
            Some(pattern) => {
                let message =
                    format!("a policy names {}: no matching stream has numbers", pattern.text());
                Err(Failure::new(message).hint("`teampulse info` lists the streams of a bag"))
            }
        }
    }

    fn wants(&self, stream: &Stream) -> bool {
        let is_pivot = self.pivot.as_ref() == Some(&stream.name);
        let named = self.stream.iter().any(|pattern| pattern.matches(&stream.name));
        is_pivot || named || (self.stream.is_empty() && stream.origin == Origin::Raw)
    }

    /// Returns a stream with its numbers as channels; `None` if it has no numbers. The stream of events given as
    /// --pivot is kept: its events become rows of the table, never cells.
    fn with_numbers(&self, stream: &Stream) -> Option<Stream> {
        let is_pivot = self.pivot.as_ref() == Some(&stream.name);
        if is_pivot && stream.shape == Shape::Event {
            return Some(stream.clone());
        }
        with_numbers(stream)
    }

    /// Returns the last policy that matches the stream, else the last one for all streams.
    fn policy_of(&self, stream: &Stream) -> Policy {
        let mut rules = self.policy.iter().rev();
        let named = |rule: &&Rule| {
            rule.streams.as_ref().is_some_and(|pattern| pattern.matches(&stream.name))
        };
        let rule = rules.clone().find(named).or_else(|| rules.find(|rule| rule.streams.is_none()));
        rule.map_or(POLICY, |rule| rule.policy)
    }
}

/// Whether the health of streams was recorded: bags of other recorders have no such record.
fn has_health(bag: &Bag) -> bool {
    bag.streams().iter().any(|known| known.stream.shape == Shape::Status)
}

/// Returns a stream with its numbers as channels: all numbers of its messages if it declares no channels; `None` if it
/// has no numbers.
fn with_numbers(stream: &Stream) -> Option<Stream> {
    let mut stream = stream.clone();
    if let Some(definition) = unnamed(&stream) {
        let paths = values_of(&definition).filter(|path| !is_text(&definition, path));
        let paths = paths.take(MOST_CHANNELS);
        stream.channels = paths.map(|path| Channel::new(path, "")).collect();
    }
    let shaped =
        matches!(stream.shape, Shape::Sample | Shape::Wave | Shape::Feature | Shape::Message(_));
    (shaped && !stream.channels.is_empty()).then_some(stream)
}

/// Returns the definition of a stream's messages if the stream declares no channels.
fn unnamed(stream: &Stream) -> Option<Definition> {
    match &stream.shape {
        Shape::Message(schema) if stream.channels.is_empty() => readout::definition(schema),
        _ => None,
    }
}

/// Lists the paths of the values in messages of a type; of each list only the first value.
fn values_of(definition: &Definition) -> impl Iterator<Item = String> {
    fields::numbers(definition).into_iter().filter(|path| !path.starts_with("header."))
}

fn is_text(definition: &Definition, path: &str) -> bool {
    matches!(fields::kind(definition, path), Some(Kind::Text(_) | Kind::WideText(_)))
}

/// Returns the note on what one table leaves out of these streams; `None` if it has all of their values.
fn note_of<'a>(streams: impl Iterator<Item = &'a Stream>) -> Option<String> {
    let of_stream = |stream: &Stream| {
        let fields = left_out(&unnamed(stream)?);
        (!fields.is_empty()).then(|| format!("{}: {}", stream.name, some_of(&fields, ", ")))
    };
    let mut lacking: Vec<String> = streams.filter_map(of_stream).collect();
    lacking.sort();
    (!lacking.is_empty()).then(|| {
        format!(
            "note: the table has no text columns, and only the first value of each list ({}); without --grid and --pivot, \
             `teampulse export` writes a table per stream, with all of them",
            some_of(&lacking, "; ")
        )
    })
}

/// Lists the values of messages of a type that one table leaves out: texts, everything after the first value of a list,
/// and numbers beyond [`MOST_CHANNELS`].
fn left_out(definition: &Definition) -> Vec<String> {
    let (texts, numbers): (Vec<String>, Vec<String>) =
        values_of(definition).partition(|path| is_text(definition, path));
    let numbers = numbers.into_iter().enumerate();
    let numbers = numbers.filter(|(place, path)| *place >= MOST_CHANNELS || path.contains("[0]"));
    let paths = numbers.map(|(_, path)| path).chain(texts);
    paths.map(|path| path.replace("[0]", "[]")).collect()
}

/// Joins the first few of many names, and counts the others.
fn some_of(names: &[String], between: &str) -> String {
    let shown = names.iter().take(MOST_SHOWN).cloned().collect::<Vec<_>>().join(between);
    match names.len().saturating_sub(MOST_SHOWN) {
        0 => shown,
        more => format!("{shown}{between}and {more} more"),
    }
}

/// Whether a table has a row below its header.
fn has_rows(table: &Path) -> bool {
    let lines = |file| BufReader::new(file).lines().take(2).flatten().count();
    File::open(table).is_ok_and(|file| lines(file) == 2)
}

/// Returns the note on a grid that is too coarse for the recording.
fn no_row(hz: f64, secs: f64) -> String {
    format!(
        "note: the table has no rows: rows would be {:.1} s apart, and the recording lasts {secs:.1} s; give a higher --grid",
        1.0 / hz
    )
}

/// Parses a rate of 1e-4 to 1e5 Hz.
fn rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(hz) if (1e-4..=1e5).contains(&hz) => Ok(hz),
        _ => Err(format!("`{text}` is not a rate: expected 0.0001 to 100000 rows per second")),
    }
}

fn rule(text: &str) -> Result<Rule, String> {
    let (streams, policy) = match text.split_once('=') {
        Some((streams, policy)) => (Some(Pattern::parse(streams)?), policy),
        None => (None, text),
    };
    let policy = policy.parse::<Policy>().map_err(|error| error.to_string())?;
    Ok(Rule { streams, policy })
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Schema, Subject};

    use super::*;

    #[test]
    fn a_table_with_a_header_alone_has_no_rows() {
        let folder = tempfile::tempdir().unwrap();
        let table = folder.path().join(TABLE);
        for (text, is_filled) in [("", false), ("secs,ecg\n", false), ("secs,ecg\n1,2\n", true)] {
            std::fs::write(&table, text).unwrap();
            assert_eq!(has_rows(&table), is_filled, "{text}");
        }
        let note = no_row(0.01, 52.04);
        assert!(
            note.contains("rows would be 100.0 s apart, and the recording lasts 52.0 s"),
            "{note}"
        );
    }
    fn stream(name: &str, text: &str) -> Stream {
        let schema = Schema {
            name: "own_msgs/msg/Own".into(),
            encoding: "ros2msg".into(),
            text: text.into(),
            hash: String::new(),
        };
        Stream::raw(name, Subject::session(), Shape::Message(Arc::new(schema)))
    }

    #[test]
    fn what_one_table_leaves_out_of_messages_is_named() {
        let joints = stream("/js", "string[] name\nfloat64[] position\nbool is_held");
        let names: Vec<String> =
            with_numbers(&joints).unwrap().channels.into_iter().map(|each| each.name).collect();
        assert_eq!(names, ["position[0]", "is_held"]);
        let plain = stream("/x", "float64 x");
        let note = note_of([&plain, &joints].into_iter()).unwrap();
        assert!(note.contains("(/js: position[], name[]); without --grid"), "{note}");
        assert_eq!(note_of([&plain].into_iter()), None);
        let many: Vec<String> = (0..7).map(|place| format!("/{place}")).collect();
        assert_eq!(some_of(&many, ", "), "/0, /1, /2, /3, /4, and 2 more");
    }

    #[test]
    fn a_stream_of_texts_is_no_pivot() {
        assert!(with_numbers(&stream("/words", "string data")).is_none());
    }
}
