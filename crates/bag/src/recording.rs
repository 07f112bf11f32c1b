//! A bag while it is recorded.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use teampulse_core::clock::Clock;
use teampulse_core::command::{Accepted, Command};
use teampulse_core::data::Data;
use teampulse_core::fault::lasting;
use teampulse_core::latched::{Latched, StandingEvent};
use teampulse_core::panics::{self, Panic, caught};
use teampulse_core::reports::Noting;
use teampulse_core::sample::{Record, Sample, Turn};
use teampulse_core::session_streams::{descriptions, session_events};
use teampulse_core::sink::{Inbox, Received, SinkError};
use teampulse_core::stream::{Stream, StreamId};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_messages::convert::encode;

use crate::error::BagError;
use crate::growth::Growth;
use crate::sink::{BagSink, CONTINUES_NOTE, ENDED_NOTE, JOINED_NOTE, STUDY_NAME};
use crate::write::BagWriter;
use crate::write::part::Attachment;

/// The interval at which written data are synced to the disk: including the time for writing, at most a second of a
/// recording can be lost.
const FLUSH_EVERY: Duration = Duration::from_millis(800);

/// How long readings gather before they are written.
const GATHER: Duration = Duration::from_millis(20);

/// A bag that is being recorded.
pub struct Recording {
    writer: BagWriter,
    growth: Growth,
    folder: PathBuf,
    /// The study, until it is attached.
    study: String,
    /// The records and the state from before the recording began, until they are written.
    opening: Option<Opening>,
    /// Whether `stop_recording` ends the recording.
    ends_by_command: bool,
    losses: BTreeMap<String, Losses>,
    clock: Clock,
    flush_due: Time,
    /// The log time of the newest record.
    last: Time,
    /// The number of records received but not written yet.
    unwritten: u64,
}

/// The records and the state with which a recording begins in a running session.
#[derive(Clone, Debug, Default)]
pub struct Opening {
    /// The state that applied before the first record.
    pub held: Latched,
    /// Records from before the recording began; commands among them do not apply to it.
    pub kept: Vec<Record>,
    /// Records that follow the command that started the recording, in the same batch.
    pub after: Vec<Record>,
}

/// How a complete recording ended.
#[derive(Debug)]
pub enum Complete {
    /// The recording ended with its session.
    WithSession,
    /// A command ended the recording, while the session continues.
    ByCommand {
        /// Records that follow the command in the same batch.
        after: Vec<Record>,
    },
}

/// A recording that ended before its session.
#[derive(Debug)]
pub struct Broken {
    /// The error that ended the recording.
    pub error: SinkError,
    /// The number of messages from the last second that may be missing from the bag, as the disk did not take them; 0
    /// if the bag could be finished.
    pub unwritten: u64,
}

/// The losses of a stream according to its last status.
#[derive(Clone, Copy)]
struct Losses {
    on_the_way: Option<u64>,
    in_our_queue: u64,
}

/// The note about a command to start a recording while one is running.
const GOES_ON: &str = "`start_recording` had no effect: a recording is already running";

/// The reason why a recording ended, if a command stopped it.
pub const STOPPED: &str = "a command stopped the recording";

impl Recording {
    /// Creates the bag for a sink.
    pub(crate) fn begin(sink: BagSink) -> Result<Recording, SinkError> {
        let BagSink { folder, study, options } = sink;
        let writer = BagWriter::create(&folder, &options).map_err(|error| {
            options.growth.end_early(error.to_string());
            failed(&error)
        })?;
        Ok(Recording {
            writer,
            growth: options.growth,
            folder,
            study,
            opening: None,
            ends_by_command: false,
            losses: BTreeMap::new(),
            flush_due: options.clock.now() + FLUSH_EVERY,
            clock: options.clock,
            last: Time::EPOCH,
            unwritten: 0,
        })
    }

    /// Lets the recording begin in a running session: at its start all streams are described, and the current state is
    /// published again, active phases with their remaining duration.
    #[must_use]
    pub fn in_session(mut self, opening: Opening) -> Recording {
        self.writer.note(JOINED_NOTE, "the session was running already".into());
        Recording { opening: Some(opening), ..self }
    }

    /// Marks this recording as the continuation of the bag `before`.
    #[must_use]
    pub fn continuing(mut self, before: &Path, held: Latched) -> Recording {
        self.writer.note(CONTINUES_NOTE, before.display().to_string());
        self.in_session(Opening { held, ..Opening::default() })
    }

    /// Lets the command `stop_recording` end the recording, too.
    #[must_use]
    pub fn until_stopped(self) -> Recording {
        Recording { ends_by_command: true, ..self }
    }

    /// Records until the inbox is closed, or recording fails. In any case the bag is finished as far as possible; if it
    /// ended early, its notes and a last event state this.
    pub fn record(mut self, inbox: &Inbox) -> Result<Complete, Broken> {
        let taken = caught(|| match self.open(inbox)? {
            Some(stopped) => Ok(stopped),
            None => self.take_all(inbox),
        });
        self.end(taken, inbox)
    }

    /// Records only the [opening](Recording::in_session), and nothing else.
    pub fn record_opening(mut self, inbox: &Inbox) -> Result<(), Broken> {
        self.writer.note(ENDED_NOTE, "it is a snapshot".into());
        let taken = caught(|| self.open(inbox).map(|_| Complete::WithSession));
        self.end(taken, inbox).map(drop)
    }

    /// Finishes the bag after everything was taken.
    fn end(
        mut self,
        taken: Result<Result<Complete, BagError>, Panic>,
        inbox: &Inbox,
    ) -> Result<Complete, Broken> {
        let (unwritten, unsynced) = (self.unwritten, self.writer.unsynced());
        let at = self.folder.display();
        let mut complete = Complete::WithSession;
        let lost = match taken {
            Ok(Ok(Complete::WithSession)) => inbox.cut_off().map(|reason| SinkError::Lost {
                message: format!("{reason}; the bag {at} ends there"),
                hint: "record to a faster disk, or record less".into(),
            }),
            Ok(Ok(by_command)) => {
                self.writer.note(ENDED_NOTE, STOPPED.into());
                complete = by_command;
                None
            }
            Ok(Err(error)) => Some(lost(&error)),
            Err(panic) => Some(SinkError::Lost {
                message: format!("record to {at}: it panicked: {panic}"),
                hint: format!("please report this bug in teampulse{}", panics::at(&panic)),
            }),
        };
        if let Some(why) = &lost {
            self.writer.note(ENDED_NOTE, format!("failed to {why}"));
            // If the reason can't be written either, the error is still reported by the sink.
            drop(caught(|| self.say_why(inbox.streams(), why)));
        }
        let (folder, growth) = (self.folder.clone(), self.growth.clone());
        let finished = caught(|| self.finish());
        let unfinished = |message: String| SinkError::Lost {
            message: format!("end the bag {}: {message}", folder.display()),
            hint: "`teampulse recover` repairs it".into(),
        };
        let finished = match finished {
            Ok(finished) => finished.map_err(|error| self::lost(&error)),
            Err(panic) => Err(unfinished(format!("it panicked: {panic}"))),
        };
        let unwritten = unwritten + if finished.is_err() { unsynced } else { 0 };
        let ended = match lost {
            Some(lost) if finished.is_err() => Err(unended(lost, &folder)),
            Some(lost) => Err(lost),
            None => finished,
        };
        ended.map(|()| complete).map_err(|error| {
            growth.end_early(error.to_string());
            Broken { error, unwritten }
        })
    }

    /// Records everything from the inbox, in portions.
    fn take_all(&mut self, inbox: &Inbox) -> Result<Complete, BagError> {
        loop {
            let left_nanos = self.flush_due.nanos_since(self.clock.now());
            let patience = Duration::from_nanos(u64::try_from(left_nanos).unwrap_or(0));
            match inbox.receive_gathered(GATHER, patience) {
                Received::Batch(batch) => {
                    if let Some(stopped) = self.take_batch(inbox, &batch)? {
                        return Ok(stopped);
                    }
                }
                Received::Silence => {}
                Received::Closed => return Ok(Complete::WithSession),
            }
            if self.clock.now() >= self.flush_due {
                self.writer.flush()?;
                self.flush_due = self.clock.now() + FLUSH_EVERY;
            }
        }
    }

    /// Records the opening.
    fn open(&mut self, inbox: &Inbox) -> Result<Option<Complete>, BagError> {
        let Some(Opening { kept, after, .. }) = &mut self.opening else { return Ok(None) };
        let (kept, after) = (std::mem::take(kept), std::mem::take(after));
        self.unwritten = kept.len() as u64;
        self.begin_with(inbox.streams(), &kept)?;
        kept.iter().try_for_each(|record| self.write(record))?;
        self.take_batch(inbox, &after)
    }

    /// Records a batch, up to a command that ends the recording.
    fn take_batch(
        &mut self,
        inbox: &Inbox,
        batch: &[Record],
    ) -> Result<Option<Complete>, BagError> {
        self.unwritten = batch.len() as u64;
        self.begin_with(inbox.streams(), batch)?;
        for (place, record) in batch.iter().enumerate() {
            let command = self.take(record)?;
            if self.ends_by_command && command == Some(Command::StopRecording) {
                self.unwritten = 0;
                let after = batch[place + 1..].to_vec();
                return Ok(Some(Complete::ByCommand { after }));
            }
            if let (true, Some(Command::StartRecording), Some(outlet)) =
                (self.ends_by_command, command, inbox.outlet())
            {
                outlet.happen(Noting::Bag.event(GOES_ON));
            }
        }
        Ok(None)
    }

    /// Writes the start of the bag: the study and, in a running session, the descriptions of its streams and the
    /// current state.
    fn begin_with(&mut self, streams: &Streams, batch: &[Record]) -> Result<(), BagError> {
        let Some(first) = batch.first() else { return Ok(()) };
        let log_time = first.sample.log_time;
        if !self.study.is_empty() {
            self.attach_study(log_time)?;
        }
        let Some(opening) = self.opening.take() else { return Ok(()) };
        let holds = opening.held.at(log_time);
        let mut at = log_time - Duration::from_nanos(holds.len() as u64);
        if let Some((id, stream)) = streams.find(&descriptions().name) {
            for (_, described) in streams.all() {
                let data = Data::Description(described);
                self.writer.write(&record((id, &stream), at, data))?;
            }
        }
        for StandingEvent { id, stream, event, device_time, source_time } in holds {
            let event = Data::Event(Arc::new(event));
            // The stamps apply to the time of the first record, which is just after `at`.
            let early = Duration::from_nanos(log_time.nanos_since(at) as u64);
            let device_time =
                device_time.map(|ticks| ticks.saturating_sub(early.as_nanos() as i64));
            let source_time = source_time.map(|stamp| stamp - early);
            let sample = Sample { device_time, source_time, ..sample(id, at, event) };
            self.writer.write(&encoded(&stream, sample))?;
            at = at + Duration::from_nanos(1);
        }
        Ok(())
    }

    /// Writes a record; if it is a command, carries it out and returns it.
    fn take(&mut self, record: &Record) -> Result<Option<Command>, BagError> {
        self.write(record)?;
        let accepted = Accepted::of(&record.stream, &record.sample.data);
        let command = accepted.map(|accepted| accepted.command);
        if command == Some(Command::Split) {
            self.writer.split(self.last)?;
        }
        Ok(command)
    }

    fn write(&mut self, record: &Record) -> Result<(), BagError> {
        if let Data::Status(status) = &record.sample.data {
            let losses = Losses { on_the_way: status.lost_source, in_our_queue: status.lost_queue };
            match self.losses.get_mut(&status.name) {
                Some(known) => *known = losses,
                None => drop(self.losses.insert(status.name.clone(), losses)),
            }
        }
        self.last = record.sample.log_time;
        self.writer.write(record)?;
        self.unwritten -= 1;
        Ok(())
    }

    /// Records the reason for the early end as an event after the last message, only in the bag.
    fn say_why(&mut self, streams: &Streams, why: &SinkError) -> Result<(), BagError> {
        let (id, stream) = streams
            .find(&session_events().name)
            .unwrap_or_else(|| (StreamId(streams.all().len() as u32), Arc::new(session_events())));
        let event = lasting(format!("bag: failed to {why}"));
        let log_time = self.last + Duration::from_nanos(1);
        self.writer.write(&record((id, &stream), log_time, Data::Event(Arc::new(event))))
    }

    fn attach_study(&mut self, log_time: Time) -> Result<(), BagError> {
        let study = std::mem::take(&mut self.study);
        self.writer.attach(Attachment {
            name: STUDY_NAME,
            media_type: "application/toml",
            log_time,
            bytes: study.as_bytes(),
        })
    }

    fn finish(mut self) -> Result<(), BagError> {
        for (stream, losses) in &self.losses {
            let on_the_way = losses.on_the_way.map_or("unknown".into(), |lost| lost.to_string());
            self.writer.note(&format!("lost_source:{stream}"), on_the_way);
            self.writer.note(&format!("lost_queue:{stream}"), losses.in_our_queue.to_string());
        }
        self.writer.finish().map(drop)
    }
}

/// Creates a record that the recording itself adds.
fn record((id, stream): (StreamId, &Arc<Stream>), log_time: Time, data: Data) -> Record {
    encoded(stream, sample(id, log_time, data))
}

fn encoded(stream: &Arc<Stream>, sample: Sample) -> Record {
    let cdr = encode(&sample);
    Record { stream: Arc::clone(stream), sample, cdr }
}

fn sample(id: StreamId, log_time: Time, data: Data) -> Sample {
    Sample {
        stream: id,
        measured: log_time,
        log_time,
        device_time: None,
        source_time: None,
        period_ns: 0.0,
        index: 0,
        turn: Turn::OnTime,
        data,
    }
}

/// Extends an error for a bag that could not be finished either: it has no index, and its `metadata.yaml` is as at its
/// start.
fn unended(lost: SinkError, folder: &Path) -> SinkError {
    let (SinkError::Lost { message, hint } | SinkError::Failed { message, hint }) = lost;
    if !folder.exists() {
        return SinkError::Lost { message, hint };
    }
    let at = folder.display();
    let message =
        format!("{message}; its end can't be written either: `teampulse recover {at}` repairs it");
    SinkError::Lost { message, hint }
}

/// The error of a recording that never started.
fn failed(error: &BagError) -> SinkError {
    SinkError::Failed { message: error.to_string(), hint: error.hint().to_owned() }
}

/// The error of a recording that ended before its session.
fn lost(error: &BagError) -> SinkError {
    SinkError::Lost { message: error.to_string(), hint: error.hint().to_owned() }
}
