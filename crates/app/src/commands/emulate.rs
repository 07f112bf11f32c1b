//! `teampulse emulate`: runs only the emulated wearables of a study, on their transports.

use std::path::{Path, PathBuf};

use clap::Args;
use teampulse_core::clock::Clock;
use teampulse_sources::emulated::{EmulatedWearable, Emulation, Wardrobe, bluetooth};
use teampulse_sources::simulated::SimulatedTeam;
use tokio::task::JoinSet;

use crate::commands::run::seconds;
use crate::commands::simulate::team;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::{line, say};
use crate::stop::Stop;
use crate::study::Study;

/// Runs only the emulated wearables of a study, each on its own transport, worn by the simulated people.
///
/// Reads the tables [[simulate.wearables]] of the study. Prints each device, its address, and the lines of a study that
/// read the device.
#[derive(Debug, Args)]
pub struct Emulate {
    /// The study
    study: PathBuf,
    /// Ends after this many seconds
    #[arg(long, value_name = "SECS", value_parser = seconds)]
    duration: Option<f64>,
    /// The seed of all random numbers, instead of the study's
    #[arg(long)]
    seed: Option<u64>,
}

impl Emulate {
    /// Runs the command.
    pub async fn run(self) -> Result<Exit, Failure> {
        let study = Study::read(&self.study)?;
        let mut team = team(&study)?.unwrap_or_default();
        if team.wearables.is_empty() {
            let lacking = "it has no table [[simulate.wearables]]";
            let hint = "add one, such as `type = \"shimmer3\"` with `person = \"p001\"`";
            return Err(study.error(("simulate", ""), lacking, hint).into());
        }
        team.seed = self.seed.unwrap_or(team.seed);
        let stopped = Stop::default().asked(Clock::host(), self.duration);
        let wardrobe = wardrobe(&team)?;
        let mut served = Served::open(&wardrobe, &team.wearables, None).await?;
        say("emulating wearables; Ctrl-C ends it");
        let ended = tokio::select! {
            () = stopped => Ok(Exit::Fine),
            failure = served.fail() => Err(failure),
        };
        served.close().await;
        ended
    }
}

/// Running wearables.
pub struct Served(JoinSet<std::io::Result<()>>);

impl Served {
    /// Starts wearables on their transports and prints how to reach them. If a folder is given, it holds the socket of
    /// their D-Bus, `bus`.
    pub async fn open(
        wardrobe: &Wardrobe,
        wearables: &[EmulatedWearable],
        folder: Option<&Path>,
    ) -> Result<Served, Failure> {
        let mut serving = JoinSet::new();
        let (radios, others): (Vec<_>, Vec<_>) =
            wearables.iter().partition(|wearable| wearable.is_bluetooth());
        // Nothing is printed until all are open.
        let mut emulations = Vec::new();
        for wearable in others {
            emulations.push(open(wearable, wardrobe).await?);
        }
        if !radios.is_empty() {
            let emulation = bluetooth::open(&radios, wardrobe, folder).await;
            emulations.push(emulation.map_err(|error| Failure::new(error.to_string()))?);
        }
        emulations.iter().for_each(show);
        if let Some(radio) = emulations.last().filter(|_| !radios.is_empty()) {
            say(format!("before `teampulse run`, enter in its terminal: export {}", radio.address));
        }
        for emulation in emulations {
            serving.spawn(emulation.serving);
        }
        Ok(Served(serving))
    }

    /// Waits until one of the devices fails; never returns otherwise.
    pub async fn fail(&mut self) -> Failure {
        let Some(ended) = self.0.join_next().await else { return std::future::pending().await };
        let ended = ended.unwrap_or_else(|error| Err(std::io::Error::other(error)));
        let why = ended.err().map_or_else(|| "it ended".into(), |error| error.to_string());
        Failure::to(format!("serve a device: {why}"))
    }

    /// Closes the ports, links and buses of the devices.
    pub async fn close(mut self) {
        self.0.shutdown().await;
    }
}

/// Returns the simulated people who wear these devices.
pub fn wardrobe(team: &SimulatedTeam) -> Result<Wardrobe, Failure> {
    Wardrobe::of(team, &team.wearables).map_err(|error| {
        Failure::new(error.to_string()).hint("name one of them as `person`").exit(Exit::BadStudy)
    })
}

async fn open(wearable: &EmulatedWearable, wardrobe: &Wardrobe) -> Result<Emulation, Failure> {
    wearable.open(wardrobe).await.map_err(|error| {
        let failure = Failure::to(format!("start a device of {}: {error}", wearable.person()));
        failure.hint("is its `port` in use? choose another one")
    })
}

fn show(Emulation { device, address, study, .. }: &Emulation) {
    line(format!("# {device} at {address}\n{study}\n"));
}
