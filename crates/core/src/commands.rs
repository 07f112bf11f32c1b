//! The commands of a session: who may send them, and who carries them out.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use schemars::JsonSchema;
use serde::Deserialize;
use thiserror::Error;
use tokio::sync::{mpsc, watch};

use crate::command::{Command, Sender, VERBS};

/// How many commands wait for one receiver.
const DEPTH: usize = 64;
/// How many different refusals are reported.
const MOST_REFUSALS: usize = 100;

/// Who may command the session, by where a command comes from: verbs, or `*` for all of them.
#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(deny_unknown_fields, default)]
pub struct CommandSettings {
    /// From the keys of the terminal.
    pub keys: Vec<String>,
    /// From ROS nodes, as `std_msgs/String` on `/session/commands`. Whoever is on the network can
    /// publish there.
    pub ros: Vec<String>,
}

impl Default for CommandSettings {
    fn default() -> CommandSettings {
        CommandSettings { keys: vec!["*".into()], ros: Vec::new() }
    }
}

impl CommandSettings {
    /// The first word that is neither a verb nor `*`: its setting, its place there, and the word.
    pub fn unknown(&self) -> Option<(&'static str, usize, &str)> {
        let known = |word: &str| word == "*" || VERBS.iter().any(|(verb, _, _)| *verb == word);
        [("keys", &self.keys), ("ros", &self.ros)].into_iter().find_map(|(setting, words)| {
            let place = words.iter().position(|word| !known(word))?;
            Some((setting, place, words[place].as_str()))
        })
    }

    fn allow(&self, sender: &Sender, command: &Command) -> bool {
        let allowed = match sender {
            Sender::Keys => &self.keys,
            Sender::Ros(_) => &self.ros,
        };
        allowed.iter().any(|word| word == "*" || word == command.verb())
    }
}

/// Why a command was refused. The message fits after the command.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum Refused {
    /// The study does not allow it.
    #[error("not allowed: list `{verb}` below [commands] in `{setting}`")]
    NotAllowed {
        /// The verb.
        verb: &'static str,
        /// The setting that would allow it.
        setting: &'static str,
    },
    /// No component carries out this command.
    #[error("nothing in this session carries it out")]
    NoReceiver,
    /// The receiver has not taken the commands before it.
    #[error("too many commands wait already")]
    Busy,
}

/// The commands of one session. Clones are one.
#[derive(Clone, Debug)]
pub struct Commands(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    settings: CommandSettings,
    receivers: Mutex<Vec<Receiver>>,
    stop: watch::Sender<bool>,
    refusals: Mutex<BTreeSet<String>>,
}

/// A component that carries out commands.
struct Receiver {
    accepts: Box<dyn Fn(&Command) -> bool + Send>,
    /// `None` where the event of the command is all that it needs.
    queue: Option<mpsc::Sender<Command>>,
}

impl std::fmt::Debug for Receiver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Receiver").finish_non_exhaustive()
    }
}

impl Default for Commands {
    /// Commands by the default settings: from keys only.
    fn default() -> Commands {
        Commands::new(CommandSettings::default())
    }
}

impl Commands {
    /// Commands by these settings.
    pub fn new(settings: CommandSettings) -> Commands {
        let (receivers, refusals) = (Mutex::default(), Mutex::default());
        let stop = watch::Sender::new(false);
        Commands(Arc::new(Inner { settings, receivers, stop, refusals }))
    }

    /// The commands that `accepts` says yes to, as long as what is returned is held.
    pub(crate) fn receive(
        &self,
        accepts: impl Fn(&Command) -> bool + Send + 'static,
    ) -> mpsc::Receiver<Command> {
        let (queue, received) = mpsc::channel(DEPTH);
        let queue = Some(queue);
        self.receivers().push(Receiver { accepts: Box::new(accepts), queue });
        received
    }

    /// A sink carries out the commands with these verbs by their events.
    pub(crate) fn carried_out_by_events(&self, verbs: &'static [&'static str]) {
        let accepts = Box::new(|command: &Command| verbs.contains(&command.verb()));
        self.receivers().push(Receiver { accepts, queue: None });
    }

    /// Whether a command is allowed and somebody carries it out.
    pub(crate) fn check(&self, sender: &Sender, command: &Command) -> Result<(), Refused> {
        if !self.0.settings.allow(sender, command) {
            let (verb, setting) = (command.verb(), sender.setting());
            return Err(Refused::NotAllowed { verb, setting });
        }
        if matches!(command, Command::Stop | Command::Mark(_)) {
            return Ok(());
        }
        let mut receivers = self.receivers();
        receivers.retain(|each| each.queue.as_ref().is_none_or(|queue| !queue.is_closed()));
        let mut willing = receivers.iter().filter(|each| (each.accepts)(command)).peekable();
        if willing.peek().is_none() {
            return Err(Refused::NoReceiver);
        }
        let is_busy = |each: &Receiver| each.queue.as_ref().is_some_and(|q| q.capacity() == 0);
        if willing.any(is_busy) { Err(Refused::Busy) } else { Ok(()) }
    }

    /// Hands an accepted command to everybody who carries it out.
    pub(crate) fn dispatch(&self, command: &Command) {
        if *command == Command::Stop {
            self.0.stop.send_replace(true);
        }
        for receiver in self.receivers().iter().filter(|each| (each.accepts)(command)) {
            if let Some(queue) = &receiver.queue {
                // A full queue was refused before.
                queue.try_send(command.clone()).ok();
            }
        }
    }

    /// Whether a refusal is to be reported: each one once, and not without end.
    pub(crate) fn is_news(&self, refusal: &str) -> bool {
        let mut known = self.0.refusals.lock().unwrap_or_else(PoisonError::into_inner);
        known.len() < MOST_REFUSALS && known.insert(refusal.to_owned())
    }

    /// Resolves when the session was asked to stop.
    pub(crate) async fn stopped(&self) {
        let mut stop = self.0.stop.subscribe();
        if stop.wait_for(|stop| *stop).await.is_err() {
            std::future::pending::<()>().await;
        }
    }

    fn receivers(&self) -> MutexGuard<'_, Vec<Receiver>> {
        self.0.receivers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ros() -> Sender {
        Sender::Ros("/panel".into())
    }

    #[test]
    fn what_is_not_allowed_is_refused_with_the_setting_that_allows_it() {
        let commands = Commands::default();
        let refused = commands.check(&ros(), &Command::Stop).unwrap_err();
        assert_eq!(refused, Refused::NotAllowed { verb: "stop", setting: "ros" });
        assert_eq!(commands.check(&Sender::Keys, &Command::Stop), Ok(()));

        let ros_may = CommandSettings { ros: vec!["mark".into()], ..CommandSettings::default() };
        let commands = Commands::new(ros_may);
        assert_eq!(commands.check(&ros(), &Command::Mark("x".into())), Ok(()));
        assert!(commands.check(&ros(), &Command::Stop).is_err());
    }

    #[test]
    fn words_that_are_no_verbs_are_found() {
        let typo = CommandSettings {
            ros: vec!["mark".into(), "nextphase".into()],
            ..CommandSettings::default()
        };
        assert_eq!(typo.unknown(), Some(("ros", 1, "nextphase")));
        assert_eq!(CommandSettings::default().unknown(), None);
    }

    #[test]
    fn a_command_goes_to_whoever_accepts_it_and_to_nobody_after_that_left() {
        let commands = Commands::default();
        let split = || commands.check(&Sender::Keys, &Command::Split);
        assert_eq!(split(), Err(Refused::NoReceiver));
        let mut received = commands.receive(|command| *command == Command::Split);
        assert_eq!(split(), Ok(()));
        commands.dispatch(&Command::Split);
        commands.dispatch(&Command::NextPhase);
        assert_eq!(received.try_recv(), Ok(Command::Split));
        assert!(received.try_recv().is_err());
        drop(received);
        assert_eq!(split(), Err(Refused::NoReceiver));
        commands.carried_out_by_events(&["split"]);
        assert_eq!(split(), Ok(()));
    }

    #[test]
    fn a_receiver_that_takes_nothing_is_busy_and_holds_a_bounded_number() {
        let commands = Commands::default();
        let _received = commands.receive(|_| true);
        for _ in 0..DEPTH {
            assert_eq!(commands.check(&Sender::Keys, &Command::NextPhase), Ok(()));
            commands.dispatch(&Command::NextPhase);
        }
        assert_eq!(commands.check(&Sender::Keys, &Command::NextPhase), Err(Refused::Busy));
    }

    #[tokio::test]
    async fn a_stop_reaches_the_session() {
        let commands = Commands::default();
        commands.dispatch(&Command::Stop);
        commands.stopped().await;
    }
}
