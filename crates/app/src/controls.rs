//! Keyboard controls of a session: what each key of the terminal does.

use std::io::IsTerminal;

use teampulse_bag::{Growth, Stage};
use teampulse_core::clock::Clock;
use teampulse_core::command::Command;
use teampulse_core::time::Time;
use teampulse_sinks::{Scroll, View};
use teampulse_sources::session::{Key, Keys, ScheduleHandle, marker};

use crate::study::KeyCommands;

/// The question before a key ends a recording.
const END: &str = "end the recording?  y: yes, any other key: no";

/// The question before a key stops a recording.
const STOP: &str = "stop the recording (the session continues)?  y: yes, any other key: no";

/// The message when there is no paused recording to start or to save.
const NOT_PAUSED: &str =
    "nothing is paused: Ctrl-P stops a recording, and then Ctrl-K saves the last seconds";

/// The message when there is no next phase.
const NO_PHASE: &str = "no phase follows: the study has no more [[phases]]";

/// Maps keys to their actions.
pub struct Controls {
    view: View,
    phases: ScheduleHandle,
    growth: Growth,
    clock: Clock,
    keys: KeyCommands,
    /// The command that the user was asked to confirm.
    asked: Option<Command>,
}

impl Controls {
    /// Creates controls that scroll a view and switch phases.
    pub fn new(view: View, phases: ScheduleHandle, growth: Growth) -> Controls {
        let (clock, keys) = (Clock::host(), KeyCommands::default());
        Controls { view, phases, growth, clock, keys, asked: None }
    }

    /// Sends the commands of a study's `[keys]`.
    pub fn with_keys(self, keys: KeyCommands) -> Controls {
        Controls { keys, ..self }
    }

    /// Starts reading the keys; `None` if there is no terminal to read from.
    pub fn open(mut self) -> Option<Keys> {
        Keys::open(move |key| self.press(key))
    }

    /// Performs the action of a key and returns the command that it sends.
    fn press(&mut self, key: Key) -> Option<Command> {
        let now = self.clock.now();
        let stood = self.view.take_question(now);
        if let Some(asked) = self.asked.take().filter(|_| stood) {
            return matches!(key, Key::Char('y' | 'Y')).then_some(asked);
        }
        let stage = self.growth.on_disk().stage;
        match (key, &stage) {
            (Key::Char('q'), _) => return self.send(Command::Stop, &stage, now),
            (Key::Control('p'), Stage::Open) => {
                return self.send(Command::StopRecording, &stage, now);
            }
            (Key::Control('p'), Stage::Paused { .. }) => return Some(Command::StartRecording),
            (Key::Control('k'), Stage::Paused { .. }) => return Some(Command::Snapshot),
            (Key::Control('p' | 'k'), _) => self.view.ask(NOT_PAUSED, now),
            (key, _) => {
                let own =
                    if let Key::Char(name) = key { self.keys.of(name).cloned() } else { None };
                return match own {
                    Some(command) => self.send(command, &stage, now),
                    None => self.press_other(key, now),
                };
            }
        }
        None
    }

    /// Returns a command to be sent; asks first if it would end a recording.
    fn send(&mut self, command: Command, stage: &Stage, now: Time) -> Option<Command> {
        let question = match (&command, stage) {
            (Command::Stop, Stage::Open) => END,
            (Command::StopRecording, Stage::Open) => STOP,
            _ => return Some(command),
        };
        self.ask(question, command, now);
        None
    }

    /// Asks a question, and remembers the command that `y` confirms.
    fn ask(&mut self, question: &str, command: Command, now: Time) {
        self.asked = Some(command);
        self.view.ask(question, now);
        if !std::io::stderr().is_terminal() {
            crate::output::say(question);
        }
    }

    /// Performs the action of a key that does not depend on whether anything is recorded.
    fn press_other(&mut self, key: Key, now: Time) -> Option<Command> {
        match key {
            Key::Control('n') if self.phases.next().is_none() => self.view.ask(NO_PHASE, now),
            Key::Control('n') => return Some(Command::NextPhase),
            Key::Control('r') => return Some(Command::RepeatPhase),
            Key::Control('x') => return Some(Command::AbortPhase),
            Key::Control('a') => self.view.see(),
            Key::Up => self.view.scroll(Scroll::Up),
            Key::Down => self.view.scroll(Scroll::Down),
            Key::PageUp => self.view.scroll(Scroll::Back),
            Key::PageDown => self.view.scroll(Scroll::Forth),
            Key::Home | Key::End => self.view.scroll(Scroll::Home),
            Key::Char(_) | Key::Control(_) | Key::Escape => return marker(key),
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn controls(growth: &Growth) -> Controls {
        Controls::new(View::default(), ScheduleHandle::default(), growth.clone())
    }

    /// Presses keys; returns the markers that were set, and whether the session was ended.
    fn press(controls: &mut Controls, keys: &str) -> (String, bool) {
        let (mut markers, mut ended) = (String::new(), false);
        for command in keys.chars().filter_map(|key| controls.press(Key::Char(key))) {
            match command {
                Command::Mark(label) => markers += &label,
                Command::Stop => ended = true,
                other => panic!("{other} of a letter"),
            }
        }
        (markers, ended)
    }

    #[test]
    fn ending_a_recording_takes_two_keys_and_anything_else_one() {
        let growth = Growth::default();
        assert_eq!(press(&mut controls(&growth), "q"), (String::new(), true));
        growth.begin(Path::new("bag"));
        assert_eq!(press(&mut controls(&growth), "q"), (String::new(), false));
        assert_eq!(press(&mut controls(&growth), "qq"), (String::new(), false));
        assert_eq!(press(&mut controls(&growth), "qn"), (String::new(), false));
        assert_eq!(press(&mut controls(&growth), "qy"), (String::new(), true));
        growth.finish();
        assert_eq!(press(&mut controls(&growth), "q"), (String::new(), true));
    }

    #[test]
    fn a_recording_is_stopped_after_a_question_and_started_at_once() {
        let growth = Growth::default();
        let mut keys = controls(&growth);
        let mut press = |key| keys.press(key);
        let (toggle, keep) = (Key::Control('p'), Key::Control('k'));
        assert_eq!((press(toggle), press(keep)), (None, None));
        growth.begin(Path::new("bag"));
        assert_eq!((press(toggle), press(Key::Char('n'))), (None, None));
        assert_eq!(press(toggle), None);
        assert_eq!(press(Key::Char('y')), Some(Command::StopRecording));
        growth.pause(30.0);
        assert_eq!(press(keep), Some(Command::Snapshot));
        assert_eq!(press(toggle), Some(Command::StartRecording));
        assert_eq!(press(Key::Char('q')), Some(Command::Stop));
    }

    #[test]
    fn a_key_sends_the_command_of_the_study_and_asks_before_it_ends_a_recording() {
        let settings = [("b", "do nback start 2"), ("l", "mark robot lost"), ("e", "stop")];
        let settings = settings.map(|(key, command)| (key.to_owned(), command.to_owned()));
        let keys = KeyCommands::read(&settings.into()).unwrap();
        let growth = Growth::default();
        growth.begin(Path::new("bag"));
        let mut controls = controls(&growth).with_keys(keys);
        let mut press = |key| controls.press(Key::Char(key)).map(|command| command.to_string());
        assert_eq!(press('b').as_deref(), Some("do nback start 2"));
        assert_eq!(press('l').as_deref(), Some("mark robot lost"));
        assert_eq!(press('m').as_deref(), Some("mark m"));
        assert_eq!((press('e'), press('y').as_deref()), (None, Some("stop")));
    }

    #[test]
    fn the_key_that_answers_sets_no_marker() {
        let growth = Growth::default();
        growth.begin(Path::new("bag"));
        assert_eq!(press(&mut controls(&growth), "aqby"), ("ay".to_owned(), false));
    }

    #[test]
    fn other_keys_than_letters_set_no_marker() {
        let mut controls = controls(&Growth::default());
        let keys = [Key::Up, Key::PageDown, Key::Home, Key::Escape, Key::Control('n')];
        assert!(keys.into_iter().all(|key| controls.press(key).is_none()));
    }
}
