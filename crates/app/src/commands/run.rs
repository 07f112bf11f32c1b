//! `teampulse run`: monitors and records a real team.

use std::path::{Path, PathBuf};

use clap::Args;
use teampulse_core::clock::Stopwatch;

use crate::absent::Absent;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::folder::holds_something;
use crate::network;
use crate::outcome::conclude;
use crate::output::{last_line, pasted, say};
use crate::setup::{Parts, Setup, Sources};
use crate::stop::Stop;
use crate::study::Study;
use crate::supplies::Unsupplied;
use crate::tidied::{SUMMARY, write_tidy_files};

/// Monitors and records a real team.
///
/// While it runs: a letter or digit sets a marker, the space bar sets a marker named `mark`; `q`, then `y`, ends the
/// session (`q` alone if nothing is recorded); Ctrl-N starts the next phase, Ctrl-R repeats a phase, Ctrl-X aborts it;
/// Ctrl-P stops or starts the recording, and Ctrl-K also saves the last seconds before a recording starts; the arrow
/// keys scroll the team, Page Up and Page Down the log.
#[derive(Debug, Args)]
pub struct Run {
    /// The study: which sources to record, which features to compute, which sinks to write
    study: PathBuf,
    /// Ends after this many seconds of the session's clock
    #[arg(long, value_name = "SECS", value_parser = crate::commands::run::seconds)]
    duration: Option<f64>,
    /// Where to create the bag's folder
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    out: PathBuf,
    /// Starts no dashboard in a browser
    #[arg(long)]
    no_dashboard: bool,
}

impl Run {
    /// Runs the command.
    pub async fn run(self) -> Result<Exit, Failure> {
        let study = Study::read(&self.study)?;
        let messages = study.general.session.messages.clone();
        let buses = network::buses_with_messages("teampulse", messages.as_deref());
        let mut setup = Setup::new(study, buses).await?;
        setup.dashboard = setup.dashboard.filter(|_| !self.no_dashboard);
        watch(setup, Vec::new(), self.duration, self.out).await
    }
}

/// Runs a whole study, with extra sources, until asked to stop.
pub async fn watch(
    setup: Setup,
    beside: Sources,
    duration_secs: Option<f64>,
    out: PathBuf,
) -> Result<Exit, Failure> {
    let stop = Stop::default();
    let room = setup.room(&out);
    if let Some(reason) = room.unfit {
        return Err(Failure::new(format!("nothing can be recorded: {reason}"))
            .hint("give another folder with --out"));
    }
    if let Some(reason) = room.unfit_fallback {
        return Err(Failure::new(reason).hint("set `fallback` to another folder, or remove it"));
    }
    if let Some(instead) = room.instead {
        say(format!("note: {instead}"));
    }
    let out = room.folder;
    if let Ok(target) = std::fs::read_link(&out) {
        say(format!("{} is a link: the recording is in {}", out.display(), target.display()));
    }
    let (sources, features) = (setup.sources()?, setup.features()?);
    if sources.is_empty() {
        return Err(setup.without("sources", "nothing is watched").into());
    }
    // Mistakes in sinks and workers are reported before a folder is created.
    drop((setup.sinks(&setup.bag_folder(&out))?, setup.workers()?));
    let claimed = setup.claim_folder(&out)?;
    let bag = claimed.path().to_owned();
    let (sinks, workers) = (setup.sinks(&bag)?, setup.workers()?);
    let mut parts = Parts { sources, features, sinks, workers };
    for note in setup.notes() {
        say(format!("note: {note}"));
    }
    parts.sources.extend(setup.attended()?);
    parts.sources.extend(beside);
    let (clock, ended) = (setup.clock.clone(), setup.bag_ended.clone());
    let (required, supplies) = (setup.requirements()?, setup.supplies.clone());
    let session = setup.session(parts);
    let streams = session.streams.clone();
    let watch = Stopwatch::start();
    let mut outcome = stop.run(session, clock, duration_secs).await;
    let unsupplied = Unsupplied { unopened: std::mem::take(&mut outcome.unopened), supplies };
    let exit = conclude(outcome);
    let absent = Absent::of(&required, &streams, &unsupplied, watch.elapsed());
    absent.show();
    let exit = if absent.is_empty() || exit != Exit::Fine { exit } else { Exit::DeviceMissing };
    for later in ended.folders() {
        // The tidy files were not written during the session.
        if let Err(failure) = write_tidy_files(&later).await {
            failure.show();
        }
    }
    // A recording that starts by command has its folder among the later ones.
    let first = [bag].into_iter().filter(|bag| !ended.folders().contains(bag));
    let folders: Vec<PathBuf> =
        first.chain(ended.folders()).filter(|folder| holds_something(folder)).collect();
    if folders.is_empty() && ended.is_later() {
        say("nothing was recorded: no command started the recording");
    }
    for folder in &folders {
        absent.write(folder).unwrap_or_else(Failure::show);
        say_where(folder);
    }
    Ok(exit)
}

/// Prints where the recording is, and how to inspect it.
fn say_where(folder: &Path) {
    say(format!("recorded; inspect it with `teampulse info {}`", pasted(folder)));
    let summary = folder.join(SUMMARY);
    if summary.exists() {
        say(format!("data quality and losses, on one page: {}", summary.display()));
    }
    last_line(folder.display().to_string());
}

/// Reads a positive, finite number of seconds.
pub fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(secs) if secs.is_finite() && secs > 0.0 => Ok(secs),
        _ => Err(format!("`{text}` is not a number of seconds above 0")),
    }
}
