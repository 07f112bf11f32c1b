//! Turns a study into a session: the sources, features and sinks that run.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use teampulse_bag::Growth;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::registry::{Component, Settings};
use teampulse_core::session::{NamedFeature, Pace, Session};
use teampulse_core::sink::Sink;
use teampulse_core::source::Source;
use teampulse_core::streams::Streams;
use teampulse_core::worker::Worker;
use teampulse_features::context::FeatureContext;
use teampulse_messages::convert::encode;
use teampulse_ros::BusId;
use teampulse_ros::buses::Buses;
use teampulse_ros::sink::Publish;
use teampulse_sinks::{
    ALLOWED, Announce, Bag, Colours, DashboardContext, Ended, Estimates, FindUnmet, Kept,
    MarkerSettings, PASSED_ON, PhasePlan, RosContext, SHOWN, SinkContext, TerminalContext, Tidy,
    View,
};
use teampulse_sources::SourceContext;
use teampulse_sources::claims::Claims;
use teampulse_sources::session::{
    Computers, Overflows, Phase, Phases, RosCommands, RosEvents, ScheduleHandle, SimulatedClock,
    follow_clock,
};
use teampulse_sources::wearables::bluetooth::Bluetooth;
use teampulse_workers::{Program, WorkerContext};

use crate::commands::simulate::team;
use crate::components::Components;
use crate::controls::Controls;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::folder::{Claimed, bag_folder};
use crate::network::default_bus;
use crate::notes;
use crate::required::Requirements;
use crate::room::Room;
use crate::study::{SessionClock, Study, StudyError};
use crate::supplies::Supplies;

/// How long a session waits for simulated time to start.
const CLOCK_PATIENCE: Duration = Duration::from_secs(15);

/// A study made ready to run.
pub struct Setup {
    /// The session's clock.
    pub clock: Clock,
    /// The buses that were joined.
    pub buses: Arc<Buses>,
    /// Whether the bag ended early, and where the recording continues.
    pub bag_ended: Ended,
    study: Study,
    /// How the bag grows on disk.
    growth: Growth,
    /// The scroll position on the terminal.
    view: View,
    /// The handle that switches phases.
    phases: ScheduleHandle,
    /// The source that follows `/clock`, if the session uses it.
    follows: Option<SimulatedClock>,
    /// The connection to Bluetooth devices.
    bluetooth: Bluetooth,
    /// What the study's sources have supplied so far.
    pub supplies: Supplies,
    /// What to do with the dashboard's address; `None` without a dashboard.
    pub dashboard: Option<Announce>,
}

impl Setup {
    /// Joins the buses and waits for the clock.
    pub async fn new(study: Study, buses: Arc<Buses>) -> Result<Setup, Failure> {
        // Errors in the environment are not errors in the study.
        default_bus(&buses)?;
        study.check()?;
        let growth = Growth::default();
        let (clock, bag_ended) = (Clock::host(), Ended::default());
        let (view, phases, follows) = (View::default(), ScheduleHandle::default(), None);
        let announce: Announce = Arc::new(|_| {});
        let mut setup = Setup {
            clock,
            buses,
            bag_ended,
            dashboard: study.general.dashboard.0.then_some(announce),
            study,
            growth,
            view,
            phases,
            follows,
            bluetooth: Bluetooth::default(),
            supplies: Supplies::default(),
        };
        let commands = &mut setup.study.general.commands;
        commands.allow_by_default("dashboard", &ALLOWED);
        let bus = setup.buses.get(setup.bus_id()?)?;
        if setup.study.general.session.clock == SessionClock::Simulated {
            setup.clock = Clock::settable();
            let follows = follow_clock(&*bus, &setup.clock, CLOCK_PATIENCE);
            let follows = follows.await?;
            setup.follows = Some(follows.ok_or_else(|| {
                Failure::new(format!("nothing publishes /clock on {}", bus.name()))
                    .hint("start the simulation first, or set `clock = \"host\"`")
                    .exit(Exit::DeviceMissing)
            })?);
        }
        Ok(setup)
    }

    /// Connects to Bluetooth devices other than over the system's D-Bus.
    #[must_use]
    pub fn with_bluetooth(self, bluetooth: Bluetooth) -> Setup {
        Setup { bluetooth, ..self }
    }

    /// Returns the bus of the session's own topics.
    pub fn bus_id(&self) -> Result<BusId, Failure> {
        match &self.study.general.session.domain {
            Some(bus) => Ok(bus.clone()),
            None => default_bus(&self.buses),
        }
    }

    /// Builds the sources of the study.
    pub fn sources(&self) -> Result<Sources, Failure> {
        let (clock, buses) = (self.clock.clone(), Arc::clone(&self.buses));
        let context = SourceContext {
            clock,
            buses,
            claims: Claims::default(),
            bluetooth: self.bluetooth.clone(),
        };
        let sources =
            self.study.build("sources", Components::of_this_program().sources, &context)?;
        let kinds: Vec<&String> = sources.iter().map(|(kind, _)| kind).collect();
        let has_several = |kind| kinds.iter().filter(|other| **other == kind).count() > 1;
        let people = kinds.iter().zip(self.study.texts("sources", "person"));
        let people = people.map(|(kind, person)| person.filter(|_| has_several(*kind))).collect();
        Ok(self.supplies.watching(named(sources, people)))
    }

    /// Builds the sources of an attended session: phases, events and commands from ROS, and keys.
    pub fn attended(&self) -> Result<Sources, Failure> {
        let mut sources = Sources::new();
        let bus = self.buses.get(self.bus_id()?)?;
        sources.push(("commands".into(), Box::new(RosCommands::new(Arc::clone(&bus)))));
        let events = RosEvents::new(bus).with_schedule(self.phases.clone());
        sources.push(("events".into(), Box::new(events)));
        let phases = Phases::new(self.study.general.phases.clone(), self.phases.clone());
        sources.push(("phases".into(), Box::new(phases)));
        let controls = Controls::new(self.view.clone(), self.phases.clone(), self.growth.clone())
            .with_keys(self.study.key_commands()?);
        if let Some(keys) = controls.open() {
            self.view.explain_keys();
            sources.push(("keys".into(), Box::new(keys)));
        }
        Ok(sources)
    }

    /// Builds the workers of the study.
    pub fn workers(&self) -> Result<Workers, Failure> {
        let programs = self.study.settings_of::<Program>("workers", "program")?;
        let mut names = BTreeSet::new();
        let offers = programs.iter().flat_map(|program| &program.offers);
        if let Some(twice) = offers.map(|offer| &offer.name).find(|name| !names.insert(*name)) {
            let message = format!("two workers offer {twice}");
            return Err(self
                .study
                .error(("workers", ""), message, "give each a different name")
                .into());
        }
        let context = WorkerContext { clock: self.clock.clone() };
        let workers =
            self.study.build("workers", Components::of_this_program().workers, &context)?;
        let mut own_names = programs.into_iter().map(|program| program.name);
        let is_program = |(kind, _): &(String, _)| kind == "program";
        let own = workers
            .iter()
            .map(|worker| if is_program(worker) { own_names.next().flatten() } else { None });
        let own = own.collect();
        Ok(named(workers, own))
    }

    /// Builds the features of the study.
    pub fn features(&self) -> Result<Vec<NamedFeature>, Failure> {
        features(&self.study)
    }

    /// Creates the error that the study lacks an array.
    pub fn without(&self, key: &str, consequence: &str) -> StudyError {
        let message = format!("it has no [[{key}]]: {consequence}");
        self.study.error((key, ""), message, "`teampulse scan` shows lines to paste")
    }

    /// Returns the name that the folder of the session's bag would get now.
    pub fn bag_folder(&self, out: &Path) -> PathBuf {
        bag_folder(out, &self.study.general.session.name)
    }

    /// Creates the folder of the session's bag.
    pub fn claim_folder(&self, out: &Path) -> Result<Claimed, Failure> {
        Claimed::new(out, &self.study.general.session.name)
    }

    /// Builds the sinks of the study, with tidy files if it has a bag, and the sinks of every session.
    pub fn sinks(&self, bag: &Path) -> Result<Vec<Box<dyn Sink>>, Failure> {
        let (growth, bag_ended) = (self.growth.clone(), self.bag_ended.clone());
        let (buses, bus, publish) = (Arc::clone(&self.buses), self.bus_id()?, self.published());
        let (terminal, ros) = (self.terminal(), RosContext { buses, bus, publish });
        let context = sink_context(&self.study, bag, &self.clock);
        let dashboard = self.dashboard_context();
        let context = SinkContext { growth, bag_ended, terminal, ros, dashboard, ..context };
        let mut sinks = sinks(&self.study, &context)?;
        let written = self.study.kinds("sinks");
        let is_lacking = |kind: &str| SHOWN.contains(&kind) && written.iter().all(|it| it != kind);
        for entry in Components::of_this_program().sinks.iter().filter(|it| is_lacking(it.kind)) {
            let sink = (entry.build)(Settings::empty(), &context);
            sinks.push(sink.map_err(|error| Failure::new(error.message).hint(error.hint))?);
        }
        sinks.retain(|sink| self.dashboard.is_some() || sink.name() != "dashboard");
        Ok(sinks)
    }

    /// Finds where a recording into `out` has room.
    pub fn room(&self, out: &Path) -> Room {
        let bags: Vec<Bag> = self.study.settings_of("sinks", "bag").unwrap_or_default();
        Room::of(&bags, out)
    }

    /// Returns the settings of the terminal's view.
    fn terminal(&self) -> TerminalContext {
        let shown = self.study.general.session.show_estimates;
        let phases = self.phases.clone();
        let term = std::env::var_os("TERM");
        let no_color = std::env::var_os("NO_COLOR").is_some_and(|set| !set.is_empty());
        TerminalContext {
            estimates: if shown { Estimates::Shown } else { Estimates::Hidden },
            kept: self.kept(),
            view: self.view.clone(),
            colours: if no_color { Colours::None } else { Colours::Some },
            plain: term.is_none_or(|term| term == "dumb"),
            notes: self.notes(),
            next: Some(Arc::new(move || phases.next())),
        }
    }

    /// Returns what the dashboard needs to know about the study.
    fn dashboard_context(&self) -> DashboardContext {
        let general = &self.study.general;
        let plan = |phase: &Phase| PhasePlan {
            name: phase.name.clone(),
            from: phase.from_secs,
            lasts: phase.length_secs(),
        };
        // Mistakes in sources have already been reported as errors.
        let required = self.requirements().ok().map(|required| {
            let find: FindUnmet = Arc::new(move |received| required.missing(received));
            find
        });
        DashboardContext {
            phases: general.phases.iter().map(plan).collect(),
            commands: general.commands.verbs_of("dashboard"),
            markers: self.markers(),
            required,
            announce: self.dashboard.clone(),
        }
    }

    /// Returns the markers that keys set, which apply to the dashboard, too.
    fn markers(&self) -> Vec<MarkerSettings> {
        // A mistake in a key is an error before this.
        let keys = self.study.key_commands().unwrap_or_default();
        let marker =
            |(key, label): (char, &str)| MarkerSettings { label: label.to_owned(), key: Some(key) };
        keys.markers().map(marker).collect()
    }

    /// Returns what the study requires of the received streams.
    pub fn requirements(&self) -> Result<Requirements, StudyError> {
        Requirements::of(&self.study)
    }

    /// Returns the notes on the study before it runs.
    pub fn notes(&self) -> Vec<String> {
        notes::of_study(&self.study)
    }

    /// Returns whether, and how, the sinks of the study store data.
    fn kept(&self) -> Kept {
        let kinds = keeping(&self.study);
        if kinds.iter().any(|kind| kind == "bag") {
            Kept::Bag(self.growth.clone())
        } else if kinds.is_empty() {
            Kept::Nothing
        } else {
            Kept::Tables
        }
    }

    /// Returns the streams that are published on ROS: conclusions about robots and the team, and the streams that the
    /// study names.
    fn published(&self) -> Publish {
        Publish::Conclusions(self.study.general.publish.clone())
    }

    /// Creates a session with these parts.
    pub fn session(self, mut parts: Parts) -> Session {
        for bus in self.buses.joined() {
            let name = format!("clocks on {}", bus.name());
            let overflows = Overflows::new(Arc::clone(&bus));
            parts.sources.push((name, Box::new(Computers::new(bus))));
            parts.sources.push(("receive buffers".into(), Box::new(overflows)));
        }
        if let Some(follows) = self.follows {
            parts.sources.push(("/clock".into(), Box::new(follows)));
        }
        Session {
            clock: self.clock,
            pace: Pace::Live,
            clocks: Clocks::new(self.study.general.clocks.clone()),
            streams: Streams::default(),
            sources: parts.sources,
            features: parts.features,
            sinks: parts.sinks,
            workers: parts.workers,
            encode,
            commands: Commands::new(self.study.general.commands.clone()),
        }
    }
}

/// Sources, each with its name.
pub type Sources = Vec<(String, Box<dyn Source>)>;

/// Workers, each with its name.
pub type Workers = Vec<(String, Box<dyn Worker>)>;

/// The parts of a session.
#[derive(Default)]
pub struct Parts {
    /// The sources, by name.
    pub sources: Sources,
    /// The features.
    pub features: Vec<NamedFeature>,
    /// The sinks.
    pub sinks: Vec<Box<dyn Sink>>,
    /// The workers, by name.
    pub workers: Workers,
}

/// Returns the kinds of a study's sinks that may store data: neither those that only show it nor those that pass it on.
pub fn keeping(study: &Study) -> Vec<String> {
    let mut kinds = study.kinds("sinks");
    kinds.retain(|kind| !SHOWN.contains(&kind.as_str()) && !PASSED_ON.contains(&kind.as_str()));
    kinds
}

/// Builds the sinks of a study, with tidy files if it has a bag.
fn sinks(study: &Study, context: &SinkContext) -> Result<Vec<Box<dyn Sink>>, Failure> {
    let built = study.build("sinks", Components::of_this_program().sinks, context)?;
    let has = |kind| built.iter().any(|(name, _)| name == kind);
    if built.iter().filter(|(name, _)| name == "bag").count() > 1 {
        let message = "it has two bags: a session is recorded into one bag";
        let hint = "remove one of the [[sinks]] with type = \"bag\"";
        return Err(study.error(("sinks", ""), message, hint).into());
    }
    let (has_bag, has_tidy) = (has("bag"), has("tidy"));
    if has_tidy && !has_bag {
        let message = "it has no bag in whose folder the tidy files could be written";
        let hint = "add [[sinks]] with type = \"bag\"";
        return Err(study.error(("sinks", ""), message, hint).into());
    }
    let mut sinks: Vec<Box<dyn Sink>> = built.into_iter().map(|(_, sink)| sink).collect();
    if has_bag && !has_tidy {
        sinks.extend(tidy(study, context)?);
    }
    Ok(sinks)
}

/// Fails if a study could not be run. Joins and creates nothing.
pub fn try_out(study: &Study) -> Result<(), Failure> {
    study.check()?;
    team(study)?;
    let (clock, buses) = (Clock::settable(), Arc::new(Buses::apart()));
    let context = SourceContext {
        clock: clock.clone(),
        buses,
        claims: Claims::default(),
        bluetooth: Bluetooth::default(),
    };
    study.build("sources", Components::of_this_program().sources, &context)?;
    features(study)?;
    // Workers are left out: their results are in the recording, and their programs may not be on this machine.
    sinks(study, &sink_context(study, Path::new("nowhere"), &clock))?;
    Ok(())
}

/// Builds the features of a study, each with its settings, except those that the study disables.
pub fn features(study: &Study) -> Result<Vec<NamedFeature>, Failure> {
    let settings = &study.general.features;
    let entries = Components::of_this_program().features;
    for disabled in &settings.disable {
        if !entries.iter().any(|entry| entry.kind == disabled) {
            let known: Vec<&str> = entries.iter().map(|entry| entry.kind).collect();
            let message = format!("there is no feature `{disabled}` to disable");
            let hint = format!("the features are {}", known.join(", "));
            return Err(study.error(("features", "disable"), message, hint).into());
        }
    }
    let (windows_secs, mains_hz) = (settings.windows_secs.clone(), settings.mains_hz);
    let context = FeatureContext { windows_secs, mains_hz, alerts: study.general.alerts.clone() };
    let mut enabled = Vec::new();
    for entry in entries {
        // Disabled features are built, too: a mistake in their settings is still a mistake.
        let built = (entry.build)(study.feature(entry.kind)?, &context);
        let feature = built.map_err(|error| study.wrong_feature(entry.kind, error))?;
        if settings.disable.iter().all(|disabled| disabled != entry.kind) {
            enabled.push((entry.kind, Arc::from(feature)));
        }
    }
    Ok(enabled)
}

/// Returns the context with which the sinks of a session are built.
pub fn sink_context(study: &Study, bag: &Path, clock: &Clock) -> SinkContext {
    let session = study.general.session.name.as_str();
    let context = SinkContext::new(bag, session, clock.clone());
    SinkContext { study: study.text().to_owned(), ..context }
}

/// Gives each component the name that it has in messages.
fn named<T>(components: Vec<(String, T)>, own: Vec<Option<String>>) -> Vec<(String, T)> {
    let kinds: Vec<String> = components.iter().map(|(kind, _)| kind.clone()).collect();
    let with_name = |(place, ((_, component), own))| (name(&kinds, place, own), component);
    components.into_iter().zip(own).enumerate().map(with_name).collect()
}

/// Returns a component's name in messages: its kind with its own name, or with a number if there are several of its
/// kind.
fn name(kinds: &[String], place: usize, own: Option<String>) -> String {
    let kind = &kinds[place];
    let number = kinds[..=place].iter().filter(|other| *other == kind).count();
    let is_alone = kinds.iter().filter(|other| *other == kind).count() == 1;
    match own {
        Some(own) => format!("{kind} {own}"),
        None if is_alone => kind.clone(),
        None => format!("{kind} {number}"),
    }
}

/// Builds the tidy files of a bag, as configured by the study or with defaults; `None` if the study disables them.
pub fn tidy(study: &Study, context: &SinkContext) -> Result<Option<Box<dyn Sink>>, Failure> {
    let bags: Vec<Bag> = study.settings_of("sinks", "bag")?;
    let own: Vec<Tidy> = study.settings_of("sinks", "tidy")?;
    if own.is_empty() && bags.iter().any(|bag| !bag.tidy) {
        return Ok(None);
    }
    let tidy = own.into_iter().next().unwrap_or_default().build(context);
    tidy.map(Some).map_err(|error| study.error(("sinks", ""), error.message, error.hint).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_of_a_kind_have_names_of_their_own() {
        let kinds = ["program", "model", "program", "program"].map(str::to_owned);
        let own = [None, None, Some("score".to_owned()), None];
        let names: Vec<String> =
            own.into_iter().enumerate().map(|(place, own)| name(&kinds, place, own)).collect();
        assert_eq!(names, ["program 1", "model", "program score", "program 3"]);
    }
}
