//! `teampulse demo`: shows everything at once, on this machine alone.

mod worn;

use std::io::ErrorKind;
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use clap::Args;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::{Source, SourceError};
use teampulse_sinks::{Addresses, Announce};
use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader};
use tokio::process::{Child, Command};
use tokio::sync::Mutex;
use tokio::time::timeout;

use crate::commands::run::{seconds, watch};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::network;
use crate::output::say;
use crate::setup::{Setup, Sources};
use crate::study::Study;

use worn::Worn;

/// The study of the demo, as in `studies/`.
const STUDY: &str = include_str!("../../../../studies/demo.toml");
/// The ROS domain of the demo, away from those in common use. If another demo uses it, the next free domain is taken.
const DOMAIN: u32 = 77;
/// The last domain of a demo. Above 101, the ports of a domain overlap with the ephemeral ports of the
/// system.
const LAST_DOMAIN: u32 = 101;
/// How long to wait until the operator's devices can be reached.
const PATIENCE: Duration = Duration::from_secs(10);

/// Shows everything at once: a simulated operator and five robots in a separate process, on real ROS 2 topics,
/// monitored and recorded. The operator's heart, muscles and skin are measured by emulated devices (Polar H10, Myo,
/// Shimmer3) on a separate D-Bus and serial port, read like real ones.
///
/// The operator rests for a minute, then does 1-, 2- and 3-back and commands robots now and then, while one robot after
/// another gets into trouble. All traffic stays on this machine (loopback, ROS domain 77, or the next one that no other
/// demo on this machine uses).
#[derive(Debug, Args)]
pub struct Demo {
    /// Ends after this many seconds; by default it ends on Ctrl-C, or on `q`, then `y`
    #[arg(long, value_name = "SECS", value_parser = seconds)]
    duration: Option<f64>,
    /// Where to create the bag's folder
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    out: PathBuf,
    /// The seed of all random numbers
    #[arg(long, default_value = "1")]
    seed: u64,
    /// Starts no dashboard in a browser
    #[arg(long)]
    no_dashboard: bool,
}

impl Demo {
    /// Runs the command.
    pub async fn run(self) -> Result<Exit, Failure> {
        let worn = Worn::choose().await;
        let worn = worn.map_err(|error| Failure::to(format!("create a folder: {error}")))?;
        let text = format!("{STUDY}{}", worn.study());
        let study = Study::parse(Path::new("studies/demo.toml"), text.clone())?;
        let taken = take_domain("teampulse_demo").ok_or_else(|| {
            Failure::new(format!(
                "demos are already running on all ROS domains from {DOMAIN} to {LAST_DOMAIN}"
            ))
            .hint("stop one of them")
        })?;
        let domain = taken.domain;
        if domain != DOMAIN {
            say(format!("another demo is running on ROS domain {DOMAIN} of this machine"));
        }
        let (folder, places) = (worn.folder(), worn.places());
        let simulation = Simulation { seed: self.seed, domain, study: text, folder, places };
        let started = simulation.start().await;
        let started =
            started.map_err(|error| Failure::to(format!("start the simulator: {error}")))?;
        say(format!(
            "a simulated operator and five robots publish on ROS 2 domain {domain} of this machine;\n\
             {}\n\
             from the second minute on, the robots need attention;\n\
             a letter sets a marker; q, then y ends;\n\
             to list the topics from another terminal with ROS 2:\n  {}\n",
            worn.words(),
            topics_command(domain)
        ));
        let setup = Setup::new(study, network::buses_of_demo("teampulse", domain)).await?;
        let mut setup = setup.with_bluetooth(worn.bluetooth());
        let opens: Announce = Arc::new(open_in_browser);
        setup.dashboard = setup.dashboard.filter(|_| !self.no_dashboard).map(|_| opens);
        let process = Arc::new(Mutex::new(Some(started)));
        let simulator = Simulator { simulation, process: Arc::clone(&process) };
        let beside: Sources = vec![("simulator".into(), Box::new(simulator))];
        let ended = watch(setup, beside, self.duration, self.out).await;
        // Stopped last: otherwise the recording would end with a team that falls silent.
        end(process.try_lock().ok().and_then(|mut process| process.take())).await;
        ended
    }
}

/// Opens the dashboard in a browser on a desktop; without a desktop, its address is on the terminal.
fn open_in_browser(addresses: &Addresses) {
    let has_desktop = ["DISPLAY", "WAYLAND_DISPLAY"]
        .iter()
        .any(|name| std::env::var_os(name).is_some_and(|display| !display.is_empty()));
    if !has_desktop {
        return;
    }
    let mut opener = std::process::Command::new("xdg-open");
    let opener = opener
        .arg(&addresses.here)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    match opener.spawn() {
        // The opener may exit at once or live as long as the browser: nothing depends on it.
        Ok(mut opener) => drop(std::thread::spawn(move || drop(opener.wait()))),
        Err(error) => tracing::info!("failed to open a browser: {error}"),
    }
}

/// A ROS domain that no other demo on this machine uses.
struct Taken {
    domain: u32,
    /// Reserves a name for the lifetime of this process in the network namespace of this machine, where DDS runs as
    /// well.
    _holds: Option<UnixListener>,
}

/// Takes the first domain that no other demo uses; `None` if all are taken.
fn take_domain(prefix: &str) -> Option<Taken> {
    (DOMAIN..=LAST_DOMAIN).find_map(|domain| match hold(&format!("{prefix}_{domain}")) {
        Ok(holds) => Some(Taken { domain, _holds: Some(holds) }),
        Err(error) if error.kind() == ErrorKind::AddrInUse => None,
        // Without support for such names, two demos may share a domain.
        Err(_) => Some(Taken { domain, _holds: None }),
    })
}

/// Reserves a name, which is released when this process ends for any reason.
#[cfg(target_os = "linux")]
fn hold(name: &str) -> std::io::Result<UnixListener> {
    use std::os::linux::net::SocketAddrExt;
    use std::os::unix::net::SocketAddr;
    UnixListener::bind_addr(&SocketAddr::from_abstract_name(name)?)
}

#[cfg(not(target_os = "linux"))]
fn hold(_: &str) -> std::io::Result<UnixListener> {
    Err(ErrorKind::Unsupported.into())
}

/// Returns the command that lists the topics of a local domain with the ROS 2 tools. It runs without the ROS daemon,
/// which stays on the domain of the user who started it.
fn topics_command(domain: u32) -> String {
    format!(
        "ROS_DOMAIN_ID={domain} ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST ros2 topic list --no-daemon"
    )
}

/// The process with the operator and the robots; if it dies, a fault is reported and it is restarted.
struct Simulator {
    simulation: Simulation,
    /// `None` while no process runs; locked while waiting for the process to end.
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
                let started = self.simulation.start().await;
                none.insert(started.map_err(|error| gone(format!("start it: {error}")))?)
            }
        };
        let ended = tokio::select! {
            () = outlet.closed() => return Ok(()),
            ended = simulator.wait() => ended,
        };
        *process = None;
        let how = ended.map_or_else(|error| error.to_string(), |ended| ended.to_string());
        Err(gone(format!("continue: its process ended ({how})")))
    }
}

async fn end(simulator: Option<Child>) {
    let Some(mut simulator) = simulator else { return };
    if let Err(error) = simulator.kill().await {
        tracing::warn!("failed to stop the simulator: {error}");
    }
}

/// The process that simulates the operator and the robots.
struct Simulation {
    seed: u64,
    domain: u32,
    study: String,
    /// The folder with the sockets and ports of the operator's devices.
    folder: PathBuf,
    /// The number of sockets and ports that lead to these devices.
    places: usize,
}

impl Simulation {
    /// Starts this program again as the operator and the robots; it reads the study from its standard input. Returns
    /// when the operator's devices can be reached.
    ///
    /// Ctrl-C in the terminal does not reach it: it lives until it is killed here, or by the kernel when the thread
    /// that started it ends. All threads that start it live as long as this process.
    async fn start(&self) -> std::io::Result<Child> {
        let mut simulator = Command::new(std::env::current_exe()?)
            .args(["simulate", "-", "--with-parent", &std::process::id().to_string()])
            .args(["--seed", &self.seed.to_string()])
            .args(["--domain", &self.domain.to_string()])
            .arg("--wearables")
            .arg(&self.folder)
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .process_group(0)
            .kill_on_drop(true)
            .spawn()?;
        if let Some(mut stdin) = simulator.stdin.take() {
            stdin.write_all(self.study.as_bytes()).await?;
        }
        let up = timeout(PATIENCE, self.reached(&mut simulator)).await;
        let lacking = || std::io::Error::other("the operator's devices can't be reached");
        up.map_err(|_elapsed| lacking())??.then_some(simulator).ok_or_else(lacking)
    }

    /// Waits until the devices can be reached; returns whether they can.
    async fn reached(&self, simulator: &mut Child) -> std::io::Result<bool> {
        let Some(output) = simulator.stdout.take() else { return Ok(false) };
        let mut lines = BufReader::new(output).lines();
        for _ in 0..self.places {
            // Each device is printed as a comment with its address, followed by lines of a study.
            loop {
                let Some(line) = lines.next_line().await? else { return Ok(false) };
                if line.starts_with("# ") {
                    break;
                }
            }
        }
        // Read to its end: a simulator whose output is no longer read would exit.
        drop(tokio::spawn(async move { while let Ok(Some(_)) = lines.next_line().await {} }));
        Ok(true)
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn each_demo_on_a_machine_has_its_own_domain() {
        // Names used by this test only, since a demo may be running at the same time.
        let prefix = format!("teampulse_test_{}", std::process::id());
        let domain = |taken: &Option<Taken>| taken.as_ref().map(|taken| taken.domain);
        let first = take_domain(&prefix);
        let second = take_domain(&prefix);
        assert_eq!((domain(&first), domain(&second)), (Some(DOMAIN), Some(DOMAIN + 1)));
        drop(first);
        assert_eq!(domain(&take_domain(&prefix)), Some(DOMAIN));
        let all: Vec<Taken> = std::iter::from_fn(|| take_domain(&prefix)).collect();
        assert_eq!(all.len() as u32, LAST_DOMAIN - DOMAIN, "the second is still taken");
    }
}
