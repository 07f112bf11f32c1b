//! `teampulse simulate`: the simulated robots of a study alone, on ROS.

use std::path::PathBuf;

use clap::Args;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::registry::Component;
use teampulse_core::session::{Pace, Session};
use teampulse_core::streams::Streams;
use teampulse_messages::convert::encode;
use teampulse_ros::sink::{Publish, RosSink};
use teampulse_sources::SourceContext;
use teampulse_sources::simulated::SimulatedTeam;

use crate::commands::run::seconds;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::network;
use crate::setup::conclude;
use crate::stop::Stop;
use crate::study::Study;

/// Runs the simulated robots of a study alone, on ROS.
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
        team.seed = self.seed.unwrap_or(team.seed);
        simulate(team, self.domain, self.duration).await
    }
}

/// Runs a simulated team until it ends or is asked to stop.
async fn simulate(
    team: SimulatedTeam,
    domain: Option<u32>,
    duration_secs: Option<f64>,
) -> Result<Exit, Failure> {
    let buses = network::buses("teampulse_simulator");
    let domain = domain.map_or_else(|| network::default_domain(&buses), Ok)?;
    let bus = buses.get(domain).map_err(Failure::to)?;
    let robots = team.robots;
    let fast = (team.speed - 1.0).abs() > f64::EPSILON;
    let clock = if fast { Clock::told() } else { Clock::host() };
    let context = SourceContext { clock: clock.clone(), buses };
    let source = team.build(&context).map_err(|error| Failure::new(error.message))?;
    let mut sink = RosSink::lossless(bus, Publish::Raw);
    if fast {
        sink = sink.with_clock();
    }
    eprintln!("simulating {robots} robots on ROS domain {domain}; Ctrl-C ends it");
    let session = Session {
        clock: clock.clone(),
        pace: Pace::Live,
        clocks: Clocks::as_stamped(),
        streams: Streams::default(),
        sources: vec![("simulation".into(), source)],
        features: Vec::new(),
        sinks: vec![Box::new(sink)],
        encode,
    };
    Ok(conclude(session.run(Stop::default().asked(clock, duration_secs)).await))
}
