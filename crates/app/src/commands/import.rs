//! `teampulse import`: converts recordings of other programs to bags of teampulse.

mod biosensors;
mod imported;
mod joining;
mod markers;
mod hearts;
mod found_beats;
mod delay;
mod movement;
mod kind;
mod overlaps;
mod report;
mod tables;
mod written;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use teampulse_bag::{Bag, BagSink, Options, Place, Selection};
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::session::{Pace, Session};
use teampulse_core::source::Source;
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_formats::StatedDate;
use teampulse_messages::convert::encode;

use crate::commands::info::open;
use crate::commands::replay::{
    IMPORTED, defaults, describe_foreign, replayed_from, sinks_into, source_of, study_at, study_of,
    study_or_defaults,
};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::folder::Claimed;
use crate::output::{self, pasted};
use crate::recorded::read_through;
use crate::setup::{features, sink_context};
use crate::study::Study;

use biosensors::Biosensors;
use imported::DeviceRecording;
use joining::Into;
use kind::{Kind, tables_in};
use tables::{Asked, DATED_NS, Tables, is_extra_of_e4};
use written::{Placed, SessionFromDevice};

/// The note in a bag on how each of its files was placed on a session's clock.
const JOINED: &str = "teampulse.joined";

/// Converts recordings of other programs to bags of teampulse, with all computed features.
///
/// A recording of ROS 2 (a folder, .mcap or .db3, compressed or not) becomes a new bag, and so does a .bag of ROS 1,
/// whose messages are converted to ROS 2. Topics of wearables as published by the package
/// ros2-foxy-wearable-biosensors, such as `/biosensors/empatica_e4/bvp`, also become streams of a person. Tables of
/// samples, as `extract` reads them, become one bag about one person with a stream for each table; from a folder of
/// Empatica's E4 or of Polar Sensor Logger, all tables are read. The zip of an E4, files of an Embrace Plus (Avro),
/// XDF, EDF and BDF are imported, too. The imported files are not changed.
///
/// With --into, the files join a session that was recorded at the same time: their bag is on the session's clock. They
/// are aligned by heartbeats that both recorded, or by a marker with --at; the accuracy is printed and stored in the
/// bag.
#[derive(Debug, Args)]
pub struct Import {
    /// The recordings, or the tables
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Where to create the new bag's folder
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    out: PathBuf,
    /// The study with the features to compute; by default all features with their defaults
    #[arg(long)]
    study: Option<PathBuf>,
    #[command(flatten)]
    asked: Asked,
    #[command(flatten)]
    into: Into,
}

impl Import {
    /// Runs the command.
    pub async fn run(self) -> Result<Exit, Failure> {
        let (mut bags, mut tables, mut devices) = (Vec::new(), Vec::new(), Vec::new());
        for file in &self.files {
            match Kind::of(file)? {
                Kind::Bag => bags.push(file.clone()),
                Kind::Table => tables.push(file.clone()),
                Kind::Device => devices.push(file.clone()),
                Kind::Tables => tables.extend(tables_in(file)?),
            }
        }
        if !self.asked.names_signal() {
            tables = without_extras(tables);
        }
        if let Some(device) =
            devices.first().filter(|_| tables.is_empty() && self.asked.names_signal())
        {
            let message = format!(
                "{} states its own signals, and --signal is only for tables",
                device.display()
            );
            let hint = "omit --signal to import all signals of the file";
            return Err(Failure::new(message).hint(hint).exit(Exit::BadArguments));
        }
        if !(tables.is_empty() && devices.is_empty()) {
            self.asked.unnamed().iter().for_each(output::note);
        }
        let mut worst = Exit::Fine;
        for bag in &bags {
            let exit = self.bag(bag).await?;
            worst = if worst == Exit::Fine { exit } else { worst };
        }
        let is_joined = self.into.bag().is_some();
        if is_joined && !bags.is_empty() {
            return Err(Failure::new(format!(
                "{} is a recording of ROS, not of a device",
                bags[0].display()
            ))
            .hint("import it without --into")
            .exit(Exit::BadArguments));
        }
        let mut recordings = DeviceRecording::of_files(&devices, &self.asked)?;
        if is_joined && !tables.is_empty() {
            recordings.push(DeviceRecording::of_tables(Tables::open(&tables, &self.asked)?)?);
            tables.clear();
        }
        if !recordings.is_empty() {
            let exit = self.devices(recordings).await?;
            worst = if worst == Exit::Fine { exit } else { worst };
        }
        if !tables.is_empty() {
            let exit = self.tables(&tables).await?;
            worst = if worst == Exit::Fine { exit } else { worst };
        }
        Ok(worst)
    }

    fn study(&self, recording: &Path) -> Result<Study, Failure> {
        Ok(match &self.study {
            Some(path) => study_at(path)?,
            None => Study::parse(Path::new("the defaults"), defaults(recording))?,
        })
    }

    async fn bag(&self, path: &Path) -> Result<Exit, Failure> {
        let mut bag = open(path)?;
        if study_of(&bag)?.is_some() {
            let message = format!("{} is already a teampulse bag", path.display());
            return Err(Failure::new(message).hint("run `teampulse replay` to compute it again"));
        }
        bag.check();
        describe_foreign(&mut bag);
        let study = self.study(path)?;
        let claimed = Claimed::new(&self.out, &study.general.session.name)?;
        let bag = Arc::new(bag);
        let biosensors = Biosensors::of(self.asked.person());
        let streams = biosensors.report(&bag);
        let source = source_of(&bag, Selection::Raw).adapted(Box::new(biosensors));
        let exit = replayed_from(source, Arc::clone(&bag), &study, &claimed).await?;
        output::lines(report::of_bag(&bag));
        output::lines(streams);
        concluded(claimed.path(), exit);
        Ok(exit)
    }

    async fn tables(&self, files: &[PathBuf]) -> Result<Exit, Failure> {
        let tables = Tables::open(files, &self.asked)?.with_date();
        let report = tables.report();
        let study = self.study(&self.files[0])?;
        let source: Box<dyn Source> = Box::new(tables);
        let name = study.general.session.name.clone();
        let lines = report.lines().collect();
        self.computed(source, &study, Described { name, notes: BTreeMap::new(), lines }).await
    }

    /// Imports recordings of devices, on the clock of the session that they join, if there is one.
    async fn devices(&self, recordings: Vec<DeviceRecording>) -> Result<Exit, Failure> {
        let session = self.into.bag().map(open).transpose()?;
        if session.is_none() {
            are_dated_alike(&recordings)?;
        }
        let study = match (&self.study, &session) {
            (None, Some(bag)) => study_or_defaults(bag)?,
            _ => self.study(&self.files[0])?,
        };
        let name = match session {
            Some(_) => format!("{}_{}", study.general.session.name, recordings[0].device),
            None => study.general.session.name.clone(),
        };
        let (mut placed, mut lines, mut notes) = (Placed::new(), Vec::new(), Vec::new());
        for recording in recordings {
            let (session_from_device, words) = self.place(session.as_ref(), &recording)?;
            lines.push(format!("{}: {words}", recording.name));
            notes.push(format!("{}: {words}", recording.device));
            for mut signal in recording.signals {
                lines.push(format!("  {}", signal.stream.name));
                signal.stream.doc = format!("imported from a file; {words}");
                placed.add(signal, &session_from_device);
            }
        }
        let notes = BTreeMap::from([(JOINED.to_owned(), notes.join("\n"))]);
        self.computed(Box::new(placed), &study, Described { name, notes, lines }).await
    }

    /// Returns a conversion from a device's times to those of the new bag, and a description of it.
    fn place(
        &self,
        session: Option<&Bag>,
        recording: &DeviceRecording,
    ) -> Result<(SessionFromDevice, String), Failure> {
        if let Some(bag) = session {
            let joined = self.into.join(bag, self.asked.person(), recording)?;
            return Ok((joined.session_from_device, joined.words));
        }
        if recording.is_dated {
            return Ok((Box::new(|at_ns| at_ns), "times are those of the device's clock".into()));
        }
        if let Some(date) = recording.date {
            let zero_ns = date.zero_ns;
            return Ok((
                Box::new(move |at_ns| at_ns.saturating_add(zero_ns)),
                begun(recording, date),
            ));
        }
        let first_ns = recording.first_ns();
        let words = "it contains no date: the bag begins in 2001".into();
        Ok((Box::new(move |at_ns| at_ns.saturating_sub(first_ns).saturating_add(DATED_NS)), words))
    }

    /// Writes a bag from a source, with all computed features.
    async fn computed(
        &self,
        source: Box<dyn Source>,
        study: &Study,
        Described { name, mut notes, lines }: Described,
    ) -> Result<Exit, Failure> {
        notes.insert(IMPORTED.to_owned(), "files".to_owned());
        let claimed = Claimed::new(&self.out, &name)?;
        let folder = claimed.path().to_owned();
        let clock = Clock::settable();
        let mut context = sink_context(study, &folder, &clock);
        context.is_imported = true;
        let session = name;
        let options = Options { session, notes, place: Place::Claimed, ..Options::default() };
        let bag = BagSink { folder: folder.clone(), study: study.text().to_owned(), options };
        let sinks = sinks_into(bag, study, &context)?;
        let session = Session {
            clock,
            pace: Pace::Recorded,
            clocks: Clocks::new(study.general.clocks.clone()),
            streams: Streams::default(),
            sources: vec![("files".into(), source)],
            features: features(study)?,
            sinks,
            workers: Vec::new(),
            encode,
            commands: Commands::default(),
        };
        let exit = read_through(session, &folder).await;
        output::lines(lines);
        concluded(&folder, exit);
        Ok(exit)
    }
}

/// Returns the tables of samples among files of an E4. Its heart rate and tags are noted and left out, as when its
/// folder is imported.
fn without_extras(tables: Vec<PathBuf>) -> Vec<PathBuf> {
    let (extras, samples): (Vec<PathBuf>, Vec<PathBuf>) =
        tables.into_iter().partition(|path| is_extra_of_e4(path));
    if samples.is_empty() {
        return extras;
    }
    for extra in extras {
        let note = "is left out; import the zip of the E4's session to include it";
        output::note(format!("note: {} {note}", extra.display()));
    }
    samples
}

/// Fails if only some recordings have a date: the others would be placed years earlier.
fn are_dated_alike(recordings: &[DeviceRecording]) -> Result<(), Failure> {
    let has_date = |recording: &&DeviceRecording| recording.is_dated || recording.date.is_some();
    let undated = recordings.iter().find(|recording| !has_date(recording));
    match undated.filter(|_| recordings.iter().any(|recording| has_date(&recording))) {
        None => Ok(()),
        Some(undated) => {
            let message = format!("{} contains no date, but other files do", undated.name);
            let hint = "import it alone, or place all of them in a session with --into";
            Err(Failure::new(message).hint(hint).exit(Exit::BadArguments))
        }
    }
}

/// Describes how a recording was placed at the date that its file states.
fn begun(recording: &DeviceRecording, date: StatedDate) -> String {
    let first = Time::from_nanos(date.zero_ns.saturating_add(recording.first_ns()));
    let zone = if date.has_zone { "" } else { "; the file states no time zone, so UTC is assumed" };
    format!("it starts at {first}, as its header states{zone}")
}

/// The name and description of a new bag.
struct Described {
    /// The session's name.
    name: String,
    /// Notes stored in the bag.
    notes: BTreeMap<String, String>,
    /// Lines to print.
    lines: Vec<String>,
}

/// Prints the path of the new bag and how to inspect it.
fn concluded(folder: &Path, exit: Exit) {
    if exit != Exit::Failed {
        output::line(format!("imported; inspect it with `teampulse info {}`", pasted(folder)));
        output::last_line(folder.display().to_string());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DATE: StatedDate = StatedDate { zero_ns: 1_767_608_100_000_000_000, has_zone: false };

    fn recording(is_dated: bool, date: Option<StatedDate>) -> DeviceRecording {
        let (name, device) = ("night.edf".to_owned(), "file".to_owned());
        DeviceRecording { name, device, is_dated, date, signals: Vec::new() }
    }

    #[test]
    fn a_date_without_a_time_zone_is_taken_as_utc() {
        let words = begun(&recording(false, Some(DATE)), DATE);
        assert_eq!(
            words,
            "it starts at 2026-01-05T10:15:00.000Z, as its header states; the file states no time zone, so UTC is assumed"
        );
        let zoned = StatedDate { has_zone: true, ..DATE };
        assert!(begun(&recording(false, Some(zoned)), zoned).ends_with("as its header states"));
    }

    #[test]
    fn the_heart_rate_and_the_tags_of_an_e4_are_left_out_beside_its_samples() {
        let paths = |names: &[&str]| names.iter().map(PathBuf::from).collect::<Vec<_>>();
        let all = paths(&["e4/ACC.csv", "e4/HR.csv", "e4/IBI.csv", "e4/tags.csv"]);
        assert_eq!(without_extras(all), paths(&["e4/ACC.csv", "e4/IBI.csv"]));
        assert_eq!(without_extras(paths(&["e4/HR.csv"])), paths(&["e4/HR.csv"]));
    }

    #[test]
    fn files_with_and_without_a_date_are_not_imported_together() {
        let (clock, header) = (recording(true, None), recording(false, Some(DATE)));
        let none = || recording(false, None);
        assert!(are_dated_alike(&[none(), none()]).is_ok());
        let (message, _) = are_dated_alike(&[clock, header, none()]).unwrap_err().words();
        assert_eq!(message, "night.edf contains no date, but other files do");
    }
}
