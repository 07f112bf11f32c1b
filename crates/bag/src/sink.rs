//! The bag as a sink: everything that the pump gives, onto the disk.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use teampulse_core::clock::Clock;
use teampulse_core::data::Data;
use teampulse_core::sample::Record;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};
use teampulse_core::time::Time;

use crate::error::BagError;
use crate::write::part::Attachment;
use crate::write::{BagWriter, Options};

/// How often what was written is handed to the disk: with the writing itself, not more than a
/// second of a recording can be lost.
const FLUSH_EVERY: Duration = Duration::from_millis(800);
/// The name under which the study is attached.
pub const STUDY_NAME: &str = "study.toml";

/// Records a session into a bag.
#[derive(Clone, Debug)]
pub struct BagSink {
    /// The bag's folder; it must not exist yet.
    pub folder: PathBuf,
    /// The study's text, attached to the bag; may be empty.
    pub study: String,
    /// How the bag is written.
    pub options: Options,
}

impl Sink for BagSink {
    fn name(&self) -> &'static str {
        "bag"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let writer =
            BagWriter::create(&self.folder, &self.options).map_err(|error| failed(&error))?;
        let clock = Clock::host();
        let flush_due = clock.now() + FLUSH_EVERY;
        let mut recording =
            Recording { writer, study: self.study, losses: BTreeMap::new(), clock, flush_due };
        let recorded = recording.take_all(&inbox);
        let finished = recording.finish();
        recorded.and(finished).map_err(|error| lost(&error))
    }
}

struct Recording {
    writer: BagWriter,
    /// What is still to be attached.
    study: String,
    losses: BTreeMap<String, Losses>,
    clock: Clock,
    flush_due: Time,
}

/// What was lost of a stream, as its last status told.
#[derive(Clone, Copy)]
struct Losses {
    on_the_way: Option<u64>,
    in_our_queue: u64,
}

impl Recording {
    /// Records until the inbox is closed.
    fn take_all(&mut self, inbox: &Inbox) -> Result<(), BagError> {
        loop {
            let left_nanos = self.flush_due.nanos_since(self.clock.now());
            let patience = Duration::from_nanos(u64::try_from(left_nanos).unwrap_or(0));
            match inbox.receive(patience) {
                Received::Batch(batch) => batch.iter().try_for_each(|record| self.take(record))?,
                Received::Silence => {}
                Received::Closed => return Ok(()),
            }
            if self.clock.now() >= self.flush_due {
                self.writer.flush()?;
                self.flush_due = self.clock.now() + FLUSH_EVERY;
            }
        }
    }

    fn take(&mut self, record: &Record) -> Result<(), BagError> {
        if !self.study.is_empty() {
            self.attach_study(record.sample.log_time)?;
        }
        if let Data::Status(status) = &record.sample.data {
            let losses = Losses { on_the_way: status.lost_source, in_our_queue: status.lost_queue };
            match self.losses.get_mut(&status.name) {
                Some(known) => *known = losses,
                None => drop(self.losses.insert(status.name.clone(), losses)),
            }
        }
        self.writer.write(record)
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

/// Nothing was recorded.
fn failed(error: &BagError) -> SinkError {
    SinkError::Failed { message: error.to_string(), hint: error.hint().to_owned() }
}

/// The recording ended before its session.
fn lost(error: &BagError) -> SinkError {
    SinkError::Lost { message: error.to_string(), hint: error.hint().to_owned() }
}
