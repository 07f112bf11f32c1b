//! From a study to a session: which sources, features and sinks run.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use teampulse_core::clock::{self, Clock};
use teampulse_core::clocks::Clocks;
use teampulse_core::feature::Feature;
use teampulse_core::registry::Component;
use teampulse_core::session::{Outcome, Pace, Session};
use teampulse_core::sink::Sink;
use teampulse_core::source::Source;
use teampulse_core::streams::Streams;
use teampulse_features::FEATURES;
use teampulse_features::context::FeatureContext;
use teampulse_messages::convert::encode;
use teampulse_ros::bus::Subscription;
use teampulse_ros::buses::Buses;
use teampulse_ros::diagnostics::DiagnosticsSink;
use teampulse_ros::sink::{Publish, RosSink};
use teampulse_sinks::{Bag, Ended, Estimates, SINKS, SinkContext, Terminal, Tidy};
use teampulse_sources::session::{Computers, Keys, Phases, RosEvents, follow_clock};
use teampulse_sources::{SOURCES, SourceContext};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::network::default_domain;
use crate::stop::Stop;
use crate::study::{SessionClock, Study, StudyError};

/// How long a session waits for simulated time to begin.
const CLOCK_PATIENCE: Duration = Duration::from_secs(15);

/// A study made ready to run.
pub struct Setup {
    /// The session's clock.
    pub clock: Clock,
    /// The buses that are joined.
    pub buses: Arc<Buses>,
    study: Study,
    /// Held as long as the session follows `/clock`.
    follows: Option<Subscription>,
}

impl Setup {
    /// Joins the buses and waits for the clock.
    pub async fn new(study: Study, buses: Arc<Buses>) -> Result<Setup, Failure> {
        // What is wrong with the environment is not to be blamed on the study.
        default_domain(&buses)?;
        study.check_phases()?;
        let mut setup = Setup { clock: Clock::host(), buses, study, follows: None };
        if setup.study.general.session.clock == SessionClock::Simulated {
            setup.clock = Clock::told();
            let bus = setup.buses.get(setup.domain()?).map_err(Failure::to)?;
            let follows = follow_clock(&*bus, &setup.clock, CLOCK_PATIENCE);
            let follows = follows.await.map_err(Failure::to)?;
            setup.follows = Some(follows.ok_or_else(|| {
                Failure::new(format!("nobody tells the time on /clock of {}", bus.name()))
                    .hint("start the simulation first, or set `clock = \"host\"`")
                    .exit(Exit::DeviceMissing)
            })?);
        }
        Ok(setup)
    }

    /// The domain of the session's own topics.
    pub fn domain(&self) -> Result<u32, Failure> {
        match self.study.general.session.domain {
            Some(domain) => Ok(domain),
            None => default_domain(&self.buses),
        }
    }

    /// The sources of the study.
    pub fn sources(&self) -> Result<Sources, Failure> {
        let context = SourceContext { clock: self.clock.clone(), buses: Arc::clone(&self.buses) };
        Ok(self.study.build("sources", SOURCES, &context)?)
    }

    /// The sources of a session that a person attends: phases, events from ROS, keys.
    pub fn attended(&self, stop: &Stop) -> Result<Sources, Failure> {
        let mut sources = Sources::new();
        let bus = self.buses.get(self.domain()?).map_err(Failure::to)?;
        sources.push(("events".into(), Box::new(RosEvents::new(bus))));
        let phases = self.study.general.phases.clone();
        sources.push(("phases".into(), Box::new(Phases::new(phases))));
        let stop = stop.clone();
        if let Some(keys) = Keys::open(move || stop.ask()) {
            sources.push(("keys".into(), Box::new(keys)));
        }
        Ok(sources)
    }

    /// The features of the study.
    pub fn features(&self) -> Result<Vec<Arc<dyn Feature>>, Failure> {
        features(&self.study)
    }

    /// An error about an array that the study has not.
    pub fn without(&self, key: &str, consequence: &str) -> StudyError {
        let message = format!("it has no [[{key}]]: {consequence}");
        self.study.error((key, ""), message, "`teampulse scan` shows lines to paste")
    }

    /// The folder of the session's bag.
    pub fn bag_folder(&self, out: &Path) -> PathBuf {
        bag_folder(out, &self.study.general.session.name)
    }

    /// The sinks of the study; where it has a bag, tidy files with it.
    pub fn sinks(&self, bag: &Path) -> Result<Vec<Box<dyn Sink>>, Failure> {
        let context = sink_context(&self.study, bag, &self.clock);
        let built = self.study.build("sinks", SINKS, &context)?;
        let has = |kind| built.iter().any(|(name, _)| name == kind);
        let (has_bag, has_tidy) = (has("bag"), has("tidy"));
        if has_tidy && !has_bag {
            let message = "it has no bag in whose folder tidy files could stand";
            let hint = "add [[sinks]] with type = \"bag\"";
            return Err(self.study.error(("sinks", ""), message, hint).into());
        }
        let mut sinks: Vec<Box<dyn Sink>> = built.into_iter().map(|(_, sink)| sink).collect();
        if has_bag && !has_tidy {
            sinks.extend(tidy(&self.study, &context)?);
        }
        Ok(sinks)
    }

    /// The sink that shows the team on the terminal.
    pub fn terminal(&self) -> Box<dyn Sink> {
        let shown = self.study.general.session.show_estimates;
        Box::new(Terminal::new(if shown { Estimates::Shown } else { Estimates::Hidden }))
    }

    /// The sink that publishes on ROS what was concluded, and what the study names.
    pub fn publisher(&self) -> Result<Box<dyn Sink>, Failure> {
        let bus = self.buses.get(self.domain()?).map_err(Failure::to)?;
        let named = self.study.general.publish.iter().map(|name| name.text().to_owned());
        Ok(Box::new(RosSink::fresh(bus, Publish::Conclusions(named.collect()))))
    }

    /// The sink that tells the health of every stream on `/diagnostics`.
    pub fn diagnostics(&self) -> Result<Box<dyn Sink>, Failure> {
        let bus = self.buses.get(self.domain()?).map_err(Failure::to)?;
        Ok(Box::new(DiagnosticsSink::new(bus)))
    }

    /// Runs a session with these parts until it ends or is asked to stop.
    pub async fn run(self, mut parts: Parts, stop: impl Future<Output = ()>) -> Outcome {
        for bus in self.buses.joined() {
            let name = format!("clocks on {}", bus.name());
            parts.sources.push((name, Box::new(Computers::new(bus))));
        }
        let session = Session {
            clock: self.clock,
            pace: Pace::Live,
            clocks: Clocks::new(self.study.general.clocks.clone()),
            streams: Streams::default(),
            sources: parts.sources,
            features: parts.features,
            sinks: parts.sinks,
            encode,
        };
        session.run(stop).await
    }
}

/// Sources, each with its name.
pub type Sources = Vec<(String, Box<dyn Source>)>;

/// What a session runs.
#[derive(Default)]
pub struct Parts {
    /// Its sources, by name.
    pub sources: Sources,
    /// Its features.
    pub features: Vec<Arc<dyn Feature>>,
    /// Its sinks.
    pub sinks: Vec<Box<dyn Sink>>,
}

/// The features of a study, each with its settings, without those that it disables.
pub fn features(study: &Study) -> Result<Vec<Arc<dyn Feature>>, Failure> {
    let settings = &study.general.features;
    for disabled in &settings.disable {
        if !FEATURES.iter().any(|entry| entry.kind == disabled) {
            let known: Vec<&str> = FEATURES.iter().map(|entry| entry.kind).collect();
            let message = format!("there is no feature `{disabled}` to disable");
            let hint = format!("the features are {}", known.join(", "));
            return Err(study.error(("features", "disable"), message, hint).into());
        }
    }
    let context = FeatureContext { windows_secs: settings.windows_secs.clone() };
    let mut enabled = Vec::new();
    for entry in FEATURES {
        // What is disabled is built, too: a mistake in its settings is one all the same.
        let built = (entry.build)(study.feature(entry.kind)?, &context);
        let feature = built.map_err(|error| study.wrong_feature(entry.kind, error))?;
        if settings.disable.iter().all(|disabled| disabled != entry.kind) {
            enabled.push(Arc::from(feature));
        }
    }
    Ok(enabled)
}

/// What the sinks of a session are built with.
pub fn sink_context(study: &Study, bag: &Path, clock: &Clock) -> SinkContext {
    SinkContext {
        bag: bag.to_owned(),
        session: study.general.session.name.clone(),
        study: study.text().to_owned(),
        clock: clock.clone(),
        bag_ended: Ended::default(),
        damage: None,
    }
}

/// The tidy files of a bag: as the study sets them, or by default; none where it leaves them out.
pub fn tidy(study: &Study, context: &SinkContext) -> Result<Option<Box<dyn Sink>>, Failure> {
    let bags: Vec<Bag> = study.settings_of("sinks", "bag")?;
    let own: Vec<Tidy> = study.settings_of("sinks", "tidy")?;
    if own.is_empty() && bags.iter().any(|bag| !bag.tidy) {
        return Ok(None);
    }
    let tidy = own.into_iter().next().unwrap_or_default().build(context);
    tidy.map(Some).map_err(|error| study.error(("sinks", ""), error.message, error.hint).into())
}

/// The folder of a session's bag: `OUT/<name>_<UTC>`, and a number behind it where that is taken.
pub fn bag_folder(out: &Path, session: &str) -> PathBuf {
    let now = clock::wall().to_string();
    let utc: String = now[..19].chars().filter(char::is_ascii_alphanumeric).collect();
    let name = format!("{session}_{utc}Z");
    let numbered = (2..).map(|number| out.join(format!("{name}_{number}")));
    let mut folders = std::iter::once(out.join(&name)).chain(numbered);
    folders.find(|folder| !folder.exists()).expect("there are more numbers than folders")
}

/// The exit code of a session that has ended, with what went wrong said on standard error.
pub fn conclude(outcome: Outcome) -> Exit {
    let mut exit = Exit::Fine;
    if outcome.dropped > 0 {
        eprintln!("error: {} samples were dropped in our own queue", outcome.dropped);
        exit = Exit::DataLost;
    }
    for (name, error) in outcome.sinks {
        let (hint, code) = match &error {
            teampulse_core::sink::SinkError::Lost { hint, .. } => (hint.clone(), Exit::DataLost),
            teampulse_core::sink::SinkError::Failed { hint, .. } => (hint.clone(), Exit::Failed),
        };
        Failure::new(format!("{name}: failed to {error}")).hint(hint).show();
        exit = if exit == Exit::Failed { exit } else { code };
    }
    for (name, error) in outcome.sources {
        Failure::new(format!("{name}: failed to {error}")).show();
        exit = Exit::Failed;
    }
    exit
}
