//! Tidy files next to the bag, for readers without bag tools.

mod timeline;
mod events;
mod features;
mod file;
mod intervals;
mod phases;
mod measures;
mod meanings;
mod sidecar;
mod summary;

use std::path::{Path, PathBuf};
use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::Data;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Record;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError, Wants};
use teampulse_core::stream::{Shape, Stream};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;

use self::events::Events;
use self::features::Features;
use self::file::Unwritten;
use self::intervals::Intervals;
use self::measures::Measures;
use self::phases::PhaseTable;
use self::summary::Summary;
pub use self::summary::{LOST_OR_WRONG, NOTHING_NOTICED};
use self::timeline::Timeline;
use crate::{Ended, Part, SinkContext};

/// The longest wait for a batch of input.
const PATIENCE: Duration = Duration::from_secs(1);
/// How long records gather before they are written.
const GATHER: Duration = Duration::from_millis(100);
/// The interval between flushes [s], which bounds the loss in a crash.
const FLUSH_EVERY_SECS: f64 = 1.0;
/// How long the bag may take to create its folder, and how often to check.
const FOLDER_WITHIN: Duration = Duration::from_secs(5);
const LOOK: Duration = Duration::from_millis(5);

/// Tidy files in the bag's folder, for readers who do not work with bags: `events.tsv` as in BIDS, `phases.csv` with a
/// row for each phase of a subject and a column for each measure, `features.csv` with a row for each value of a window,
/// `intervals.csv` with the heart's intervals, their times, phases and which of them are corrected, and `intervals.txt`
/// with the same as read by Kubios HRV; a `.json` beside each table that describes its columns and measures; and
/// `summary.md`, a page on what was usable.
///
/// A study with a bag has them by default; `tidy = false` in the bag's settings disables them.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Tidy {
    /// In `features.csv`, a stream has rows for at most one window per this many seconds [s]; longer windows have rows
    /// whenever one is over.
    pub every_secs: f64,
}

impl Default for Tidy {
    fn default() -> Tidy {
        Tidy { every_secs: 30.0 }
    }
}

impl Component<dyn Sink, SinkContext> for Tidy {
    const EXAMPLE: &'static str = "every_secs = 30";

    fn build(self, context: &SinkContext) -> Result<Box<dyn Sink>, SettingsError> {
        if !(self.every_secs.is_finite() && self.every_secs > 0.0) {
            let message = format!("every_secs is {}, expected seconds above 0", self.every_secs);
            return Err(SettingsError::new(message));
        }
        let SinkContext { bag: folder, session, bag_ended, damage, is_imported, part, .. } =
            context.clone();
        let settings = self;
        Ok(Box::new(Files { settings, folder, session, bag_ended, damage, is_imported, part }))
    }
}

/// The files of a session.
struct Files {
    settings: Tidy,
    folder: PathBuf,
    session: String,
    bag_ended: Ended,
    damage: Option<String>,
    is_imported: bool,
    part: Part,
}

/// Returns a hint for files that could not be written into this folder.
fn hint_for(folder: &Path) -> String {
    let folder_name = folder.display();
    if !folder.exists() {
        return format!("{folder_name} is gone: it was moved or deleted during the recording");
    }
    format!(
        "the bag continues without its tidy files; check the free disk space and the permissions; `teampulse recover \
         {folder_name}` writes them again"
    )
}

impl Sink for Files {
    fn name(&self) -> &'static str {
        "tidy"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn wants(&self) -> Wants {
        Wants::Only(Box::new(is_listed))
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let Files { settings, folder, session, bag_ended, damage, is_imported, part } = *self;
        if bag_ended.is_later() {
            // The tidy files of such a bag are written when it is complete.
            return Ok(());
        }
        wait_for(&folder)?;
        let lost = |error: &Unwritten| SinkError::Lost {
            message: error.to_string(),
            hint: hint_for(&folder),
        };
        let mut writing = Writing::begin(&settings, &folder).map_err(|error| lost(&error))?;
        writing.summary.damage = damage;
        writing.timeline.has_end = !is_imported;
        writing.timeline.has_joined = part.has_joined;
        if let Some(why) = &part.ended {
            writing.timeline.end_with_bag(why);
        }
        loop {
            if let Some(why) = bag_ended.why() {
                writing.timeline.end_with_bag(&why);
                return writing.finish(&folder, &session).map_err(|error| lost(&error));
            }
            match inbox.receive_gathered(GATHER, PATIENCE) {
                Received::Batch(batch) => {
                    let streams = inbox.streams();
                    let written = batch.iter().try_for_each(|record| writing.take(record, streams));
                    written.map_err(|error| lost(&error))?;
                }
                Received::Silence => {}
                Received::Closed => {
                    if let Some(reason) = inbox.cut_off() {
                        writing.timeline.end_early(&reason);
                    }
                    return writing.finish(&folder, &session).map_err(|error| lost(&error));
                }
            }
        }
    }
}

/// Whether the files use a stream.
fn is_listed(stream: &Stream) -> bool {
    use Shape::{Description, Event, Feature, Status};
    matches!(stream.shape, Event | Feature | Status | Description)
}

/// Waits until the folder of the bag exists.
fn wait_for(folder: &Path) -> Result<(), SinkError> {
    for _ in 0..FOLDER_WITHIN.as_millis() / LOOK.as_millis() {
        if folder.is_dir() {
            return Ok(());
        }
        std::thread::sleep(LOOK);
    }
    Err(SinkError::Lost {
        message: format!("write tidy files into {}: there is no bag", folder.display()),
        hint: String::new(),
    })
}

/// The open files of a running session.
struct Writing {
    folder: PathBuf,
    timeline: Timeline,
    events: Events,
    features: Features,
    measures: Measures,
    phases: PhaseTable,
    intervals: Intervals,
    summary: Summary,
    flushed: Time,
}

impl Writing {
    fn begin(settings: &Tidy, folder: &Path) -> Result<Writing, Unwritten> {
        sidecar::write_events(folder)?;
        let measures = Measures::default();
        sidecar::write_features(folder, &measures)?;
        Ok(Writing {
            folder: folder.to_owned(),
            measures,
            phases: PhaseTable::new(folder),
            timeline: Timeline::default(),
            events: Events::create(folder)?,
            features: Features::create(folder, settings.every_secs)?,
            intervals: Intervals::new(folder),
            summary: Summary::default(),
            flushed: Time::EPOCH,
        })
    }

    fn take(&mut self, record: &Record, streams: &Streams) -> Result<(), Unwritten> {
        let timeline = &mut self.timeline;
        timeline.take(record);
        self.summary.take(record, timeline, streams);
        match &record.sample.data {
            Data::Event(event) => {
                self.events.take(record, event, timeline)?;
                self.intervals.take(record, event, streams, timeline)?;
            }
            Data::Feature(values) => {
                self.measures.take(record);
                self.features.take(record, values, timeline)?;
                self.phases.take(record, values, timeline);
            }
            _ => {}
        }
        if self.timeline.now().secs_since(self.flushed) < FLUSH_EVERY_SECS {
            return Ok(());
        }
        self.flushed = self.timeline.now();
        self.events.flush()?;
        self.features.flush()?;
        self.describe_measures()?;
        self.intervals.flush()
    }

    /// Writes new descriptions of measures.
    fn describe_measures(&mut self) -> Result<(), Unwritten> {
        if std::mem::take(&mut self.measures.is_news) {
            sidecar::write_features(&self.folder, &self.measures)?;
        }
        Ok(())
    }

    fn finish(mut self, folder: &Path, session: &str) -> Result<(), Unwritten> {
        self.timeline.finish();
        self.describe_measures()?;
        self.events.finish(&self.timeline)?;
        self.features.flush()?;
        self.phases.finish(folder, &self.timeline, &self.measures)?;
        let intervals = self.intervals.finish(&self.timeline)?;
        self.summary.finish((folder, session), &self.timeline, &intervals)
    }
}

#[cfg(test)]
mod tests;
