//! `teampulse replay`: computes everything derived again from what is raw.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use teampulse_bag::{Bag, BagSink, BagSource, DAMAGE_NOTE, Options, STUDY_NAME, Selection};
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::session::{Pace, Session};
use teampulse_core::sink::Sink;
use teampulse_core::streams::Streams;
use teampulse_messages::convert::encode;
use teampulse_sinks::Telling;

use crate::commands::info::{after_reading, open, warn_of_damage};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;
use crate::setup::{bag_folder, conclude, features, sink_context, tidy};
use crate::stop::Stop;
use crate::study::Study;

/// The note of a bag whose times `retime` has made.
pub const RETIMED: &str = "teampulse.times";

/// Computes everything derived again from what is raw in a bag, as fast as possible, into a new bag.
///
/// With the study of the recording the derived streams come out byte for byte as they were.
#[derive(Debug, Args)]
pub struct Replay {
    /// The bag's folder, or one of its .mcap files
    bag: PathBuf,
    /// The study; without it the one that is kept in the bag
    #[arg(long)]
    study: Option<PathBuf>,
    /// Where the new bag's folder is made
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl Replay {
    /// Does it.
    pub async fn run(self) -> Result<Exit, Failure> {
        let mut bag = open(&self.bag)?;
        warn_of_damage(&bag);
        bag.check();
        let bag = Arc::new(bag);
        let study = match &self.study {
            Some(path) => Study::read(path)?,
            None => study_of(&bag)?,
        };
        let folder = bag_folder(&self.out, &format!("{}_replay", study.general.session.name));
        let options = Options {
            session: study.general.session.name.clone(),
            notes: kept_notes(&bag),
            ..Options::default()
        };
        let text = study.text().to_owned();
        let clock = Clock::told();
        let mut context = sink_context(&study, &folder, &clock);
        context.damage = bag.lost_to_damage();
        let bag_sink = BagSink { folder, study: text, options };
        let mut sinks: Vec<Box<dyn Sink>> =
            vec![Box::new(Telling { bag: bag_sink, ended: context.bag_ended.clone() })];
        sinks.extend(tidy(&study, &context)?);
        let source = BagSource::new(Arc::clone(&bag), Selection::Raw);
        let unread = source.unread();
        let session = Session {
            clock,
            pace: Pace::Recorded,
            clocks: clocks_of(&bag, Some(&study)),
            streams: Streams::default(),
            sources: vec![("bag".into(), Box::new(source))],
            features: features(&study)?,
            sinks,
            encode,
        };
        let exit = conclude(session.run(Stop::default().asked(Clock::host(), None)).await);
        let exit = after_reading(&bag, &unread, exit);
        if exit != Exit::Failed {
            output::line(context.bag.display().to_string());
        }
        Ok(exit)
    }
}

/// The notes that are kept in what is computed from a bag: that its times are made for good, and
/// what damage took from it.
pub fn kept_notes(bag: &Bag) -> BTreeMap<String, String> {
    let retimed = bag.notes().get(RETIMED).map(|word| (RETIMED.to_owned(), word.clone()));
    let damage = bag.lost_to_damage().map(|damage| (DAMAGE_NOTE.to_owned(), damage));
    retimed.into_iter().chain(damage).collect()
}

/// How the samples of a bag get their place in time: with the clocks of a study, or as they are
/// stamped where `retime` has done that for good.
pub fn clocks_of(bag: &Bag, study: Option<&Study>) -> Clocks {
    let settings = study.map(|study| study.general.clocks.clone()).unwrap_or_default();
    if bag.notes().contains_key(RETIMED) {
        Clocks::retimed(settings)
    } else {
        Clocks::new(settings)
    }
}

/// The study that is kept in a bag.
pub fn study_of(bag: &Bag) -> Result<Study, Failure> {
    let kept = bag.attachment(STUDY_NAME);
    let kept = kept.map_err(|error| Failure::to(&error).hint(error.hint()))?;
    let Some(kept) = kept else {
        return Err(Failure::new(format!("no study is kept in {}", bag.path().display()))
            .hint("give one with --study"));
    };
    let name = format!("{}:{STUDY_NAME}", bag.path().display());
    Ok(Study::parse(Path::new(&name), String::from_utf8_lossy(&kept).into_owned())?)
}
