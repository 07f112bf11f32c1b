//! `teampulse import`: converts recordings of other programs to bags of teampulse.

mod kind;
mod report;
mod tables;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use teampulse_bag::{BagSink, Options, Place};
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::session::{Pace, Session};
use teampulse_core::sink::Sink;
use teampulse_core::source::Source;
use teampulse_core::streams::Streams;
use teampulse_messages::convert::encode;
use teampulse_sinks::{Again, ContinuingBag};

use crate::commands::info::open;
use crate::commands::replay::{defaults, describe_foreign, replayed, study_at, study_of};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::folder::Claimed;
use crate::output;
use crate::recorded::read_through;
use crate::setup::{features, sink_context, tidy};
use crate::study::Study;

use kind::{Kind, tables_in};
use tables::{Asked, Tables};

/// Converts recordings of other programs to bags of teampulse, with all computed features.
///
/// A recording of ROS 2 (a folder, .mcap or .db3, compressed or not) becomes a new bag. Tables of samples,
/// as `extract` reads them, become one bag about one person with a stream for each table; from a folder of
/// Empatica's E4 or of Polar Sensor Logger all tables are read. The imported files are not changed.
#[derive(Debug, Args)]
pub struct Import {
    /// The recordings, or the tables
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Where to create the new bag's folder
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    out: PathBuf,
    /// The study with the features to compute; by default all features with their defaults
    #[arg(long)]
    study: Option<PathBuf>,
    #[command(flatten)]
    asked: Asked,
}

impl Import {
    /// Runs the command.
    pub async fn run(self) -> Result<Exit, Failure> {
        let (mut bags, mut tables) = (Vec::new(), Vec::new());
        for file in &self.files {
            match Kind::of(file)? {
                Kind::Bag => bags.push(file.clone()),
                Kind::Table => tables.push(file.clone()),
                Kind::Tables => tables.extend(tables_in(file)?),
            }
        }
        let mut worst = Exit::Fine;
        for bag in &bags {
            let exit = self.bag(bag).await?;
            worst = if worst == Exit::Fine { exit } else { worst };
        }
        if !tables.is_empty() {
            let exit = self.tables(&tables).await?;
            worst = if worst == Exit::Fine { exit } else { worst };
        }
        Ok(worst)
    }

    fn study(&self, recording: &Path) -> Result<Study, Failure> {
        Ok(match &self.study {
            Some(path) => study_at(path)?,
            None => Study::parse(Path::new("the defaults"), defaults(recording))?,
        })
    }

    async fn bag(&self, path: &Path) -> Result<Exit, Failure> {
        let mut bag = open(path)?;
        if study_of(&bag)?.is_some() {
            let message = format!("{} is a bag of teampulse already", path.display());
            return Err(Failure::new(message).hint("`teampulse replay` computes it again"));
        }
        bag.check();
        describe_foreign(&mut bag);
        let study = self.study(path)?;
        let claimed = Claimed::new(&self.out, &study.general.session.name)?;
        let bag = Arc::new(bag);
        let exit = replayed(Arc::clone(&bag), &study, &claimed).await?;
        output::lines(report::of_bag(&bag));
        concluded(claimed.path(), exit);
        Ok(exit)
    }

    async fn tables(&self, files: &[PathBuf]) -> Result<Exit, Failure> {
        let tables = Tables::open(files, &self.asked)?;
        let study = self.study(&self.files[0])?;
        let claimed = Claimed::new(&self.out, &study.general.session.name)?;
        let folder = claimed.path().to_owned();
        let clock = Clock::settable();
        let context = sink_context(&study, &folder, &clock);
        let session = study.general.session.name.clone();
        let options = Options { session, place: Place::Claimed, ..Options::default() };
        let bag = BagSink { folder: folder.clone(), study: study.text().to_owned(), options };
        let (ended, again) = (context.bag_ended.clone(), Again::Never);
        let mut sinks: Vec<Box<dyn Sink>> = vec![Box::new(ContinuingBag { bag, ended, again })];
        sinks.extend(tidy(&study, &context)?);
        let report = tables.report();
        let source: Box<dyn Source> = Box::new(tables);
        let session = Session {
            clock,
            pace: Pace::Recorded,
            clocks: Clocks::new(study.general.clocks.clone()),
            streams: Streams::default(),
            sources: vec![("tables".into(), source)],
            features: features(&study)?,
            sinks,
            workers: Vec::new(),
            encode,
            commands: Commands::default(),
        };
        let exit = read_through(session, &folder).await;
        output::lines(report.lines());
        concluded(&folder, exit);
        Ok(exit)
    }
}

/// Prints where the bag is.
fn concluded(folder: &Path, exit: Exit) {
    if exit != Exit::Failed {
        output::line(format!("imported; look into it with `teampulse info {}`", folder.display()));
        output::last_line(folder.display().to_string());
    }
}
