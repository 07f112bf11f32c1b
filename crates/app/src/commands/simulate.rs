//! `teampulse simulate`: runs only the simulated robots and people of a study, on ROS.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use clap::Args;
use rustix::process::Signal;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::counted::counted;
use teampulse_core::pattern::Pattern;
use teampulse_core::session::{Pace, Session};
use teampulse_core::sink::Sink;
use teampulse_core::streams::Streams;
use teampulse_messages::convert::encode;
use teampulse_ros::BusId;
use teampulse_ros::bus::Bus;
use teampulse_ros::sink::{Publish, RosSink};
use teampulse_sources::emulated::Wardrobe;
use teampulse_sources::simulated::{SimulatedPerson, SimulatedTeam};

use crate::commands::emulate::{Served, wardrobe};
use crate::commands::run::seconds;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::network;
use crate::outcome::conclude;
use crate::output::say;
use crate::stop::Stop;
use crate::study::{SessionClock, Study, StudyError};

/// The published streams of simulated people: all of them, and their descriptions, since there is no privacy to
/// protect.
const OF_PEOPLE: [&str; 2] = ["/humans/persons/**", "/teampulse/streams"];
/// How often to check whether the parent process is alive.
const LOOK: Duration = Duration::from_millis(200);

/// Runs only the simulated robots and people of a study, on ROS.
///
/// Reads the table [simulate] of the study. Publishes /clock if the speed is not 1, or if the session's clock is
/// /clock.
#[derive(Debug, Args)]
pub struct Simulate {
    /// The study
    study: PathBuf,
    /// Ends after this many seconds of simulated time
    #[arg(long, value_name = "SECS", value_parser = seconds)]
    duration: Option<f64>,
    /// The seed of all random numbers, instead of the study's
    #[arg(long)]
    seed: Option<u64>,
    /// The ROS domain, or another bus as KIND:ADDRESS; by default the one of the study's session, or the domain of
    /// `ROS_DOMAIN_ID`, else 0
    #[arg(long, value_name = "ID")]
    domain: Option<BusId>,
    /// How far the clock of the robots' computer is ahead of the true time [s]
    #[arg(long, value_name = "SECS", default_value_t = 0.0, value_parser = any_number)]
    clock_offset: f64,
    /// How much too fast that clock runs [ppm]
    #[arg(long, value_name = "PPM", default_value_t = 0.0, value_parser = skew)]
    clock_skew_ppm: f64,
    /// Also serves the wearables of the study, as `emulate` does, with the D-Bus of Bluetooth wearables in this folder;
    /// what they measure is then not published on ROS
    #[arg(long, value_name = "DIR")]
    wearables: Option<PathBuf>,
    /// Ends when the process that started it ends
    #[arg(long, value_name = "PID", hide = true)]
    with_parent: Option<i32>,
}

/// Parses a number of seconds by which a clock may be off.
fn any_number(text: &str) -> Result<f64, String> {
    number(text, 1e8).ok_or_else(|| format!("`{text}` is not a number of seconds below 100000000"))
}

/// Parses the skew of a clock.
fn skew(text: &str) -> Result<f64, String> {
    number(text, 1e5).ok_or_else(|| format!("`{text}` is not a skew of less than 100000 ppm"))
}

fn number(text: &str, most: f64) -> Option<f64> {
    text.parse().ok().filter(|number: &f64| number.abs() <= most)
}

impl Simulate {
    /// Runs the command.
    pub async fn run(self) -> Result<Exit, Failure> {
        if let Some(parent) = self.with_parent {
            end_with(parent)?;
        }
        let study = Study::read(&self.study)?;
        let mut team = team(&study)?.ok_or_else(|| {
            study.error(
                ("simulate", ""),
                "it has no table [simulate]",
                "add one; `teampulse schema` lists its keys",
            )
        })?;
        team.seed = self.seed.unwrap_or(team.seed);
        let off = self.clock_offset != 0.0 || self.clock_skew_ppm != 0.0;
        let time = time_of(&study, &team);
        if off && time == SessionClock::Simulated {
            let message =
                "a clock offset is not possible in simulated time, which all computers share";
            return Err(Failure::new(message)
                .hint("remove `speed` and `clock`, or --clock-offset and --clock-skew-ppm")
                .exit(Exit::BadArguments));
        }
        let domain = self.domain.clone().or(study.general.session.domain.clone());
        self.simulate(team, time, domain).await
    }
}

/// Reads the simulated team of a study, if it has one.
pub fn team(study: &Study) -> Result<Option<SimulatedTeam>, StudyError> {
    let team: Option<SimulatedTeam> = study.settings("simulate")?;
    if let Some(team) = &team {
        team.check().map_err(|error| {
            let path = format!("simulate.{}", error.path);
            study.misplaced(error.at(path))
        })?;
    }
    Ok(team)
}

/// Returns which clock is used: a simulated one if it runs faster or slower than real time, or if the study's session
/// would wait for /clock.
fn time_of(study: &Study, team: &SimulatedTeam) -> SessionClock {
    let is_real = (team.speed - 1.0).abs() <= f64::EPSILON;
    if is_real { study.general.session.clock } else { SessionClock::Simulated }
}

/// Asks the kernel to send SIGTERM when the parent process ends for any reason.
fn end_with(parent: i32) -> Result<(), Failure> {
    let asked = rustix::process::set_parent_process_death_signal(Some(Signal::TERM));
    asked.map_err(|error| Failure::to(format!("end with its parent: {error}")))?;
    // The parent may have ended before that.
    let lives = is_child_of(parent);
    if lives { Ok(()) } else { Err(Failure::new("the process that started this one has ended")) }
}

/// Waits until the parent process has ended; forever if there is none.
async fn gone(parent: Option<i32>) {
    let Some(parent) = parent else { return std::future::pending().await };
    while is_child_of(parent) {
        tokio::time::sleep(LOOK).await;
    }
}

fn is_child_of(parent: i32) -> bool {
    rustix::process::getppid().is_some_and(|pid| pid.as_raw_nonzero().get() == parent)
}

impl Simulate {
    /// Runs a simulated team until it ends or is asked to stop.
    async fn simulate(
        &self,
        mut team: SimulatedTeam,
        time: SessionClock,
        domain: Option<BusId>,
    ) -> Result<Exit, Failure> {
        let host = Clock::host_off(self.clock_offset, self.clock_skew_ppm);
        let buses = network::buses_with_clock("teampulse_simulator", host.clone());
        let domain = domain.map_or_else(|| network::default_bus(&buses), Ok)?;
        let bus = buses.get(&domain)?;
        let (robots, people) = (team.robots, team.people);
        let is_simulated = time == SessionClock::Simulated;
        // By a clock that runs fast, deadlines come sooner.
        team.speed *= 1.0 + self.clock_skew_ppm * 1e-6;
        let clock = if is_simulated { Clock::settable() } else { host.clone() };
        let wardrobe = self.wearables.is_some().then(|| wardrobe(&team)).transpose()?;
        let mut sources = match &wardrobe {
            Some(worn) => SimulatedPerson::wearing(&team, &team.wearables, Some(worn.clock())),
            None => SimulatedPerson::of(&team),
        };
        let served = self.serve(&team, wardrobe.as_ref(), is_simulated).await?;
        let robotic = team.build().map_err(|error| Failure::new(error.message))?;
        sources.push(("simulation".into(), robotic));
        let sinks = sinks(&bus, time, &host, people);
        let and_people = match people {
            0 => String::new(),
            1 => " and a person".into(),
            _ => format!(" and {people} people"),
        };
        say(format!(
            "simulating {}{and_people} on {domain}; Ctrl-C ends it",
            counted(robots, "robot", "robots")
        ));
        let session = Session {
            clock: clock.clone(),
            pace: Pace::Live,
            clocks: Clocks::as_stamped(),
            streams: Streams::default(),
            sources,
            features: Vec::new(),
            sinks,
            workers: Vec::new(),
            encode,
            commands: Commands::default(),
        };
        let running = Stop::default().run(session, clock, self.duration);
        let Some(mut served) = served else { return Ok(conclude(running.await)) };
        let ended = tokio::select! {
            outcome = running => Ok(Some(outcome)),
            failure = served.fail() => Err(failure),
            // On return, its publishers would wait for subscriptions of a process that was killed.
            () = gone(self.with_parent) => Ok(None),
        };
        served.close().await;
        if let (Some(folder), Some(parent)) = (&self.wearables, self.with_parent)
            && !is_child_of(parent)
        {
            // The process that created it can't remove it any more.
            drop(std::fs::remove_dir_all(folder));
        }
        // Printed last: if nobody reads the output, printing ends the process.
        Ok(ended?.map_or(Exit::Fine, conclude))
    }

    /// Serves the wearables, if requested, on the clock of the people who wear them.
    async fn serve(
        &self,
        team: &SimulatedTeam,
        wardrobe: Option<&Wardrobe>,
        is_simulated: bool,
    ) -> Result<Option<Served>, Failure> {
        let Some((folder, wardrobe)) = self.wearables.as_ref().zip(wardrobe) else {
            return Ok(None);
        };
        if is_simulated {
            let failure = Failure::new("wearables run in real time, not by /clock");
            let failure = failure.hint("remove `speed` and `clock`, or --wearables");
            return Err(failure.exit(Exit::BadArguments));
        }
        std::fs::create_dir_all(folder)
            .map_err(|error| Failure::to(format!("create {}: {error}", folder.display())))?;
        Served::open(wardrobe, &team.wearables, Some(folder)).await.map(Some)
    }
}

/// Creates the sinks that publish the robots, and the people if there are any. Only the first publishes /clock.
fn sinks(bus: &Arc<dyn Bus>, time: SessionClock, host: &Clock, people: u32) -> Vec<Box<dyn Sink>> {
    let is_simulated = time == SessionClock::Simulated;
    let publishing = |publish| {
        let sink = RosSink::lossless(Arc::clone(bus), publish);
        if is_simulated { sink } else { sink.stamped_by(host.clone()) }
    };
    let robotic = publishing(Publish::Raw);
    let mut sinks: Vec<Box<dyn Sink>> =
        vec![Box::new(if is_simulated { robotic.with_clock() } else { robotic })];
    if people > 0 {
        let named = OF_PEOPLE.map(|text| Pattern::parse(text).expect("a pattern")).to_vec();
        sinks.push(Box::new(publishing(Publish::Named(named))));
    }
    sinks
}
