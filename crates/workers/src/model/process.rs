//! The session's end of the process that runs models.

use std::path::Path;
use std::time::Duration;

use bytes::Bytes;
use teampulse_core::clock::Stopwatch;
use teampulse_core::text::{LONGEST_LABEL, label};
use teampulse_core::worker::{Feed, WorkerError};

use super::Model;
use super::serve::COMMAND;
use super::wire::{Announced, Reply};
use crate::child::{Answer, Child, Ended};

/// How often the end of the session is checked for while a model works.
const LOOK: Duration = Duration::from_millis(50);
/// The last line of a process that asks for too much memory says so, instead of the last function that it was in.
const SHORT: (&str, &str) = ("RUST_BACKTRACE", "0");
/// This program, also after its file was replaced.
const ITSELF: &str = "/proc/self/exe";

/// A process that runs models. Dropping it ends it.
pub(super) struct Process<'a> {
    child: Child,
    feed: &'a Feed,
    patience: Duration,
    memory_mib: u64,
    engine: String,
}

/// What came of a picture.
pub(super) enum Seen {
    /// The numbers of each model.
    Numbers(Vec<Vec<f64>>),
    /// Why it can't be decoded.
    Unreadable(String),
}

impl<'a> Process<'a> {
    /// Starts the process, and waits until its models are loaded; `None` if the session ends first.
    pub(super) fn start(
        settings: &Model,
        feed: &'a Feed,
    ) -> Result<Option<Process<'a>>, WorkerError> {
        let child = Child::start(&command(settings), &[SHORT])?;
        let patience = Duration::from_secs_f64(settings.patience_secs);
        let (engine, memory_mib) = (String::new(), settings.memory_mib);
        let mut process = Process { child, feed, patience, memory_mib, engine };
        match process.reply("load the models")? {
            None => Ok(None),
            Some(Reply::Ready { engine }) => {
                process.engine = engine;
                Ok(Some(process))
            }
            Some(other) => Err(unexpected(&other)),
        }
    }

    /// What runs the models.
    pub(super) fn engine(&self) -> &str {
        &self.engine
    }

    /// Has the models look at the picture in a message; `None` if the session ends first.
    pub(super) fn look(
        &mut self,
        type_name: &str,
        message: &Bytes,
    ) -> Result<Option<Seen>, WorkerError> {
        let announced = Announced { type_name: type_name.to_owned(), bytes: message.len() };
        let mut question = serde_json::to_vec(&announced).unwrap_or_default();
        question.push(b'\n');
        question.extend_from_slice(message);
        self.child.write(question);
        let number = |number: Option<f64>| number.unwrap_or(f64::NAN);
        match self.reply("look at a frame")? {
            None => Ok(None),
            Some(Reply::Seen(numbers)) => {
                let numbers =
                    numbers.into_iter().map(|each| each.into_iter().map(number).collect());
                Ok(Some(Seen::Numbers(numbers.collect())))
            }
            Some(Reply::Unreadable(why)) => Ok(Some(Seen::Unreadable(why))),
            Some(other) => Err(unexpected(&other)),
        }
    }

    /// Fails if the process has ended.
    pub(super) fn check(&mut self) -> Result<(), WorkerError> {
        self.child.check().map_err(|ended| self.ended(&ended))
    }

    /// Ends the process.
    pub(super) fn end(&mut self) {
        self.child.end();
    }

    /// The next reply; `None` if the session ends first.
    fn reply(&mut self, what: &str) -> Result<Option<Reply>, WorkerError> {
        let began = Stopwatch::start();
        loop {
            match self.child.read(LOOK) {
                Answer::Read(line) => return understood(&line).map(Some),
                Answer::TooLong => return Err(failed("read an answer of a model: too long", "")),
                Answer::Ended(ended) => return Err(self.ended(&ended)),
                Answer::None if self.feed.is_closed() => return Ok(None),
                Answer::None if began.elapsed() >= self.patience => {
                    let message = format!("{what} within {} s", self.patience.as_secs_f64());
                    return Err(failed(
                        &message,
                        "if the model is that slow, raise `patience_secs`",
                    ));
                }
                Answer::None => {}
            }
        }
    }

    fn ended(&self, ended: &Ended) -> WorkerError {
        let Ended { status, last_words } = ended;
        let said = if last_words.is_empty() { String::new() } else { format!(": {last_words}") };
        let message = format!("run the models: their process ended with {status}{said}");
        let mib = self.memory_mib;
        failed(&message, &format!("they may have {mib} MiB of memory (`memory_mib`)"))
    }
}

fn understood(line: &str) -> Result<Reply, WorkerError> {
    match serde_json::from_str(line) {
        Ok(Reply::Failed(why)) => {
            Err(failed(&label(why, LONGEST_LABEL), "`teampulse models verify` says more"))
        }
        Ok(reply) => Ok(reply),
        Err(error) => Err(failed(&format!("read an answer of a model: {error}"), "")),
    }
}

fn unexpected(reply: &Reply) -> WorkerError {
    let reply = label(format!("{reply:?}"), 60);
    failed(&format!("understand the process of the models: it answered {reply}"), "")
}

fn failed(message: &str, hint: &str) -> WorkerError {
    WorkerError { message: message.to_owned(), hint: hint.to_owned() }
}

/// The command that runs models: this program itself.
fn command(settings: &Model) -> Vec<String> {
    let program = std::env::current_exe().ok().filter(|path| path.exists());
    let program = program.as_deref().unwrap_or(Path::new(ITSELF));
    let mut command = vec![program.display().to_string(), COMMAND.to_owned()];
    command.extend(["--memory-mib".to_owned(), settings.memory_mib.to_string()]);
    if let Some(library) = &settings.onnx_runtime {
        command.extend(["--onnx-runtime".to_owned(), library.display().to_string()]);
    }
    command.push("--".to_owned());
    command.extend(settings.descriptors.iter().map(|path| path.display().to_string()));
    command
}
