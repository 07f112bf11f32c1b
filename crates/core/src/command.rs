//! Commands: requests of people and programs to a running session.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use crate::data::{Data, Event, EventKind};
use crate::session_streams::session_events;
use crate::stream::Stream;
use crate::time::Time;

/// The longest text of a command [bytes].
const LONGEST: usize = 1000;
/// The longest vibration that can be requested [s].
const LONGEST_VIBRATION_SECS: f64 = 10.0;
/// How long a vibration lasts by default [s].
const VIBRATION_SECS: f64 = 0.5;

/// A request to the session or to one of its running components.
///
/// A command is written the same way everywhere, as a verb and its argument: `next_phase`,
/// `mark robot lost`, `vibrate p001 0.5`.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// `stop`: ends the session.
    Stop,
    /// `split`: starts the next file of the bag.
    Split,
    /// `start_recording`: starts a bag, including the last seconds before the command.
    StartRecording,
    /// `stop_recording`: ends the bag; the session continues.
    StopRecording,
    /// `snapshot`: writes the last seconds, which are buffered while nothing is recorded, to a bag.
    Snapshot,
    /// `next_phase`: starts the next phase of the study; the phases after it shift accordingly.
    NextPhase,
    /// `repeat_phase`: restarts the current phase, or the last one.
    RepeatPhase,
    /// `abort_phase`: ends the current phase; the next one starts on command.
    AbortPhase,
    /// `mark LABEL`: sets a marker.
    Mark(String),
    /// `vibrate SUBJECT [SECS]`: vibrates a device that a person wears.
    Vibrate {
        /// The person who wears the device: `p001`.
        subject: String,
        /// How long the device vibrates [s].
        secs: f64,
    },
    /// `do COMPONENT REQUEST`: sends a request to a component of the session: `do nback start 2`.
    Do {
        /// The name of the component in commands: `nback`.
        component: String,
        /// The request, in words that the component understands; may be empty.
        request: String,
    },
}

/// Every verb with its arguments and what it does, as shown in documentation.
pub const VERBS: [(&str, &str, &str); 11] = [
    ("stop", "", "ends the session"),
    ("split", "", "starts the next file of the bag"),
    ("start_recording", "", "starts a bag, including the last seconds before the command"),
    ("stop_recording", "", "ends the bag; the session continues"),
    (
        "snapshot",
        "",
        "writes the last seconds, which are buffered while nothing is recorded, to a bag",
    ),
    ("next_phase", "", "starts the next phase of the study"),
    ("repeat_phase", "", "restarts the current phase"),
    ("abort_phase", "", "ends the current phase"),
    ("mark", "LABEL", "sets a marker"),
    ("vibrate", "SUBJECT [SECS]", "vibrates a device that a person wears"),
    ("do", "COMPONENT REQUEST", "sends a request to a component"),
];

impl Command {
    /// The command's verb.
    pub fn verb(&self) -> &'static str {
        match self {
            Command::Stop => "stop",
            Command::Split => "split",
            Command::StartRecording => "start_recording",
            Command::StopRecording => "stop_recording",
            Command::Snapshot => "snapshot",
            Command::NextPhase => "next_phase",
            Command::RepeatPhase => "repeat_phase",
            Command::AbortPhase => "abort_phase",
            Command::Mark(_) => "mark",
            Command::Vibrate { .. } => "vibrate",
            Command::Do { .. } => "do",
        }
    }
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.verb())?;
        match self {
            Command::Mark(label) => write!(f, " {label}"),
            Command::Vibrate { subject, secs } => write!(f, " {subject} {secs}"),
            Command::Do { component, request } if request.is_empty() => write!(f, " {component}"),
            Command::Do { component, request } => write!(f, " {component} {request}"),
            _ => Ok(()),
        }
    }
}

impl FromStr for Command {
    type Err = CommandError;

    fn from_str(text: &str) -> Result<Command, CommandError> {
        let text = text.trim();
        if text.len() > LONGEST {
            return Err(CommandError::Long { bytes: text.len() });
        }
        let (verb, argument) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let argument = argument.trim();
        let command = match verb {
            "stop" => Command::Stop,
            "split" => Command::Split,
            "start_recording" => Command::StartRecording,
            "stop_recording" => Command::StopRecording,
            "snapshot" => Command::Snapshot,
            "next_phase" => Command::NextPhase,
            "repeat_phase" => Command::RepeatPhase,
            "abort_phase" => Command::AbortPhase,
            "mark" if !argument.is_empty() => return Ok(Command::Mark(argument.to_owned())),
            "vibrate" => return vibration(argument),
            "do" => return request(argument),
            "mark" => return Err(CommandError::Argument { verb: "mark", expected: "a label" }),
            _ => return Err(CommandError::Unknown { verb: verb.chars().take(40).collect() }),
        };
        if argument.is_empty() {
            Ok(command)
        } else {
            let expected = "no argument";
            Err(CommandError::Argument { verb: command.verb(), expected })
        }
    }
}

fn vibration(argument: &str) -> Result<Command, CommandError> {
    let expected = "the wearer of the device, and a duration up to 10 s: `vibrate p001 0.5`";
    let wrong = CommandError::Argument { verb: "vibrate", expected };
    let mut words = argument.split_whitespace();
    let (subject, secs) = (words.next(), words.next());
    let secs = secs.map_or(Ok(VIBRATION_SECS), str::parse);
    match (subject, secs, words.next()) {
        (Some(subject), Ok(secs), None) if secs > 0.0 && secs <= LONGEST_VIBRATION_SECS => {
            Ok(Command::Vibrate { subject: subject.to_owned(), secs })
        }
        _ => Err(wrong),
    }
}

fn request(argument: &str) -> Result<Command, CommandError> {
    let (component, request) = argument.split_once(char::is_whitespace).unwrap_or((argument, ""));
    if !is_token(component) {
        let expected = "a component and a request: `do nback start`";
        return Err(CommandError::Argument { verb: "do", expected });
    }
    Ok(Command::Do { component: component.to_owned(), request: request.trim().to_owned() })
}

/// Whether a text can be the name of a component in a study, such as `nback`.
fn is_token(text: &str) -> bool {
    let is_part = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    text.starts_with(|first: char| first.is_ascii_lowercase()) && text.chars().all(is_part)
}

/// Why a text is not a command. The message fits after "failed to".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum CommandError {
    /// The verb is not one of [`VERBS`].
    #[error(
        "read a command: there is no `{verb}`; expected stop, split, start_recording, stop_recording, \
         snapshot, next_phase, repeat_phase, abort_phase, mark, vibrate or do"
    )]
    Unknown {
        /// The verb.
        verb: String,
    },
    /// The argument of the verb is wrong.
    #[error("read the command `{verb}`: expected {expected}")]
    Argument {
        /// The verb.
        verb: &'static str,
        /// The expected argument.
        expected: &'static str,
    },
    /// The text is too long.
    #[error("read a command of {bytes} bytes: expected at most 1000")]
    Long {
        /// The length of the text [bytes].
        bytes: usize,
    },
}

/// Who sent a command: a person or a program, through a component of the session.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Sender {
    component: String,
    name: String,
}

impl Sender {
    /// Someone who presses keys in the terminal.
    pub fn keys() -> Sender {
        Sender::through("keys", "")
    }

    /// A node on ROS, by its full name: `/operator_panel`.
    pub fn ros(node: &str) -> Sender {
        Sender::through("ros", node)
    }

    /// A sender behind a component, such as the client `tablet` of the `dashboard`; the name may be empty. `component`
    /// is also the name of the setting below `[commands]`.
    pub fn through(component: &str, name: &str) -> Sender {
        let name = name.replace(|c: char| c.is_whitespace() || c.is_control(), "_");
        Sender { component: component.to_owned(), name }
    }

    /// The setting below `[commands]` that allows commands from this sender.
    pub fn setting(&self) -> &str {
        &self.component
    }

    fn from_word(word: &str) -> Option<Sender> {
        let (component, name) = word.split_once(':').unwrap_or((word, ""));
        is_token(component).then(|| Sender::through(component, name))
    }
}

impl fmt::Display for Sender {
    /// Formats the sender as one word without spaces: `keys`, `ros:/operator_panel`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.component)?;
        if self.name.is_empty() { Ok(()) } else { write!(f, ":{}", self.name) }
    }
}

/// A command as delivered to the component that carries it out.
#[derive(Clone, Debug, PartialEq)]
pub struct Instruction {
    /// Who sent the command.
    pub sender: Sender,
    /// The command.
    pub command: Command,
    /// When the command was given, by the session's clock: when a key or a button was pressed, which may be earlier
    /// than now.
    pub at: Time,
}

/// A command that was accepted, and who sent it. It is recorded as an event of the kind `command` on `/session/events`,
/// whose label is the sender and the command: `ros:/operator_panel next_phase`.
#[derive(Clone, Debug, PartialEq)]
pub struct Accepted {
    /// Who sent the command.
    pub sender: Sender,
    /// The command.
    pub command: Command,
}

impl Accepted {
    /// The event that records the command.
    pub fn event(&self) -> Event {
        let label = format!("{} {}", self.sender, self.command);
        Event { kind: EventKind::Command, label, value: f64::NAN, duration_secs: 0.0 }
    }

    /// The command that a sample records; `None` for any other sample.
    pub fn of(stream: &Stream, data: &Data) -> Option<Accepted> {
        match data {
            Data::Event(event) if stream.name == session_events().name => Accepted::read(event),
            _ => None,
        }
    }

    /// The command that an event of the session records.
    pub fn read(event: &Event) -> Option<Accepted> {
        if event.kind != EventKind::Command {
            return None;
        }
        let (sender, command) = event.label.split_once(' ')?;
        Some(Accepted { sender: Sender::from_word(sender)?, command: command.parse().ok()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn each() -> [Command; 11] {
        [
            Command::Stop,
            Command::Split,
            Command::StartRecording,
            Command::StopRecording,
            Command::Snapshot,
            Command::NextPhase,
            Command::RepeatPhase,
            Command::AbortPhase,
            Command::Mark("robot 2 lost".into()),
            Command::Vibrate { subject: "p001".into(), secs: 0.25 },
            Command::Do { component: "nback".into(), request: "start 2".into() },
        ]
    }

    #[test]
    fn a_command_reads_as_it_is_written_and_every_verb_is_documented() {
        for command in each() {
            assert_eq!(command.to_string().parse(), Ok(command));
        }
        assert_eq!(VERBS.map(|(verb, _, _)| verb), each().map(|command| command.verb()));
        assert_eq!(
            "vibrate p001".parse(),
            Ok(Command::Vibrate { subject: "p001".into(), secs: 0.5 })
        );
    }

    #[test]
    fn what_is_no_command_is_refused_with_what_was_expected() {
        let long = "x".repeat(100_000);
        let wrong = [
            "",
            "halt",
            "mark",
            "mark ",
            "stop now",
            "vibrate",
            "vibrate p001 -1",
            "do",
            "do ?",
            &long,
        ];
        for wrong in wrong {
            let error = wrong.parse::<Command>().unwrap_err().to_string();
            assert!(error.contains("expected") && error.len() < 300, "{wrong:.20}: {error}");
        }
        assert!("vibrate p001 nan".parse::<Command>().is_err());
        assert!("vibrate p001 1 2".parse::<Command>().is_err());
    }

    #[test]
    fn the_event_of_a_command_says_who_sent_it() {
        for sender in
            [Sender::keys(), Sender::ros("/panel"), Sender::through("dashboard", "tablet")]
        {
            for command in each() {
                let accepted = Accepted { sender: sender.clone(), command };
                assert_eq!(Accepted::read(&accepted.event()), Some(accepted));
            }
        }
        let odd = Accepted { sender: Sender::ros("/a b"), command: Command::Stop };
        assert_eq!(odd.event().label, "ros:/a_b stop");
    }
}
