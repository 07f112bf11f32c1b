//! `teampulse run`: monitors and records a real team.

use std::path::PathBuf;

use clap::Args;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::machine;
use crate::network;
use crate::output;
use crate::setup::{Parts, Setup, conclude};
use crate::stop::Stop;
use crate::study::Study;

/// Monitors and records a real team.
///
/// While it runs: a letter or digit sets a marker, the space bar one named `mark`, `q` ends it.
#[derive(Debug, Args)]
pub struct Run {
    /// The study: what to watch, what to compute, what to keep
    study: PathBuf,
    /// Ends by itself after so many seconds of the session's clock
    #[arg(long, value_name = "SECS", value_parser = crate::commands::run::seconds)]
    duration: Option<f64>,
    /// Where the bag's folder is made
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    out: PathBuf,
}

impl Run {
    /// Does it.
    pub async fn run(self) -> Result<Exit, Failure> {
        let study = Study::read(&self.study)?;
        let messages = study.general.session.messages.clone();
        let buses = network::buses_with_messages("teampulse", messages.as_deref());
        let setup = Setup::new(study, buses).await?;
        watch(setup, self.duration, self.out).await
    }
}

/// Runs a whole study until it is asked to stop.
pub async fn watch(
    setup: Setup,
    duration_secs: Option<f64>,
    out: PathBuf,
) -> Result<Exit, Failure> {
    let stop = Stop::default();
    if let Some(reason) = machine::unfit(&out) {
        return Err(Failure::new(format!("nothing can be recorded: there is no {reason}"))
            .hint("give another folder with --out"));
    }
    let bag = setup.bag_folder(&out);
    let mut parts =
        Parts { sources: setup.sources()?, features: setup.features()?, sinks: setup.sinks(&bag)? };
    if parts.sources.is_empty() {
        return Err(setup.without("sources", "nothing is watched").into());
    }
    if parts.sinks.is_empty() {
        eprintln!("warning: the study has no [[sinks]]: nothing is recorded");
    }
    parts.sources.extend(setup.attended(&stop)?);
    parts.sinks.push(setup.terminal());
    parts.sinks.push(setup.publisher()?);
    parts.sinks.push(setup.diagnostics()?);
    let asked = stop.asked(setup.clock.clone(), duration_secs);
    let exit = conclude(setup.run(parts, asked).await);
    if bag.exists() {
        eprintln!("recorded; look into it with `teampulse info {}`", bag.display());
        let summary = bag.join("summary.md");
        if summary.exists() {
            eprintln!("what was usable, on one page: {}", summary.display());
        }
        output::line(bag.display().to_string());
    }
    Ok(exit)
}

/// Reads a positive, finite number of seconds.
pub fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(secs) if secs.is_finite() && secs > 0.0 => Ok(secs),
        _ => Err(format!("`{text}` is not a number of seconds above 0")),
    }
}
