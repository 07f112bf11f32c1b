//! A bag that continues in another one when it ends early.

use std::path::{Path, PathBuf};
use std::time::Duration;

use teampulse_bag::disk::free_bytes;
use teampulse_bag::{BagSink, Broken, Complete, Options, Place, Recording};
use teampulse_core::clock::Clock;
use teampulse_core::command::{Accepted, Command};
use teampulse_core::counted::counted;
use teampulse_core::sample::Record;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};

use crate::Ended;

/// The interval between attempts to continue a failed recording.
const AGAIN_EVERY: Duration = Duration::from_secs(5);
/// The maximum number of bags of one recording, in case a disk fills up repeatedly.
const MOST_BAGS: usize = 100;
/// The recording continues on a full disk once a part of the space that was free at its start is free again: one in
/// this many bytes, so that the disk does not fill up again at once.
const ROOM_SHARE: u64 = 4;
/// The lower and the upper limit of that free space [bytes]; a bag that only starts and ends needs the lower limit.
const ROOM_BYTES: (u64, u64) = (8 << 20, 64 << 20);

/// Where a recording continues after a failure.
#[derive(Clone, Debug)]
pub enum Continuation {
    /// Nowhere.
    Never,
    /// In a folder beside the bag's, or in the fallback.
    Beside {
        /// The folder to continue in when the bag's own disk is full or gone.
        fallback: Option<PathBuf>,
    },
}

/// A bag that continues in another one when it ends early. It notifies the tidy files beside it, so that they end with
/// it.
#[derive(Debug)]
pub struct ContinuingBag {
    /// The bag.
    pub bag: BagSink,
    /// Notifies the tidy files when the bag ends.
    pub ended: Ended,
    /// Where the recording continues after a failure.
    pub again: Continuation,
    /// Whether the command `stop_recording` ends the recording.
    pub ends_by_command: bool,
}

impl Sink for ContinuingBag {
    fn name(&self) -> &'static str {
        self.bag.name()
    }

    fn delivery(&self) -> Delivery {
        self.bag.delivery()
    }

    fn carries_out(&self) -> &'static [&'static str] {
        self.bag.carries_out()
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let first = self.begin()?;
        self.record(first, &inbox).failed.map_or(Ok(()), Err)
    }
}

/// How a recording ended, including all of its bags.
#[derive(Debug)]
pub struct Course {
    /// How the last bag ended.
    pub complete: Complete,
    /// The failures along the way, if any.
    pub failed: Option<SinkError>,
}

impl ContinuingBag {
    /// Creates the first bag.
    pub fn begin(&self) -> Result<Recording, SinkError> {
        let begun = self.begin_in(self.bag.clone());
        begun.inspect_err(|error| self.ended.report(format!("failed to {error}")))
    }

    /// Creates a bag of the recording.
    pub fn begin_in(&self, bag: BagSink) -> Result<Recording, SinkError> {
        let recording = bag.begin()?;
        Ok(if self.ends_by_command { recording.until_stopped() } else { recording })
    }

    /// Records in this bag and, after a failure, in others.
    pub fn record(&self, first: Recording, inbox: &Inbox) -> Course {
        let broken = match first.record(inbox) {
            Ok(complete) => return Course { complete, failed: None },
            Err(broken) => broken,
        };
        self.ended.report(format!("failed to {}", broken.error));
        match &self.again {
            Continuation::Never => Course {
                complete: Complete::WithSession,
                failed: Some(in_no_bag(broken.error, broken.unwritten)),
            },
            Continuation::Beside { fallback } => {
                goes_on(self, fallback.as_deref(), broken, inbox, MOST_BAGS)
            }
        }
    }
}

/// Continues a failed recording in one bag after another.
fn goes_on(
    sink: &ContinuingBag,
    fallback: Option<&Path>,
    broken: Broken,
    inbox: &Inbox,
    most_bags: usize,
) -> Course {
    let Broken { error: mut failed, unwritten: mut missed } = broken;
    let needed_bytes = needed_bytes(sink);
    inbox.report(format!(
        "bag: failed to {failed}; another bag begins once {} MiB are free and the disk is writable",
        needed_bytes.div_ceil(1 << 20)
    ));
    let mut before = sink.bag.folder.clone();
    let mut bags = 1;
    while let Some(skipped) = inbox.resume() {
        missed += skipped;
        if bags == most_bags {
            let given_up =
                format!("the recording ends after {}", counted(most_bags, "bag", "bags"));
            inbox.report(format!("bag: {given_up}"));
            failed = and(failed, &given_up);
            bags += 1;
        }
        let is_over = bags > most_bags;
        let begun = if is_over { None } else { begin_again(sink, fallback, needed_bytes) };
        let Some((folder, recording)) = begun else {
            let (passed, stopped) = let_pass(inbox, (!is_over).then_some(AGAIN_EVERY));
            missed += passed;
            if let Some(complete) = stopped.filter(|_| sink.ends_by_command) {
                return Course { complete, failed: Some(in_no_bag(failed, missed)) };
            }
            continue;
        };
        let summary =
            format!("recording continues in {}; {}", folder.display(), are_in_no_bag(missed));
        inbox.report(format!("bag: {summary}"));
        sink.ended.goes_on_in(folder.clone());
        failed = and(failed, &summary);
        bags += 1;
        let recording = recording.continuing(&before, inbox.latched());
        match recording.record(inbox) {
            Ok(complete) => return Course { complete, failed: Some(failed) },
            Err(Broken { error: next, unwritten }) => {
                inbox.report(format!("bag: failed to {next}"));
                failed = and(failed, &format!("failed to {next}"));
                missed = unwritten;
            }
        }
        before = folder;
    }
    missed += inbox.take_skipped();
    while let Received::Batch(batch) = inbox.receive(Duration::ZERO) {
        missed += batch.len() as u64;
    }
    Course { complete: Complete::WithSession, failed: Some(in_no_bag(failed, missed)) }
}

/// Adds the number of lost messages to a failure.
fn in_no_bag(failed: SinkError, missed: u64) -> SinkError {
    if missed > 0 { and(failed, &are_in_no_bag(missed)) } else { failed }
}

fn are_in_no_bag(missed: u64) -> String {
    format!("{} in no bag", counted(missed, "message is", "messages are"))
}

/// The free space that a recording needs to continue on a disk that was full [bytes].
fn needed_bytes(sink: &ContinuingBag) -> u64 {
    let Options { keep_free_bytes, growth, .. } = &sink.bag.options;
    let (least, most) = ROOM_BYTES;
    let began_with = growth.on_disk().began_with_bytes.unwrap_or(u64::MAX);
    let room_bytes = began_with.saturating_sub(*keep_free_bytes) / ROOM_SHARE;
    keep_free_bytes.saturating_add(room_bytes.clamp(least, most))
}

/// Creates another bag for a recording: beside the first, or in the fallback.
fn begin_again(
    sink: &ContinuingBag,
    fallback: Option<&Path>,
    needed_bytes: u64,
) -> Option<(PathBuf, Recording)> {
    let first = &sink.bag;
    let beside = first.folder.parent().unwrap_or(Path::new(""));
    let is_roomy = |parent: &Path| free_bytes(parent).is_ok_and(|free| free >= needed_bytes);
    let folders = [Some(beside), fallback].into_iter().flatten();
    folders.filter(|parent| is_roomy(parent)).find_map(|parent| {
        let folder = next_folder(&first.folder, parent)?;
        let options = Options { place: Place::New, ..first.options.clone() };
        let bag = BagSink { folder: folder.clone(), options, ..first.clone() };
        Some((folder, sink.begin_in(bag).ok()?))
    })
}

/// Returns the next unused folder in `parent` for another bag of the session whose first bag is in `first`.
pub fn next_folder(first: &Path, parent: &Path) -> Option<PathBuf> {
    let name = first.file_name()?.to_string_lossy().into_owned();
    let mut folders = (2..).map(|number| parent.join(format!("{name}_{number}")));
    folders.find(|folder| folder.symlink_metadata().is_err())
}

/// Drops input for a while, or until the session ends or a command ends the recording; returns the number of dropped
/// messages, and the records after that command.
fn let_pass(inbox: &Inbox, patience: Option<Duration>) -> (u64, Option<Complete>) {
    let clock = Clock::host();
    let until = patience.map(|patience| clock.now() + patience);
    let mut passed = 0;
    while until.is_none_or(|until| clock.now() < until) {
        match inbox.receive(AGAIN_EVERY) {
            Received::Batch(batch) => {
                passed += batch.len() as u64;
                let stops = |record: &Record| command_of(record) == Some(Command::StopRecording);
                if let Some(place) = batch.iter().position(stops) {
                    let after = batch[place + 1..].to_vec();
                    return (passed, Some(Complete::ByCommand { after }));
                }
            }
            Received::Silence => {}
            Received::Closed => break,
        }
    }
    (passed, None)
}

/// Returns the command that a record carries, if any.
pub fn command_of(record: &Record) -> Option<Command> {
    Accepted::of(&record.stream, &record.sample.data).map(|accepted| accepted.command)
}

/// Appends text to the message of a failure.
pub fn and(failed: SinkError, more: &str) -> SinkError {
    let (SinkError::Lost { message, hint } | SinkError::Failed { message, hint }) = failed;
    SinkError::Lost { message: format!("{message}; {more}"), hint }
}

#[cfg(test)]
mod tests;
