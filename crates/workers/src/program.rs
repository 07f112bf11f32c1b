//! A user-supplied program as a worker: it reads records as lines of JSON and answers each line with readings.

mod answer;
mod offers;
mod question;

use std::ops::RangeInclusive;
use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::clock::Stopwatch;
use teampulse_core::command::{Command, Instruction};
use teampulse_core::outlet::Outlet;
use teampulse_core::pattern::Pattern;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sink::Wants;
use teampulse_core::time::Time;
use teampulse_core::worker::{Fed, Feed, Worker, WorkerError};

use answer::AnswerError;
use offers::{Declared, Offer};
use question::Questions;

use crate::WorkerContext;
use crate::child::{self, Answer, Child, Ended, LONGEST_LINE};

/// The interval at which the end of the session is checked for while the program runs.
const LOOK: Duration = Duration::from_millis(50);

/// How long a program may have been busy at the end of the session to be given time to exit by itself.
const BUSY: Duration = Duration::from_secs(1);

const ONE_LINE_EACH: &str = "write one line for each line read: a JSON array of readings, which may be empty; \
     missing values are `null`, and messages go to standard error";

/// Runs your own program, in any language: a model, a score, a rule. It reads the new records of its streams as a line
/// of JSON, and answers with a line of JSON that contains its readings.
///
/// A program that exits or does not answer in time is restarted. A slow program gets the newest record of each stream
/// next; skipped records are counted.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Program {
    /// The program and its arguments: `["python3", "attention.py"]`.
    pub command: Vec<String>,
    /// The streams that the program reads, by name; `*` matches a part of a token.
    #[serde(default)]
    pub streams: Vec<Pattern>,
    /// The streams of which the program reads every record, not only the newest; a score that counts events needs this.
    /// At most 64 MiB are queued for it.
    #[serde(default)]
    pub keeps: Vec<Pattern>,
    /// The streams on which the program publishes readings.
    #[serde(default)]
    pub offers: Vec<Offer>,
    /// The name under which the program accepts commands: it reads the request of `do NAME REQUEST`. Without a name it
    /// accepts none.
    #[serde(default)]
    pub name: Option<String>,
    /// How long the program may take to answer [s].
    #[serde(default = "patience_secs")]
    pub patience_secs: f64,
}

fn patience_secs() -> f64 {
    30.0
}

impl Component<dyn Worker, WorkerContext> for Program {
    const EXAMPLE: &'static str = r#"
command = ["sh", "-c", "while read -r line; do echo '[]'; done"]
streams = ["/humans/persons/p001/**"]
offers  = [{ name = "/humans/persons/p001/own/attention", person = "p001", channels = [{ name = "attention", unit = "1" }] }]
"#;

    fn build(self, _: &WorkerContext) -> Result<Box<dyn Worker>, SettingsError> {
        let Some(program) = self.command.first().filter(|program| !program.is_empty()) else {
            let error = SettingsError::new("the command is empty").at("command");
            return Err(error
                .with_hint("give the program and its arguments: [\"python3\", \"attention.py\"]"));
        };
        if !child::is_installed(program) {
            let error =
                SettingsError::new(format!("the program `{program}` was not found")).at("command");
            return Err(error.with_hint("install it, or give its path"));
        }
        if self.streams.is_empty() && self.name.is_none() {
            let error = SettingsError::new("no stream is selected").at("streams");
            return Err(error.with_hint("name streams, such as \"/robot*/odom\""));
        }
        for (place, pattern) in self.streams.iter().enumerate() {
            if self.offers.iter().any(|offer| offer.name == pattern.text()) {
                let message = format!("it reads {}, which it offers itself", pattern.text());
                let error = SettingsError::new(message).at(format!("streams.{place}"));
                return Err(error.with_hint("name the streams that it computes from"));
            }
        }
        if !(self.patience_secs > 0.0 && self.patience_secs <= 3600.0) {
            let message = format!("a time limit of {} s is invalid", self.patience_secs);
            let error = SettingsError::new(message).at("patience_secs");
            return Err(error.with_hint("the time limit must be above 0 s and at most an hour"));
        }
        for (place, offer) in self.offers.iter().enumerate() {
            offer.check().map_err(|error| {
                let path = format!("offers.{place}.{}", error.path);
                error.at(path.trim_end_matches('.'))
            })?;
            if self.offers[..place].iter().any(|earlier| earlier.name == offer.name) {
                let message = format!("{} is offered twice", offer.name);
                return Err(SettingsError::new(message).at(format!("offers.{place}.name")));
            }
        }
        Ok(Box::new(self))
    }
}

impl Worker for Program {
    fn wants(&self) -> Wants {
        let (patterns, own) = (self.streams.clone(), self.offers.clone());
        Wants::Only(Box::new(move |stream| {
            let is_own = own.iter().any(|offer| offer.name == stream.name);
            !is_own && patterns.iter().any(|pattern| pattern.matches(&stream.name))
        }))
    }

    fn keeps(&self) -> Wants {
        let patterns = self.keeps.clone();
        Wants::Only(Box::new(move |stream| patterns.iter().any(|it| it.matches(&stream.name))))
    }

    fn carries_out(&self) -> Box<dyn Fn(&Command) -> bool + Send> {
        let name = self.name.clone();
        Box::new(move |command| match command {
            Command::Do { component, .. } => name.as_ref() == Some(component),
            _ => false,
        })
    }

    fn run(&mut self, feed: &Feed, outlet: &Outlet) -> Result<(), WorkerError> {
        let mut declared = Declared::new(&self.offers, &self.streams, outlet);
        declared.check(outlet)?;
        let child = Child::start(&self.command, &[])?;
        let mut dialogue = Dialogue { program: self, declared, child, feed, outlet, hangs: false };
        let mut questions = Questions::default();
        loop {
            match feed.next(LOOK) {
                Fed::Records(records) => {
                    let times = || records.iter().map(|record| record.sample.measured);
                    let Some((oldest, newest)) = times().min().zip(times().max()) else { continue };
                    dialogue.ask(oldest..=newest, questions.line(&records))?;
                }
                Fed::Command(Instruction { command: Command::Do { request, .. }, at, .. }) => {
                    dialogue.ask(at..=at, question::request(&request, at))?;
                }
                Fed::Command(_) | Fed::Silence => dialogue.check()?,
                Fed::Closed => {
                    // The session does not wait for a program that would not notice the end of its input.
                    if !dialogue.hangs {
                        dialogue.child.end();
                    }
                    return Ok(());
                }
            }
        }
    }
}

/// The exchange with a running program.
struct Dialogue<'a> {
    program: &'a Program,
    declared: Declared,
    child: Child,
    feed: &'a Feed,
    outlet: &'a Outlet,
    /// Whether the program had not answered for a long time when the session ended.
    hangs: bool,
}

impl Dialogue<'_> {
    /// Sends a line with records of these times, waits for the answer, and offers its readings.
    fn ask(&mut self, times: RangeInclusive<Time>, question: String) -> Result<(), WorkerError> {
        self.declared.check(self.outlet)?;
        if let Answer::Read(line) = self.child.read(Duration::ZERO) {
            return Err(self.unasked(&line));
        }
        self.child.write(question.into_bytes());
        let Some(answer) = self.wait()? else { return Ok(()) };
        let readings = answer::read(&answer, times, &self.declared);
        for reading in readings.map_err(|wrong| self.misunderstood(&wrong))? {
            self.outlet.offer(reading);
        }
        Ok(())
    }

    /// Waits for the program's next line; `None` if the session ends first.
    fn wait(&mut self) -> Result<Option<String>, WorkerError> {
        let patience = Duration::from_secs_f64(self.program.patience_secs);
        let began = Stopwatch::start();
        loop {
            match self.child.read(LOOK) {
                Answer::Read(line) => return Ok(Some(line)),
                Answer::TooLong => return Err(self.too_long()),
                Answer::Ended(ended) => return Err(self.stopped(&ended)),
                Answer::None if self.feed.is_closed() => {
                    self.hangs = began.elapsed() >= BUSY;
                    return Ok(None);
                }
                Answer::None if began.elapsed() >= patience => return Err(self.too_slow()),
                Answer::None => {}
            }
        }
    }

    /// Fails if the program has exited although its input is open, or if another publisher uses one of its stream
    /// names.
    fn check(&mut self) -> Result<(), WorkerError> {
        self.declared.check(self.outlet)?;
        self.child.check().map_err(|ended| self.stopped(&ended))
    }

    fn unasked(&self, line: &str) -> WorkerError {
        let start: String = line.chars().take(60).collect();
        let message = format!(
            "match the answers from `{}` to its input: it wrote more lines than it read, beginning with: {start}",
            self.shown()
        );
        WorkerError { message, hint: ONE_LINE_EACH.into() }
    }

    fn too_long(&self) -> WorkerError {
        let mib = LONGEST_LINE >> 20;
        let message =
            format!("read an answer from `{}`: it is longer than {mib} MiB", self.shown());
        WorkerError { message, hint: "answer with fewer readings at a time".into() }
    }

    fn misunderstood(&self, wrong: &AnswerError) -> WorkerError {
        let message = format!("understand the answer from `{}`: {wrong}", self.shown());
        WorkerError { message, hint: ONE_LINE_EACH.into() }
    }

    fn too_slow(&self) -> WorkerError {
        let patience_secs = self.program.patience_secs;
        let message = format!("get an answer from `{}` within {patience_secs} s", self.shown());
        let hint = "the program must flush its output; if it is slow, raise `patience_secs`".into();
        WorkerError { message, hint }
    }

    fn stopped(&self, ended: &Ended) -> WorkerError {
        let Ended { status, last_words } = ended;
        let said = if last_words.is_empty() { String::new() } else { format!(": {last_words}") };
        let message = format!("continue: `{}` ended with {status}{said}", self.shown());
        WorkerError { message, hint: "run the command by hand".into() }
    }

    fn shown(&self) -> String {
        self.program.command.join(" ")
    }
}
