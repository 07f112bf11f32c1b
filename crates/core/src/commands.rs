//! The commands of a session: who may send them, and who carries them out.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use schemars::JsonSchema;
use serde::Deserialize;
use thiserror::Error;
use tokio::sync::{mpsc, watch};

use crate::command::{Command, Instruction, Sender, VERBS};
use crate::worker::Feed;

/// The most commands that may wait for one receiver.
const DEPTH: usize = 64;
/// The most different refusals that are reported.
const MOST_REFUSALS: usize = 100;

/// The commands that are allowed, by where they come from: verbs, `do COMPONENT`, or `*` for everything.
#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(default)]
pub struct CommandSettings {
    /// Commands allowed from the terminal's keys.
    pub keys: Vec<String>,
    /// Commands allowed from ROS nodes, as `std_msgs/String` on `/session/commands`. Any node on the network can
    /// publish there.
    pub ros: Vec<String>,
    /// Commands allowed from people and programs behind a component of the session, by the component's `type`. Nothing
    /// is allowed without this setting.
    #[serde(flatten)]
    pub components: BTreeMap<String, Vec<String>>,
}

impl Default for CommandSettings {
    fn default() -> CommandSettings {
        let components = BTreeMap::new();
        CommandSettings { keys: vec!["*".into()], ros: Vec::new(), components }
    }
}

impl CommandSettings {
    /// Settings that allow no command.
    pub fn nobody() -> CommandSettings {
        CommandSettings { keys: Vec::new(), ..CommandSettings::default() }
    }

    /// The first word that is not a verb, and so allows nothing: the setting, the word's index in it, and the word.
    pub fn unknown(&self) -> Option<(&str, usize, &str)> {
        let known = |word: &str| {
            let verb = word.split_once(' ').map_or(word, |(verb, _)| verb);
            word == "*" || verb == "do" || VERBS.iter().any(|(verb, _, _)| *verb == word)
        };
        let named = [("keys", &self.keys), ("ros", &self.ros)].into_iter();
        let components =
            self.components.iter().map(|(component, words)| (component.as_str(), words));
        named.chain(components).find_map(|(setting, words)| {
            let place = words.iter().position(|word| !known(word))?;
            Some((setting, place, words[place].as_str()))
        })
    }

    /// Allows these verbs from a component, unless the study sets what is allowed.
    pub fn allow_by_default(&mut self, component: &str, verbs: &[&str]) {
        let verbs = || verbs.iter().map(|verb| (*verb).to_owned()).collect();
        self.components.entry(component.to_owned()).or_insert_with(verbs);
    }

    /// The verbs that are allowed from a component, in the order of their documentation; includes `do` if it is allowed
    /// for any component.
    pub fn verbs_of(&self, component: &str) -> Vec<&'static str> {
        let words = self.components.get(component).map(Vec::as_slice).unwrap_or_default();
        let verbs = VERBS.iter().map(|(verb, _, _)| *verb);
        let is_allowed = |verb: &&'static str| {
            words.iter().any(|word| word == "*" || word.split(' ').next() == Some(*verb))
        };
        verbs.filter(is_allowed).collect()
    }

    fn allow(&self, sender: &Sender, command: &Command) -> bool {
        let allowed = match sender.setting() {
            "keys" => Some(&self.keys),
            "ros" => Some(&self.ros),
            component => self.components.get(component),
        };
        let allows = |word: &String| match (word.as_str(), command) {
            ("*", _) => true,
            (word, Command::Do { component, .. }) => {
                word == "do" || word.strip_prefix("do ").is_some_and(|of| of.trim() == component)
            }
            (word, command) => word == command.verb(),
        };
        allowed.is_some_and(|words| words.iter().any(allows))
    }
}

/// Why a command was refused. The message fits after the command's name.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum Refused {
    /// The study does not allow the command.
    #[error("not allowed: add `{word}` to `{setting}` below [commands]")]
    NotAllowed {
        /// The narrowest word that would allow the command: the verb, and for `do` also the component.
        word: String,
        /// The setting that would allow it.
        setting: String,
    },
    /// No component carries out this command.
    #[error("nothing in this session carries it out")]
    NoReceiver,
    /// The receiver has too many earlier commands waiting.
    #[error("too many commands are already waiting")]
    Busy,
}

/// The commands of one session; clones share them.
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
    by: By,
}

/// How a component receives commands.
enum By {
    Queue(mpsc::Sender<Instruction>),
    /// A sink: it reads commands from their events.
    Event,
    Worker(Feed),
}

impl Receiver {
    fn is_gone(&self) -> bool {
        match &self.by {
            By::Queue(queue) => queue.is_closed(),
            By::Event => false,
            By::Worker(feed) => feed.is_closed(),
        }
    }

    fn is_busy(&self) -> bool {
        match &self.by {
            By::Queue(queue) => queue.capacity() == 0,
            By::Event => false,
            By::Worker(feed) => feed.waiting_commands() >= DEPTH,
        }
    }

    fn take(&self, instruction: &Instruction) {
        match &self.by {
            // Commands for a full queue were already refused by `check`.
            By::Queue(queue) => drop(queue.try_send(instruction.clone())),
            By::Event => {}
            By::Worker(feed) => feed.command(instruction.clone()),
        }
    }
}

impl std::fmt::Debug for Receiver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Receiver").finish_non_exhaustive()
    }
}

impl Default for Commands {
    /// Default settings: commands from keys only.
    fn default() -> Commands {
        Commands::new(CommandSettings::default())
    }
}

impl Commands {
    /// Creates the command registry of a session with these settings.
    pub fn new(settings: CommandSettings) -> Commands {
        let (receivers, refusals) = (Mutex::default(), Mutex::default());
        let stop = watch::Sender::new(false);
        Commands(Arc::new(Inner { settings, receivers, stop, refusals }))
    }

    /// Receives the commands for which `accepts` returns true, until the returned value is dropped.
    pub(crate) fn receive(
        &self,
        accepts: impl Fn(&Command) -> bool + Send + 'static,
    ) -> mpsc::Receiver<Instruction> {
        let (queue, received) = mpsc::channel(DEPTH);
        self.receivers().push(Receiver { accepts: Box::new(accepts), by: By::Queue(queue) });
        received
    }

    /// Registers a sink that carries out the commands with these verbs when it receives their events.
    pub(crate) fn carried_out_by_events(&self, verbs: &'static [&'static str]) {
        let accepts = Box::new(|command: &Command| verbs.contains(&command.verb()));
        self.receivers().push(Receiver { accepts, by: By::Event });
    }

    /// Registers a worker that carries out the commands for which `accepts` returns true; its feed delivers them.
    pub(crate) fn carried_out_by_worker(
        &self,
        accepts: Box<dyn Fn(&Command) -> bool + Send>,
        feed: Feed,
    ) {
        self.receivers().push(Receiver { accepts, by: By::Worker(feed) });
    }

    /// Whether a command is allowed and a component carries it out.
    pub(crate) fn check(&self, sender: &Sender, command: &Command) -> Result<(), Refused> {
        if !self.0.settings.allow(sender, command) {
            let word = match command {
                Command::Do { component, .. } => format!("{} {component}", command.verb()),
                other => other.verb().to_owned(),
            };
            return Err(Refused::NotAllowed { word, setting: sender.setting().to_owned() });
        }
        if matches!(command, Command::Stop | Command::Mark(_)) {
            return Ok(());
        }
        let mut receivers = self.receivers();
        receivers.retain(|each| !each.is_gone());
        let mut willing = receivers.iter().filter(|each| (each.accepts)(command)).peekable();
        if willing.peek().is_none() {
            return Err(Refused::NoReceiver);
        }
        if willing.any(Receiver::is_busy) { Err(Refused::Busy) } else { Ok(()) }
    }

    /// Passes an accepted command to every component that carries it out.
    pub(crate) fn dispatch(&self, instruction: &Instruction) {
        let command = &instruction.command;
        if *command == Command::Stop {
            self.0.stop.send_replace(true);
        }
        for receiver in self.receivers().iter().filter(|each| (each.accepts)(command)) {
            receiver.take(instruction);
        }
    }

    /// Whether a refusal should be reported: each refusal is reported once, and only a limited number of them.
    pub(crate) fn is_new(&self, refusal: &str) -> bool {
        let mut known = self.0.refusals.lock().unwrap_or_else(PoisonError::into_inner);
        known.len() < MOST_REFUSALS && known.insert(refusal.to_owned())
    }

    /// Resolves once the session is asked to stop.
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
    use crate::time::Time;

    fn ros() -> Sender {
        Sender::ros("/panel")
    }

    fn by_key(command: Command) -> Instruction {
        Instruction { sender: Sender::keys(), command, at: Time::from_nanos(1) }
    }

    #[test]
    fn what_is_not_allowed_is_refused_with_the_setting_that_allows_it() {
        let commands = Commands::default();
        let refused = commands.check(&ros(), &Command::Stop).unwrap_err();
        assert_eq!(refused, Refused::NotAllowed { word: "stop".into(), setting: "ros".into() });
        assert_eq!(commands.check(&Sender::keys(), &Command::Stop), Ok(()));

        let ros_may = CommandSettings { ros: vec!["mark".into()], ..CommandSettings::default() };
        let commands = Commands::new(ros_may);
        assert_eq!(commands.check(&ros(), &Command::Mark("x".into())), Ok(()));
        assert!(commands.check(&ros(), &Command::Stop).is_err());
    }

    #[test]
    fn one_component_may_be_asked_and_no_other() {
        let allowed = BTreeMap::from([("dashboard".into(), vec!["do nback".into()])]);
        let settings = CommandSettings { components: allowed, ..CommandSettings::default() };
        assert_eq!(settings.unknown(), None);
        let tablet = Sender::through("dashboard", "tablet");
        let may = |command: &str| settings.allow(&tablet, &command.parse().unwrap());
        assert!(may("do nback start 2"));
        assert!(!may("do camera start") && !may("stop"));
        let refused =
            Commands::new(settings.clone()).check(&tablet, &"do camera start".parse().unwrap());
        let text = refused.unwrap_err().to_string();
        assert_eq!(text, "not allowed: add `do camera` to `dashboard` below [commands]");
        let nobody = Sender::through("lsl", "");
        assert!(!settings.allow(&nobody, &Command::Stop));
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
        let split = || commands.check(&Sender::keys(), &Command::Split);
        assert_eq!(split(), Err(Refused::NoReceiver));
        let mut received = commands.receive(|command| *command == Command::Split);
        assert_eq!(split(), Ok(()));
        commands.dispatch(&by_key(Command::Split));
        commands.dispatch(&by_key(Command::NextPhase));
        assert_eq!(received.try_recv(), Ok(by_key(Command::Split)));
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
            assert_eq!(commands.check(&Sender::keys(), &Command::NextPhase), Ok(()));
            commands.dispatch(&by_key(Command::NextPhase));
        }
        assert_eq!(commands.check(&Sender::keys(), &Command::NextPhase), Err(Refused::Busy));
    }

    #[tokio::test]
    async fn a_stop_reaches_the_session() {
        let commands = Commands::default();
        commands.dispatch(&by_key(Command::Stop));
        commands.stopped().await;
    }
}
