//! A bag that commands start and stop.

use std::path::Path;
use std::time::Duration;

use teampulse_bag::{BagSink, Complete, Growth, Opening, Options, Place, Recording, STOPPED};
use teampulse_core::command::Command;
use teampulse_core::reports::Noting;
use teampulse_core::sample::Record;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};

use super::continuing::{ContinuingBag, and, command_of, next_folder};
use super::kept::{Kept, Limits};

/// How often the number of kept seconds is reported.
const STATE_EVERY: Duration = Duration::from_secs(1);

/// The note on a command to stop the recording while nothing is recorded.
const NOTHING_TO_STOP: &str = "`stop_recording` had no effect: nothing is being recorded";

/// A recording that commands start and stop, any number of times, each time in a separate bag. While it is paused, the
/// last seconds are kept in memory.
#[derive(Debug)]
pub struct CommandedBag {
    /// The template from which the bag of each recording is made.
    pub bag: ContinuingBag,
    /// Whether the recording starts paused.
    pub is_paused: bool,
    /// How much is kept while the recording is paused.
    pub limits: Limits,
}

impl Sink for CommandedBag {
    fn name(&self) -> &'static str {
        self.bag.name()
    }

    fn delivery(&self) -> Delivery {
        self.bag.delivery()
    }

    fn carries_out(&self) -> &'static [&'static str] {
        &["split", "start_recording", "stop_recording", "snapshot"]
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let CommandedBag { bag, is_paused, limits } = *self;
        let mut course = Course { bag, limits, inbox, is_first: true, failed: None };
        let mut next = if is_paused {
            Next::Pause { kept: course.nothing_kept(), after: Vec::new() }
        } else {
            Next::Record(Box::new(course.begin_first()?))
        };
        loop {
            next = match next {
                Next::Record(recording) => course.record(*recording),
                Next::Pause { kept, after } => course.pause(kept, &after),
                Next::Begin(opening) => course.begin(opening),
                Next::End => return course.failed.map_or(Ok(()), Err),
            }
        }
    }
}

/// What to do next.
enum Next {
    /// Start a recording with this content.
    Begin(Opening),
    /// Record.
    Record(Box<Recording>),
    /// Pause the recording.
    Pause {
        /// The records kept so far.
        kept: Kept,
        /// The records that follow the command in the same batch.
        after: Vec<Record>,
    },
    /// End with the session.
    End,
}

/// The state of a recording that commands start and stop.
struct Course {
    bag: ContinuingBag,
    limits: Limits,
    inbox: Inbox,
    /// Whether the folder created for the session is still unused.
    is_first: bool,
    failed: Option<SinkError>,
}

impl Course {
    fn growth(&self) -> &Growth {
        &self.bag.bag.options.growth
    }

    /// Starts the recording at the start of a session; without a bag, the session does not start.
    fn begin_first(&mut self) -> Result<Recording, SinkError> {
        self.is_first = false;
        self.bag.begin()
    }

    fn record(&mut self, recording: Recording) -> Next {
        let course = self.bag.record(recording, &self.inbox);
        if let Some(failed) = course.failed {
            self.fail(failed);
        }
        match course.complete {
            Complete::WithSession => Next::End,
            Complete::ByCommand { after } => {
                // The tidy files beside this bag end with it; the tidy files of later bags are written at the end of
                // the session.
                self.bag.ended.report(STOPPED);
                Next::Pause { kept: self.nothing_kept(), after }
            }
        }
    }

    fn nothing_kept(&self) -> Kept {
        Kept::new(self.limits, self.inbox.latched())
    }

    /// Keeps the last seconds until a command starts a recording.
    fn pause(&mut self, mut kept: Kept, after: &[Record]) -> Next {
        if let Some(place) = self.take(&mut kept, after) {
            return self.begins(kept, after[place..].to_vec());
        }
        loop {
            self.growth().pause(kept.secs());
            match self.inbox.receive(STATE_EVERY) {
                Received::Batch(batch) => {
                    if let Some(place) = self.take(&mut kept, &batch) {
                        return self.begins(kept, batch[place..].to_vec());
                    }
                }
                Received::Silence => {}
                Received::Closed => return self.close(),
            }
        }
    }

    /// Keeps these records up to the command that starts a recording; returns the index after the command.
    fn take(&mut self, kept: &mut Kept, records: &[Record]) -> Option<usize> {
        for (place, record) in records.iter().enumerate() {
            kept.push(record);
            match command_of(record) {
                Some(Command::StartRecording) => return Some(place + 1),
                Some(Command::Snapshot) => self.snapshot(kept),
                Some(Command::StopRecording) => self.note(NOTHING_TO_STOP),
                _ => {}
            }
        }
        None
    }

    fn begins(&mut self, kept: Kept, after: Vec<Record>) -> Next {
        self.state_cut(&kept);
        Next::Begin(kept.opening(after))
    }

    /// Starts a recording by command; if that fails, the records stay in memory.
    fn begin(&mut self, opening: Opening) -> Next {
        let begun = self.next_bag().and_then(|bag| {
            let folder = bag.folder.clone();
            Ok((folder, self.bag.begin_in(bag)?))
        });
        match begun {
            Ok((folder, recording)) => {
                self.bag.ended.goes_on_in(folder);
                Next::Record(Box::new(recording.in_session(opening)))
            }
            Err(error) => {
                self.inbox.report(format!("bag: failed to {error}; the recording is still paused"));
                self.fail(error);
                let (kept, after) = Kept::reopened(self.limits, opening);
                Next::Pause { kept, after }
            }
        }
    }

    /// Writes the kept records into a bag of their own.
    fn snapshot(&mut self, kept: &Kept) {
        self.state_cut(kept);
        let written = self.next_bag().and_then(|mut bag| {
            // A snapshot must not look like a recording in progress.
            bag.options.growth = Growth::default();
            let folder = bag.folder.clone();
            let recording = bag.begin()?.in_session(kept.snapshot());
            recording.record_opening(&self.inbox).map_err(|broken| broken.error)?;
            Ok(folder)
        });
        match written {
            Ok(folder) => {
                self.note(&format!("the last {:.1} s are in {}", kept.secs(), folder.display()));
                self.bag.ended.goes_on_in(folder);
            }
            Err(error) => {
                self.inbox.report(format!("bag: failed to {error}; no snapshot was written"));
                self.fail(error);
            }
        }
    }

    /// The next bag of the session: in the folder created for the session, or beside it.
    fn next_bag(&mut self) -> Result<BagSink, SinkError> {
        let first = &self.bag.bag;
        let bag = if self.is_first {
            first.clone()
        } else {
            let beside = first.folder.parent().unwrap_or(Path::new(""));
            let folder = next_folder(&first.folder, beside).ok_or_else(|| SinkError::Failed {
                message: format!("name a bag beside {}", first.folder.display()),
                hint: String::new(),
            })?;
            let options = Options { place: Place::New, ..first.options.clone() };
            BagSink { folder, options, ..first.clone() }
        };
        self.is_first = false;
        Ok(bag)
    }

    /// Reports it if less was kept than requested.
    fn state_cut(&self, kept: &Kept) {
        if kept.is_cut() {
            let (secs, asked_secs, mib) = (kept.secs(), self.limits.secs, kept.bytes() >> 20);
            self.inbox.report(format!(
                "bag: only the last {secs:.1} of {asked_secs} s were kept, which take {mib} MiB: raise \
                 `snapshot_mib`"
            ));
        }
    }

    /// Handles the end of the session while the recording is paused.
    fn close(&mut self) -> Next {
        if let Some(reason) = self.inbox.cut_off() {
            let hint = "please report this bug in teampulse".into();
            self.fail(SinkError::Lost { message: reason, hint });
        }
        Next::End
    }

    fn note(&self, text: &str) {
        if let Some(outlet) = self.inbox.outlet() {
            outlet.happen(Noting::Bag.event(text));
        }
    }

    fn fail(&mut self, error: SinkError) {
        self.failed = Some(match self.failed.take() {
            Some(before) => and(before, &format!("failed to {error}")),
            None => error,
        });
    }
}

#[cfg(test)]
mod tests;
