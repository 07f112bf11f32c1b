//! `teampulse demo`: everything at once, on this machine alone.

use std::path::{Path, PathBuf};
use std::process::Stdio;

use clap::Args;
use tokio::io::AsyncWriteExt;
use tokio::process::{Child, Command};

use crate::commands::run::{seconds, watch};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::network;
use crate::setup::Setup;
use crate::study::Study;

/// The study of the demo, as it stands in `studies/`.
const STUDY: &str = include_str!("../../../../studies/demo.toml");
/// The ROS domain of the demo, far from those that people use.
const DOMAIN: u32 = 77;

/// Shows everything at once: a simulated operator with five robots in a process of their own, on real
/// ROS 2 topics, monitored and recorded.
///
/// The operator rests for a minute, then does 1-, 2- and 3-back and commands robots now and then, while
/// one after another robot has its trouble. Stays on this machine (loopback, ROS domain 77).
#[derive(Debug, Args)]
pub struct Demo {
    /// Ends by itself after so many seconds; without it on Ctrl-C or `q`
    #[arg(long, value_name = "SECS", value_parser = seconds)]
    duration: Option<f64>,
    /// Where the bag's folder is made
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    out: PathBuf,
    /// The seed of all that is random
    #[arg(long, default_value = "1")]
    seed: u64,
}

impl Demo {
    /// Does it.
    pub async fn run(self) -> Result<Exit, Failure> {
        let study = Study::parse(Path::new("studies/demo.toml"), STUDY.to_owned())?;
        let mut simulator = start_simulator(self.seed).await?;
        eprintln!(
            "a simulated operator and five robots publish on ROS 2 domain {DOMAIN} of this machine;\n\
             from the second minute on there is work to do, and something goes wrong;\n\
             a letter sets a marker, q ends\n"
        );
        let setup = Setup::new(study, network::buses_of_demo("teampulse", DOMAIN)).await?;
        let exit = watch(setup, self.duration, self.out).await?;
        // It was asked to end by the same Ctrl-C, or is ended here.
        if let Err(error) = simulator.kill().await {
            tracing::warn!("failed to end the simulator: {error}");
        }
        Ok(exit)
    }
}

/// Starts this program once more, as the operator and the robots; it reads the study from its standard input.
async fn start_simulator(seed: u64) -> Result<Child, Failure> {
    let failed = |error| Failure::new(format!("failed to start the simulator: {error}"));
    let mut simulator = Command::new(std::env::current_exe().map_err(failed)?)
        .args(["simulate", "-", "--seed", &seed.to_string(), "--domain", &DOMAIN.to_string()])
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        .stdin(Stdio::piped())
        .stderr(Stdio::null())
        .kill_on_drop(true)
        .spawn()
        .map_err(failed)?;
    if let Some(mut stdin) = simulator.stdin.take() {
        stdin.write_all(STUDY.as_bytes()).await.map_err(failed)?;
    }
    Ok(simulator)
}
