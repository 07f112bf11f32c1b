//! The session's side of the process that runs models.

use std::path::{Path, PathBuf};
use std::time::Duration;

use bytes::Bytes;
use teampulse_core::clock::Stopwatch;
use teampulse_core::registry::SettingsError;
use teampulse_core::text::{LONGEST_LABEL, label};
use teampulse_core::worker::{Feed, WorkerError};

use super::serve::COMMAND;
use super::wire::{Announced, Reply};
use crate::child::{Answer, Child, Ended};

/// The interval at which the end of the session is checked for while a model runs.
const LOOK: Duration = Duration::from_millis(50);
/// Shortens the panic message of a process that runs out of memory, so that its last line states the reason.
const SHORT: (&str, &str) = ("RUST_BACKTRACE", "0");
/// How much address space the allocator reserves at once [KiB]: its default, 1 GiB, would count towards the memory
/// limit.
const RESERVED: (&str, &str) = ("MIMALLOC_ARENA_RESERVE", "65536");
/// Keeps the memory of one picture for the next picture.
const KEPT: (&str, &str) = ("MIMALLOC_PURGE_DELAY", "-1");
/// The path of this executable, even after its file was replaced.
const ITSELF: &str = "/proc/self/exe";

/// The models that a process runs, and its limits.
pub(crate) struct Models<'a> {
    /// The descriptors, in the order in which the models process a picture.
    pub(crate) descriptors: &'a [PathBuf],
    /// The library of an ONNX Runtime.
    pub(crate) onnx_runtime: Option<&'a Path>,
    /// How long the models may take to load, and to process a picture [s].
    pub(crate) patience_secs: f64,
    /// The memory limit of the process [MiB].
    pub(crate) memory_mib: u64,
}

/// The default time limit of models [s].
pub(crate) fn patience_secs() -> f64 {
    30.0
}

/// The default memory limit of models [MiB].
pub(crate) fn memory_mib() -> u64 {
    4096
}

impl Models<'_> {
    /// Fails if there are no models, or if the time or memory limit is out of range.
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        if self.descriptors.is_empty() {
            let error = SettingsError::new("no model is given").at("descriptors");
            return Err(error.with_hint("`teampulse models list` lists ready-made ones"));
        }
        if !(self.patience_secs > 0.0 && self.patience_secs <= 3600.0) {
            let error = SettingsError::new("the time limit must be above 0 s and at most an hour");
            return Err(error.at("patience_secs"));
        }
        if !(64..=1 << 20).contains(&self.memory_mib) {
            return Err(SettingsError::new("the memory limit must be from 64 to 1048576 MiB")
                .at("memory_mib"));
        }
        Ok(())
    }
}

/// A process that runs models, which is killed when this value is dropped.
pub(crate) struct Process<'a> {
    child: Child,
    feed: &'a Feed,
    patience: Duration,
    memory_mib: u64,
    engine: String,
}

/// The result of processing a picture.
pub(crate) enum Seen {
    /// The findings in the picture.
    Found {
        /// The values of each stream of each model.
        numbers: Vec<Vec<f64>>,
        /// All faces: left, top, width and height [px].
        faces: Vec<[f32; 4]>,
    },
    /// The picture cannot be decoded, for this reason.
    Unreadable(String),
}

impl<'a> Process<'a> {
    /// Starts the process, and waits until its models are loaded; `None` if the session ends first.
    pub(crate) fn start(
        models: &Models<'_>,
        feed: &'a Feed,
    ) -> Result<Option<Process<'a>>, WorkerError> {
        let child = Child::start(&command(models), &[SHORT, RESERVED, KEPT])?;
        let patience = Duration::from_secs_f64(models.patience_secs);
        let (engine, memory_mib) = (String::new(), models.memory_mib);
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

    /// The name of the engine that runs the models.
    pub(crate) fn engine(&self) -> &str {
        &self.engine
    }

    /// Runs the models on the picture in a message; `None` if the session ends first.
    pub(crate) fn look(
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
        match self.reply("process a frame")? {
            None => Ok(None),
            Some(Reply::Seen { numbers, faces }) => {
                let numbers =
                    numbers.into_iter().map(|each| each.into_iter().map(number).collect());
                Ok(Some(Seen::Found { numbers: numbers.collect(), faces }))
            }
            Some(Reply::Unreadable(why)) => Ok(Some(Seen::Unreadable(why))),
            Some(other) => Err(unexpected(&other)),
        }
    }

    /// Fails if the process has exited.
    pub(crate) fn check(&mut self) -> Result<(), WorkerError> {
        self.child.check().map_err(|ended| self.ended(&ended))
    }

    /// Stops the process.
    pub(crate) fn end(&mut self) {
        self.child.end();
    }

    /// Waits for the next reply; `None` if the session ends first.
    fn reply(&mut self, what: &str) -> Result<Option<Reply>, WorkerError> {
        let began = Stopwatch::start();
        loop {
            match self.child.read(LOOK) {
                Answer::Read(line) => return understood(&line).map(Some),
                Answer::TooLong => {
                    return Err(failed("read the reply of a model: it is too long", ""));
                }
                Answer::Ended(ended) => return Err(self.ended(&ended)),
                Answer::None if self.feed.is_closed() => return Ok(None),
                Answer::None if began.elapsed() >= self.patience => {
                    let message = format!("{what} within {} s", self.patience.as_secs_f64());
                    return Err(failed(
                        &message,
                        "if the model is this slow, raise `patience_secs`",
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
        failed(&message, &format!("their memory is limited to {mib} MiB (`memory_mib`)"))
    }
}

fn understood(line: &str) -> Result<Reply, WorkerError> {
    match serde_json::from_str(line) {
        Ok(Reply::Failed(why)) => {
            Err(failed(&label(why, LONGEST_LABEL), "run `teampulse models verify` for details"))
        }
        Ok(reply) => Ok(reply),
        Err(error) => Err(failed(&format!("read the reply of a model: {error}"), "")),
    }
}

fn unexpected(reply: &Reply) -> WorkerError {
    let reply = label(format!("{reply:?}"), 60);
    failed(&format!("understand the process that runs the models: it replied {reply}"), "")
}

fn failed(message: &str, hint: &str) -> WorkerError {
    WorkerError { message: message.to_owned(), hint: hint.to_owned() }
}

/// The command that runs models: this program itself.
fn command(models: &Models<'_>) -> Vec<String> {
    let program = std::env::current_exe().ok().filter(|path| path.exists());
    let program = program.as_deref().unwrap_or(Path::new(ITSELF));
    let mut command = vec![program.display().to_string(), COMMAND.to_owned()];
    command.extend(["--memory-mib".to_owned(), models.memory_mib.to_string()]);
    if let Some(library) = models.onnx_runtime {
        command.extend(["--onnx-runtime".to_owned(), library.display().to_string()]);
    }
    command.push("--".to_owned());
    command.extend(models.descriptors.iter().map(|path| path.display().to_string()));
    command
}
