//! `teampulse export`: hands a bag's contents out as tables.

use std::path::PathBuf;
use std::sync::Arc;

use clap::{Args, ValueEnum};
use teampulse_bag::{BagSource, Selection};
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::session::{Pace, Session};
use teampulse_core::streams::Streams;
use teampulse_messages::convert::encode;
use teampulse_sinks::Csv;

use crate::commands::info::{after_reading, open, warn_of_damage};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;
use crate::setup::conclude;
use crate::stop::Stop;

/// Hands a bag's contents out as tables, one file for each stream.
#[derive(Debug, Args)]
pub struct Export {
    /// The bag's folder, or one of its .mcap files
    bag: PathBuf,
    /// The kind of table
    #[arg(long, value_enum, default_value = "csv")]
    format: Format,
    /// Where the tables are written; without it beside the bag
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    /// Comma-separated values
    Csv,
}

impl Export {
    /// Does it.
    pub async fn run(self) -> Result<Exit, Failure> {
        let bag = Arc::new(open(&self.bag)?);
        warn_of_damage(&bag);
        let folder = self.out.unwrap_or_else(|| self.bag.with_extension("csv"));
        let sink = match self.format {
            Format::Csv => Csv::into_folder(folder.clone()),
        };
        let source = BagSource::new(Arc::clone(&bag), Selection::RawAndDerived);
        let unread = source.unread();
        let session = Session {
            clock: Clock::told(),
            pace: Pace::Recorded,
            clocks: Clocks::default(),
            streams: Streams::default(),
            sources: vec![("bag".into(), Box::new(source))],
            features: Vec::new(),
            sinks: vec![sink],
            encode,
        };
        let exit = conclude(session.run(Stop::default().asked(Clock::host(), None)).await);
        let exit = after_reading(&bag, &unread, exit);
        if exit != Exit::Failed {
            output::line(folder.display().to_string());
        }
        Ok(exit)
    }
}
