//! Commands: what people and programs ask of a running session.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use crate::data::{Data, Event, EventKind};
use crate::session_streams::session_events;
use crate::stream::Stream;

/// The longest text of a command [bytes].
const LONGEST: usize = 1000;
/// The longest vibration that can be asked for [s].
const LONGEST_VIBRATION_SECS: f64 = 10.0;
/// How long a vibration lasts when its length is left out [s].
const VIBRATION_SECS: f64 = 0.5;

/// A request to the session or to one of its running components.
///
/// Everywhere a command is written the same way, a verb and its argument: `next_phase`,
/// `mark robot lost`, `vibrate p001 0.5`.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// `stop`: ends the session.
    Stop,
    /// `split`: begins the next file of the bag.
    Split,
    /// `next_phase`: begins the next phase of the study; those after it move with it.
    NextPhase,
    /// `repeat_phase`: begins the current phase, or the last one, anew.
    RepeatPhase,
    /// `abort_phase`: ends the current phase; the next one begins by command.
    AbortPhase,
    /// `mark LABEL`: sets a marker.
    Mark(String),
    /// `vibrate SUBJECT [SECS]`: lets what a person wears vibrate.
    Vibrate {
        /// Who wears it: `p001`.
        subject: String,
        /// For how long [s].
        secs: f64,
    },
}

/// Every verb with its arguments and what it does, as documentation shows them.
pub const VERBS: [(&str, &str, &str); 7] = [
    ("stop", "", "ends the session"),
    ("split", "", "begins the next file of the bag"),
    ("next_phase", "", "begins the next phase of the study"),
    ("repeat_phase", "", "begins the current phase anew"),
    ("abort_phase", "", "ends the current phase"),
    ("mark", "LABEL", "sets a marker"),
    ("vibrate", "SUBJECT [SECS]", "lets what a person wears vibrate"),
];

impl Command {
    /// Its verb.
    pub fn verb(&self) -> &'static str {
        match self {
            Command::Stop => "stop",
            Command::Split => "split",
            Command::NextPhase => "next_phase",
            Command::RepeatPhase => "repeat_phase",
            Command::AbortPhase => "abort_phase",
            Command::Mark(_) => "mark",
            Command::Vibrate { .. } => "vibrate",
        }
    }
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.verb())?;
        match self {
            Command::Mark(label) => write!(f, " {label}"),
            Command::Vibrate { subject, secs } => write!(f, " {subject} {secs}"),
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
            "next_phase" => Command::NextPhase,
            "repeat_phase" => Command::RepeatPhase,
            "abort_phase" => Command::AbortPhase,
            "mark" if !argument.is_empty() => return Ok(Command::Mark(argument.to_owned())),
            "vibrate" => return vibration(argument),
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
    let expected = "who wears the device, and seconds up to 10: `vibrate p001 0.5`";
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

/// Why a text is not a command. The message fits after "failed to".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum CommandError {
    /// Its verb is not one of [`VERBS`].
    #[error(
        "read a command: there is no `{verb}`; expected stop, split, next_phase, repeat_phase, \
         abort_phase, mark or vibrate"
    )]
    Unknown {
        /// The verb.
        verb: String,
    },
    /// What follows the verb is wrong.
    #[error("read the command `{verb}`: expected {expected}")]
    Argument {
        /// The verb.
        verb: &'static str,
        /// What should follow it.
        expected: &'static str,
    },
    /// It is too long.
    #[error("read a command of {bytes} bytes: expected 1000 at most")]
    Long {
        /// Its length [bytes].
        bytes: usize,
    },
}

/// Who sent a command.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sender {
    /// The person at the keys of the terminal.
    Keys,
    /// A node on ROS, by its full name: `/operator_panel`.
    Ros(String),
}

impl Sender {
    /// The setting below `[commands]` that allows commands from there.
    pub fn setting(&self) -> &'static str {
        match self {
            Sender::Keys => "keys",
            Sender::Ros(_) => "ros",
        }
    }

    fn from_word(word: &str) -> Option<Sender> {
        match word.split_once(':') {
            None if word == "keys" => Some(Sender::Keys),
            Some(("ros", node)) => Some(Sender::Ros(node.to_owned())),
            _ => None,
        }
    }
}

impl fmt::Display for Sender {
    /// One word without spaces: `keys`, `ros:/operator_panel`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Sender::Keys => f.write_str("keys"),
            Sender::Ros(node) => write!(f, "ros:{}", node.replace(char::is_whitespace, "_")),
        }
    }
}

/// A command that was accepted, and who sent it: an event of the kind `command` on `/session/events`,
/// whose label is the sender and the command, `ros:/operator_panel next_phase`.
#[derive(Clone, Debug, PartialEq)]
pub struct Accepted {
    /// Who sent it.
    pub sender: Sender,
    /// What was asked for.
    pub command: Command,
}

impl Accepted {
    /// The event that records it.
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

    fn each() -> [Command; 7] {
        [
            Command::Stop,
            Command::Split,
            Command::NextPhase,
            Command::RepeatPhase,
            Command::AbortPhase,
            Command::Mark("robot 2 lost".into()),
            Command::Vibrate { subject: "p001".into(), secs: 0.25 },
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
        for wrong in ["", "halt", "mark", "mark ", "stop now", "vibrate", "vibrate p001 -1", &long]
        {
            let error = wrong.parse::<Command>().unwrap_err().to_string();
            assert!(error.contains("expected") && error.len() < 300, "{wrong:.20}: {error}");
        }
        assert!("vibrate p001 nan".parse::<Command>().is_err());
        assert!("vibrate p001 1 2".parse::<Command>().is_err());
    }

    #[test]
    fn the_event_of_a_command_says_who_sent_it() {
        for sender in [Sender::Keys, Sender::Ros("/panel".into())] {
            for command in each() {
                let accepted = Accepted { sender: sender.clone(), command };
                assert_eq!(Accepted::read(&accepted.event()), Some(accepted));
            }
        }
        let odd = Accepted { sender: Sender::Ros("/a b".into()), command: Command::Stop };
        assert_eq!(odd.event().label, "ros:/a_b stop");
    }
}
