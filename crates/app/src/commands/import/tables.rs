//! Tables of samples as a source: several tables of one person, in the order of their times.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use clap::Args;
use teampulse_core::data::{Data, Wave};
use teampulse_core::outlet::Outlet;
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{About, Channel, Shape, Stream, StreamId, Subject};
use teampulse_core::text::on_one_line;
use teampulse_core::time::Time;
use teampulse_core::units::spelt;
use teampulse_features::analyses::{ANALYSES, Analysis};
use teampulse_formats as formats;
use teampulse_sources::ros_people::NAMESPACE;

use super::imported::{Imported, unlike};
use crate::commands::extract::{Oddity, Row, Rows, Table, TableArgs, signal, without_unit};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;

/// The longest run of samples [s]: the stamp of its first sample is within one second of its arrival, and so is
/// trusted.
const RUN_SECS: f64 = 0.9;
/// A sample that comes more than this many periods after the previous one starts another run.
const GAP_PERIODS: f64 = 1.5;
/// Earlier times are not dates [ns since 1970]: 2001-01-01.
pub const DATED_NS: i64 = 978_307_200_000_000_000;

/// The device of a table, unless the user names one.
const TABLE: &str = "table";
/// The person, unless the user names one.
const PERSON: &str = "p001";

/// The options for tables.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Options of tables")]
pub struct Asked {
    /// What a table measures, if its file name does not show it
    #[arg(long, value_parser = signal())]
    signal: Option<&'static Analysis>,
    #[command(flatten)]
    table: TableArgs,
    /// The pseudonym of the person who was measured; by default `p001`
    #[arg(long, value_name = "ID", value_parser = person)]
    person: Option<String>,
    /// The measuring device; by default the one that its file states, or `table`
    #[arg(long, value_name = "NAME", default_value = TABLE, value_parser = token)]
    device: String,
}

/// Parses the id of a person, as in a study: a letter, then letters, digits and `_`.
fn person(text: &str) -> Result<String, String> {
    token(&text.to_ascii_lowercase()).map(|_| text.to_owned()).map_err(|_error| {
        "expected at most 64 characters of a-z, A-Z, 0-9 and _, starting with a letter".into()
    })
}

/// Parses a token of a topic: a lower-case letter, then lower-case letters, digits and `_`.
fn token(text: &str) -> Result<String, String> {
    let is_token = text.starts_with(|first: char| first.is_ascii_lowercase())
        && text.chars().all(|each| matches!(each, 'a'..='z' | '0'..='9' | '_'))
        && text.len() <= 64;
    if is_token {
        Ok(text.to_owned())
    } else {
        Err("expected at most 64 characters of a-z, 0-9 and _, starting with a letter".into())
    }
}

/// Returns the signal in a table with this file name, by the names that devices give their files.
pub fn signal_of(path: &Path) -> Option<&'static Analysis> {
    let stem = path.file_stem()?.to_string_lossy().to_ascii_lowercase();
    let words: Vec<&str> = stem.split(|each: char| !each.is_ascii_alphanumeric()).collect();
    let is_of = |each: &&Analysis| each.table.files.iter().any(|name| words.contains(name));
    ANALYSES.iter().find(is_of)
}

/// Whether an E4 writes a file of this name in addition to its samples: a mean heart rate, or presses of its button.
pub fn is_extra_of_e4(path: &Path) -> bool {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().to_ascii_lowercase());
    stem.is_some_and(|stem| ["hr", "tags"].contains(&&*stem))
}

impl Asked {
    /// Whether the user named the signal of the tables.
    pub fn names_signal(&self) -> bool {
        self.signal.is_some()
    }

    /// The pseudonym of the person.
    pub fn person(&self) -> &str {
        self.person.as_deref().unwrap_or(PERSON)
    }

    /// Returns the note on the default person, if the user named nobody.
    pub fn unnamed(&self) -> Option<String> {
        let note =
            format!("note: the person is recorded as {PERSON}: give --person to name another");
        self.person.is_none().then_some(note)
    }

    /// The device that the user named, or else `own`.
    pub fn device_or<'a>(&'a self, own: &'a str) -> &'a str {
        if self.device == TABLE { own } else { &self.device }
    }
}

/// Tables that are read together.
pub struct Tables {
    each: Vec<Reader>,
}

/// A description of the tables, for the user.
pub struct Report(Vec<String>);

impl Report {
    /// One line per table.
    pub fn lines(self) -> impl Iterator<Item = String> {
        self.0.into_iter()
    }
}

impl Tables {
    /// Opens all tables and reads their first rows. Each is first read to its end, so that a table that can't be
    /// imported is rejected before a bag is created.
    pub fn open(files: &[PathBuf], asked: &Asked) -> Result<Tables, Failure> {
        let mut each = Vec::<Reader>::new();
        for file in files {
            let check = Reader::open(file, asked).and_then(Reader::check);
            check.map_err(|failure| match files {
                [_] => failure,
                _ => of_file(file, &failure),
            })?;
            let mut reader = Reader::open(file, asked)?;
            let same =
                each.iter().filter(|known| known.signal.signal == reader.signal.signal).count();
            if same > 0 {
                reader.stream.name.push_str(&(same + 1).to_string());
            }
            each.push(reader);
        }
        let is_dated: Vec<bool> = each.iter().map(Reader::is_dated).collect();
        if is_dated.contains(&true) && is_dated.contains(&false) {
            let message = "some of the tables contain a date, and some do not";
            let hint =
                "import only tables that started together, or name the column of times with --time";
            return Err(Failure::new(message).hint(hint).exit(Exit::BadArguments));
        }
        Ok(Tables { each })
    }

    /// Places the tables at a date if they contain none.
    #[must_use]
    pub fn with_date(mut self) -> Tables {
        if !self.is_dated() {
            output::note("note: the tables contain no date: the bag begins in 2001");
            for reader in &mut self.each {
                reader.shift_ns = DATED_NS;
            }
        }
        self
    }

    /// Whether the times in all tables contain a date.
    pub fn is_dated(&self) -> bool {
        self.each.iter().all(Reader::is_dated)
    }

    /// The names of the files, for messages.
    pub fn name(&self) -> String {
        let names: Vec<String> =
            self.each.iter().map(|reader| reader.path.display().to_string()).collect();
        names.join(", ")
    }

    /// The device, as it appears in the names of the streams.
    pub fn device(&self) -> String {
        let name = self.each.first().map_or("", |reader| &reader.stream.name);
        name.rsplit('/').nth(1).unwrap_or_default().to_owned()
    }

    /// Returns all samples, with the times in the tables.
    pub fn collected(self) -> Result<Vec<Imported>, Failure> {
        self.each.into_iter().map(Reader::collected).collect()
    }

    /// Describes what is imported.
    pub fn report(&self) -> Report {
        let line = |reader: &Reader| {
            let Stream { name, rate_hz, channels, .. } = &reader.stream;
            let rate = if *rate_hz > 0.0 { format!("{rate_hz} Hz") } else { "irregular".into() };
            let unit =
                channels.first().map(|channel| &*channel.unit).filter(|unit| !unit.is_empty());
            let unit = unit.unwrap_or("unit unknown");
            format!("{}: {name}, {rate}, {unit}", reader.path.display())
        };
        Report(self.each.iter().map(line).collect())
    }
}

/// A table with its next run of samples.
struct Reader {
    path: PathBuf,
    signal: &'static Analysis,
    stream: Stream,
    rows: Rows,
    /// The row after the next run.
    ahead: Option<(i64, Row)>,
    /// Added to all times [ns].
    shift_ns: i64,
}

/// A run of samples.
struct Run {
    first_ns: i64,
    last_ns: i64,
    samples: Vec<f64>,
}

impl Run {
    /// Whether the next run follows without a gap.
    fn goes_on_with(&self, next: &Run, rate_hz: f64) -> bool {
        let after_ns = next.first_ns.saturating_sub(self.last_ns);
        after_ns > 0 && (after_ns as f64) < GAP_PERIODS * 1e9 / rate_hz
    }

    /// Converts to a run of even samples, with the mean period between its first and its last sample.
    fn even(self, width: usize, rate_hz: f64) -> formats::Run {
        let periods = (self.samples.len() / width).saturating_sub(1);
        let span_ns = self.last_ns.saturating_sub(self.first_ns) as f64;
        let period_ns = if periods > 0 { span_ns / periods as f64 } else { 1e9 / rate_hz };
        formats::Run { start_ns: self.first_ns, period_ns, samples: self.samples }
    }
}

impl Reader {
    fn open(path: &Path, asked: &Asked) -> Result<Reader, Failure> {
        let signal = asked.signal.or_else(|| signal_of(path)).ok_or_else(|| {
            let hint = if is_extra_of_e4(path) {
                "import the zip of the E4's session, which has its heart rate and its tags"
            } else {
                "name it with --signal, such as --signal ecg"
            };
            Failure::new(format!("it is not known what {} measures", path.display()))
                .hint(hint)
                .exit(Exit::BadArguments)
        })?;
        let table = asked.table.open(path, signal)?;
        let stream = stream(signal, &table, asked);
        let mut rows = asked.table.rows(signal, table)?;
        let ahead = rows.next()?;
        Ok(Reader { path: path.to_owned(), signal, stream, rows, ahead, shift_ns: 0 })
    }

    /// Reads all rows, and prints notes on what was chosen or is odd.
    fn check(mut self) -> Result<(), Failure> {
        for note in self.rows.table().notes() {
            output::note(format!("note: {note}"));
        }
        if self.ahead.is_none() {
            return Err(Failure::to("find a line of numbers: the table has none")
                .hint("a table has one number per line, or several separated by commas"));
        }
        let mut early = Oddity::default();
        while let Some((_, row)) = self.rows.next()? {
            self.rows.in_order(row.line)?;
            early.add(usize::from(!self.rows.times().is_later()), row.line);
        }
        let early = (early.count > 0).then(|| {
            let (one, several) = (
                "row is not later than all rows before",
                "rows are not later than all rows before them",
            );
            format!("{}: their times are kept", early.words(one, several))
        });
        let path = self.path.display();
        let odd = self.rows.oddities().chain(early);
        odd.for_each(|note| output::note(format!("note: {path}: {note}")));
        Ok(())
    }

    /// Returns all samples of the table.
    fn collected(mut self) -> Result<Imported, Failure> {
        let too_many =
            Failure::to(format!("read {}: it has too many numbers", self.path.display()))
                .hint("export a shorter part of the recording");
        let (mut runs, mut at_ns, mut values) = (Vec::<Run>::new(), Vec::new(), Vec::new());
        let rate_hz = self.stream.rate_hz;
        let mut count = 0;
        while let Some(run) = self.next()? {
            count += run.samples.len();
            if count > formats::MOST_VALUES {
                return Err(too_many);
            }
            let last = runs.last_mut();
            match last.filter(|last| last.goes_on_with(&run, rate_hz)) {
                Some(last) if rate_hz > 0.0 => {
                    last.last_ns = run.last_ns;
                    last.samples.extend(run.samples);
                }
                _ if rate_hz > 0.0 => runs.push(run),
                _ => {
                    at_ns.push(run.first_ns);
                    values.extend(run.samples);
                }
            }
        }
        let width = self.stream.channels.len().max(1);
        let even = |run: Run| run.even(width, rate_hz);
        let content = if rate_hz > 0.0 {
            formats::Content::Even(runs.into_iter().map(even).collect())
        } else {
            formats::Content::Uneven { at_ns, values }
        };
        Ok(Imported { stream: self.stream, content })
    }

    fn is_dated(&self) -> bool {
        self.ahead.as_ref().is_some_and(|(at_ns, _)| *at_ns >= DATED_NS)
    }

    /// Reads the next run; `None` at the end of the table.
    fn next(&mut self) -> Result<Option<Run>, Failure> {
        let Some((first_ns, row)) = self.ahead.take() else { return Ok(None) };
        let mut run = Run { first_ns, last_ns: first_ns, samples: row.values };
        if self.stream.rate_hz <= 0.0 {
            self.ahead = self.rows.next()?;
            return Ok(Some(run));
        }
        let period_ns = 1e9 / self.stream.rate_hz;
        while let Some((at_ns, row)) = self.rows.next()? {
            let after_ns = at_ns.saturating_sub(run.last_ns);
            let follows = after_ns > 0 && (after_ns as f64) < GAP_PERIODS * period_ns;
            let is_long = at_ns.saturating_sub(run.first_ns) as f64 > RUN_SECS * 1e9;
            if !follows || is_long {
                self.ahead = Some((at_ns, row));
                break;
            }
            run.last_ns = at_ns;
            run.samples.extend(row.values);
        }
        Ok(Some(run))
    }
}

/// Creates the stream of a table, in the unit in which its signal is analysed.
fn stream(signal: &Analysis, table: &Table, asked: &Asked) -> Stream {
    let subject = Subject { about: About::Person, id: asked.person().to_owned() };
    let persons = NAMESPACE.trim_end_matches('*');
    let name = format!("{persons}{}/{}/{}", asked.person(), asked.device, signal.word());
    let shape = if signal.is_even() { Shape::Wave } else { Shape::Sample };
    let mut stream = Stream::raw(name, subject, shape);
    stream.signal = signal.signal;
    stream.rate_hz = if signal.is_even() { table.rate_hz() } else { 0.0 };
    let names: Vec<String> = match table.names() {
        [_] => vec![signal.word().to_owned()],
        several => {
            let plain = several.iter().map(|name| on_one_line(without_unit(name)).into_owned());
            unlike(plain).collect()
        }
    };
    let reported = |place: usize| table.units().get(place).cloned().flatten().unwrap_or_default();
    let unit = |place: usize| {
        let own =
            signal.unit().map(str::to_owned).or_else(|| asked.table.unit().map(str::to_owned));
        spelt(&own.unwrap_or_else(|| reported(place)))
    };
    let channel = |(place, name)| Channel::new(name, unit(place));
    stream.channels = names.into_iter().enumerate().map(channel).collect();
    "imported from a table".clone_into(&mut stream.doc);
    stream
}

#[async_trait]
impl Source for Tables {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let firsts = self.each.iter().filter_map(|reader| Some(reader.ahead.as_ref()?.0));
        let Some(begin_ns) = firsts.min() else { return Ok(()) };
        let mut waiting = Vec::new();
        for reader in &mut self.each {
            let begin = Time::from_nanos(begin_ns.saturating_add(reader.shift_ns));
            let id = outlet.declare_at(reader.stream.clone(), begin);
            waiting.push((id, reader.next().map_err(|error| broken(&error))?));
        }
        loop {
            let ends = waiting.iter().enumerate();
            let ends = ends.filter_map(|(place, (_, run))| Some((run.as_ref()?.last_ns, place)));
            let Some((_, place)) = ends.min() else { return Ok(()) };
            let reader = &mut self.each[place];
            let next = reader.next().map_err(|error| broken(&error))?;
            let (id, run) = &mut waiting[place];
            let Some(run) = std::mem::replace(run, next) else { return Ok(()) };
            let (reading, arrival) = reading(*id, reader, run);
            if outlet.send(reading, arrival).await.is_err() {
                return Ok(());
            }
        }
    }
}

/// Converts a run to a reading, with the time of its last sample as its arrival.
fn reading(stream: StreamId, reader: &Reader, run: Run) -> (Reading, Time) {
    let at = |nanos: i64| Time::from_nanos(nanos.saturating_add(reader.shift_ns));
    let data = if reader.stream.rate_hz > 0.0 {
        Data::Wave(Wave {
            period_ns: 1e9 / reader.stream.rate_hz,
            channels: reader.stream.channels.len() as u32,
            samples: run.samples.into(),
        })
    } else {
        Data::Sample(Arc::from(run.samples))
    };
    let source_time = Some(at(run.first_ns));
    let arrival = at(run.last_ns) + Duration::from_nanos(1);
    (Reading { stream, index: None, device_time: None, source_time, data }, arrival)
}

/// Adds the path of the file to a failure.
fn of_file(path: &Path, failure: &Failure) -> Failure {
    let (message, hint) = failure.words();
    Failure::new(format!("{}: {message}", path.display())).hint(hint).exit(failure.exit)
}

/// The error for a table that was read before and can't be read again.
fn broken(error: &Failure) -> SourceError {
    let (message, hint) = error.words();
    let message = message
        .strip_prefix("failed to ")
        .map_or_else(|| format!("read a table: {message}"), str::to_owned);
    SourceError::Fatal { message, hint }
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::Signal;

    use super::*;

    #[test]
    fn the_names_of_device_files_indicate_their_signals() {
        let of = |name: &str| signal_of(Path::new(name)).map(|analysis| analysis.signal);
        assert_eq!(of("E4/EDA.csv"), Some(Signal::Eda));
        assert_eq!(of("E4/IBI.csv"), Some(Signal::Interval));
        assert_eq!(of("intervals_p001_polar_h10.csv"), Some(Signal::Interval));
        assert_eq!(of("Polar_H10_12345678_20240401_120000_ECG.txt"), Some(Signal::Ecg));
        assert_eq!(of("1-1-ABC_2023-01-01_temperature.csv"), Some(Signal::Temperature));
        for name in ["HR.csv", "tags.csv", "info.txt", "data.csv", "decades.csv"] {
            assert_eq!(of(name), None, "{name}");
        }
    }

    /// Opens tables with these texts, as with `import` and these arguments.
    fn opened(texts: &[&str], arguments: &[&str]) -> Result<Tables, Failure> {
        #[derive(clap::Parser)]
        struct Command {
            #[command(flatten)]
            asked: Asked,
        }
        let arguments = ["import"].iter().chain(arguments);
        let Command { asked } = clap::Parser::parse_from(arguments);
        let folder = tempfile::tempdir().unwrap();
        let file = |(number, text): (usize, &&str)| {
            let path = folder.path().join(format!("table_{number}.csv"));
            std::fs::write(&path, text).unwrap();
            path
        };
        let files: Vec<PathBuf> = texts.iter().enumerate().map(file).collect();
        Tables::open(&files, &asked)
    }

    #[test]
    fn what_is_wrong_in_a_later_row_is_refused_when_tables_are_opened() {
        let timed = |last: &str| {
            let rows = (0..60).map(|k| format!("{:.2},{k}\n", f64::from(k) / 4.0));
            rows.fold("time [s],eda [uS]\n".to_owned(), |text, row| text + &row) + last
        };
        let right = timed("");
        assert!(opened(&[&right], &["--signal", "eda"]).is_ok());
        for (last, reason) in [
            ("2.0,1\n", "failed to follow the times: line 62 is 12.8 s before an earlier line"),
            ("1000000,1\n", "failed to follow the times: line 62 is 999985 s after"),
            ("15.0,x\n", "failed to read line 62: column eda [uS] holds \"x\""),
        ] {
            let refused = opened(&[&timed(last)], &["--signal", "eda"]).err().unwrap().words();
            assert!(refused.0.starts_with(reason) && !refused.1.is_empty(), "{refused:?}");
            let refused = opened(&[&right, &timed(last)], &["--signal", "eda"]).err().unwrap();
            assert!(refused.words().0.contains("table_1.csv: failed to"), "{:?}", refused.words());
        }
        let secs = "0.8\n".repeat(100);
        let (message, hint) = opened(&[&secs], &["--signal", "interval"]).err().unwrap().words();
        assert_eq!(message, "intervals of 0.8 ms are not heartbeat intervals");
        assert!(hint.contains("--unit s"), "{hint}");
    }
}
