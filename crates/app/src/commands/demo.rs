//! `teampulse demo`: everything at once, on this machine alone.

use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::Arc;

use async_trait::async_trait;
use clap::Args;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::{Source, SourceError};
use tokio::io::AsyncWriteExt;
use tokio::process::{Child, Command};
use tokio::sync::Mutex;

use crate::commands::run::{seconds, watch};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::network;
use crate::output::say;
use crate::setup::{Setup, Sources};
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
        let started = start_simulator(self.seed).await;
        let started =
            started.map_err(|error| Failure::to(format!("start the simulator: {error}")))?;
        say(format!(
            "a simulated operator and five robots publish on ROS 2 domain {DOMAIN} of this machine;\n\
             from the second minute on there is work to do, and something goes wrong;\n\
             a letter sets a marker, q ends;\n\
             its topics, from another terminal with ROS 2:\n  {}\n",
            topics_command(DOMAIN)
        ));
        let setup = Setup::new(study, network::buses_of_demo("teampulse", DOMAIN)).await?;
        let process = Arc::new(Mutex::new(Some(started)));
        let simulator = Simulator { seed: self.seed, process: Arc::clone(&process) };
        let beside: Sources = vec![("simulator".into(), Box::new(simulator))];
        let ended = watch(setup, beside, self.duration, self.out).await;
        // Last of all, or the end of the session would show a team that falls silent.
        end(process.try_lock().ok().and_then(|mut process| process.take())).await;
        ended
    }
}

/// What shows the topics of a domain that stays on this machine with the tools of ROS 2. Without the
/// daemon, which has joined the domain of whoever asked first.
fn topics_command(domain: u32) -> String {
    format!(
        "ROS_DOMAIN_ID={domain} ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST ros2 topic list --no-daemon"
    )
}

/// The process with the operator and the robots: says when it dies, and is then started again.
struct Simulator {
    seed: u64,
    /// `None` while none runs. Held by whoever waits for its end.
    process: Arc<Mutex<Option<Child>>>,
}

#[async_trait]
impl Source for Simulator {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let gone = |message| SourceError::Gone { message, hint: String::new() };
        let mut process = self.process.lock().await;
        let simulator = match &mut *process {
            Some(running) => running,
            none => {
                let started = start_simulator(self.seed).await;
                none.insert(started.map_err(|error| gone(format!("start it: {error}")))?)
            }
        };
        let ended = tokio::select! {
            () = outlet.closed() => return Ok(()),
            ended = simulator.wait() => ended,
        };
        *process = None;
        let how = ended.map_or_else(|error| error.to_string(), |ended| ended.to_string());
        Err(gone(format!("go on: its process ended ({how})")))
    }
}

async fn end(simulator: Option<Child>) {
    let Some(mut simulator) = simulator else { return };
    if let Err(error) = simulator.kill().await {
        tracing::warn!("failed to end the simulator: {error}");
    }
}

/// Starts this program once more, as the operator and the robots; it reads the study from its standard
/// input.
///
/// Ctrl-C in the terminal does not reach it: it lives until it is ended here, or, by the kernel, with
/// this process: with the thread that starts it, to be exact, and all that do live as long.
async fn start_simulator(seed: u64) -> std::io::Result<Child> {
    let mut simulator = Command::new(std::env::current_exe()?)
        .args(["simulate", "-", "--with-parent", &std::process::id().to_string()])
        .args(["--seed", &seed.to_string()])
        .args(["--domain", &DOMAIN.to_string()])
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        .stdin(Stdio::piped())
        .stderr(Stdio::null())
        .process_group(0)
        .kill_on_drop(true)
        .spawn()?;
    if let Some(mut stdin) = simulator.stdin.take() {
        stdin.write_all(STUDY.as_bytes()).await?;
    }
    Ok(simulator)
}
