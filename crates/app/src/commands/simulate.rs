//! `teampulse simulate`: the simulated robots and people of a study alone, on ROS.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::registry::Component;
use teampulse_core::session::{Pace, Session};
use teampulse_core::sink::Sink;
use teampulse_core::streams::Streams;
use teampulse_messages::convert::encode;
use teampulse_ros::bus::Bus;
use teampulse_ros::sink::{Publish, RosSink};
use teampulse_sources::SourceContext;
use teampulse_sources::simulated::{SimulatedPerson, SimulatedTeam};

use crate::commands::run::seconds;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::network;
use crate::setup::conclude;
use crate::stop::Stop;
use crate::study::Study;

/// What is published of people: a study that asks for simulated ones has nobody to protect. With what
/// their streams are.
const OF_PEOPLE: [&str; 2] = ["/humans/persons/**", "/teampulse/streams"];

/// Runs the simulated robots and people of a study alone, on ROS.
///
/// Reads the table [simulate] of the study. At a speed other than 1 it publishes /clock.
#[derive(Debug, Args)]
pub struct Simulate {
    /// The study
    study: PathBuf,
    /// Ends by itself after so many seconds of simulated time
    #[arg(long, value_name = "SECS", value_parser = seconds)]
    duration: Option<f64>,
    /// The seed of all that is random, instead of the study's
    #[arg(long)]
    seed: Option<u64>,
    /// The ROS domain; without it that of `ROS_DOMAIN_ID`, else 0
    #[arg(long, value_name = "ID")]
    domain: Option<u32>,
    /// How far the clock of the robots' computer is ahead of the true time [s]
    #[arg(long, value_name = "SECS", default_value_t = 0.0, value_parser = any_number)]
    #[arg(allow_negative_numbers = true)]
    clock_offset: f64,
    /// How much too fast that clock runs [ppm]
    #[arg(long, value_name = "PPM", default_value_t = 0.0, value_parser = skew)]
    #[arg(allow_negative_numbers = true)]
    clock_skew_ppm: f64,
}

/// A number of seconds that a clock may be off.
fn any_number(text: &str) -> Result<f64, String> {
    number(text, 1e8).ok_or_else(|| format!("`{text}` is not a number of seconds below 100000000"))
}

/// A skew that a clock may have.
fn skew(text: &str) -> Result<f64, String> {
    number(text, 1e5).ok_or_else(|| format!("`{text}` is not a skew of less than 100000 ppm"))
}

fn number(text: &str, most: f64) -> Option<f64> {
    text.parse().ok().filter(|number: &f64| number.abs() <= most)
}

impl Simulate {
    /// Does it.
    pub async fn run(self) -> Result<Exit, Failure> {
        let study = Study::read(&self.study)?;
        let team: Option<SimulatedTeam> = study.settings("simulate")?;
        let mut team = team.ok_or_else(|| {
            study.error(
                ("simulate", ""),
                "it has no table [simulate]",
                "add one; `teampulse schema` tells its keys",
            )
        })?;
        team.check().map_err(|error| {
            let path = format!("simulate.{}", error.path);
            study.misplaced(error.at(path))
        })?;
        team.seed = self.seed.unwrap_or(team.seed);
        let off = self.clock_offset != 0.0 || self.clock_skew_ppm != 0.0;
        if off && is_fast(&team) {
            let message = "a clock can't be off in simulated time, which all computers share";
            return Err(Failure::new(message)
                .hint("leave out `speed`, or --clock-offset and --clock-skew-ppm")
                .exit(Exit::BadArguments));
        }
        self.simulate(team).await
    }
}

/// Whether a team is simulated faster or slower than real time.
fn is_fast(team: &SimulatedTeam) -> bool {
    (team.speed - 1.0).abs() > f64::EPSILON
}

impl Simulate {
    /// Runs a simulated team until it ends or is asked to stop.
    async fn simulate(&self, mut team: SimulatedTeam) -> Result<Exit, Failure> {
        let host = Clock::host_off(self.clock_offset, self.clock_skew_ppm);
        let buses = network::buses_telling("teampulse_simulator", host.clone());
        let domain = self.domain.map_or_else(|| network::default_domain(&buses), Ok)?;
        let bus = buses.get(domain).map_err(Failure::to)?;
        let (robots, people) = (team.robots, team.people);
        let fast = is_fast(&team);
        // What is due by a clock that runs fast is due sooner.
        team.speed *= 1.0 + self.clock_skew_ppm * 1e-6;
        let clock = if fast { Clock::told() } else { host.clone() };
        let context = SourceContext { clock: clock.clone(), buses };
        let mut sources = SimulatedPerson::of(&team);
        let robotic = team.build(&context).map_err(|error| Failure::new(error.message))?;
        sources.push(("simulation".into(), robotic));
        let sinks = sinks(&bus, fast, &host, people);
        let and_people = match people {
            0 => String::new(),
            1 => " and a person".into(),
            _ => format!(" and {people} people"),
        };
        eprintln!("simulating {robots} robots{and_people} on ROS domain {domain}; Ctrl-C ends it");
        let session = Session {
            clock: clock.clone(),
            pace: Pace::Live,
            clocks: Clocks::as_stamped(),
            streams: Streams::default(),
            sources,
            features: Vec::new(),
            sinks,
            encode,
        };
        Ok(conclude(session.run(Stop::default().asked(clock, self.duration)).await))
    }
}

/// What publishes: the robots, and the people where there are any. The clock is told once.
fn sinks(bus: &Arc<dyn Bus>, fast: bool, host: &Clock, people: u32) -> Vec<Box<dyn Sink>> {
    let publishing = |publish| {
        let sink = RosSink::lossless(Arc::clone(bus), publish);
        if fast { sink } else { sink.stamped_by(host.clone()) }
    };
    let robotic = publishing(Publish::Raw);
    let mut sinks: Vec<Box<dyn Sink>> =
        vec![Box::new(if fast { robotic.with_clock() } else { robotic })];
    if people > 0 {
        let named = OF_PEOPLE.map(str::to_owned).to_vec();
        sinks.push(Box::new(publishing(Publish::Named(named))));
    }
    sinks
}
