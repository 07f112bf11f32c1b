//! `teampulse retime`: improves times after the recording.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use teampulse_bag::{BagSink, BagSource, Options, Place, Selection};
use teampulse_core::clock::Clock;
use teampulse_core::clocks::{Clocks, Hindsight};
use teampulse_core::session::Session;
use teampulse_messages::convert::encode;

use crate::commands::info::{after_reading, open, warn_of_damage};
use crate::commands::replay::{RETIMED, describe_recording, kept_notes, sinks_into, study_for};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::folder::Claimed;
use crate::output;
use crate::recorded::read_through;
use crate::setup::{features, sink_context};

/// Writes a new bag with improved times, computed from the complete recording of every device clock.
///
/// Samples of devices get new times, computed with hindsight from all data about their clock. Messages of robots stay
/// as they are, and their computers' clocks are corrected causally. Derived streams are computed again from these
/// times, and so are the bag's tables and its summary.
#[derive(Debug, Args)]
pub struct Retime {
    /// The bag's folder, or one of its .mcap files
    bag: PathBuf,
    /// The study; by default the one stored in the bag
    #[arg(long)]
    study: Option<PathBuf>,
    /// Where to create the new bag's folder
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl Retime {
    /// Runs the command.
    pub async fn run(self) -> Result<Exit, Failure> {
        let mut bag = open(&self.bag)?;
        bag.check();
        let bag = Arc::new(bag);
        if bag.notes().contains_key(RETIMED) {
            return Err(Failure::new(format!("{} has already been retimed", self.bag.display()))
                .hint("retime the bag that it was computed from"));
        }
        warn_of_damage(&bag);
        let study = study_for(self.study.as_deref(), &bag)?;
        let (settings, hindsight) = (study.general.clocks.clone(), Hindsight::default());
        let name = format!("{}_retimed", study.general.session.name);
        let claimed = Claimed::new(&self.out, &name)?;
        let folder = claimed.path().to_owned();
        let mut notes = kept_notes(&bag);
        notes.insert(RETIMED.to_owned(), "two-sided".to_owned());
        let session = study.general.session.name.clone();
        let options = Options { session, notes, place: Place::Claimed, ..Options::default() };
        let text = study.text().to_owned();
        let sink = BagSink { folder: folder.clone(), study: text, options };
        let clock = Clock::settable();
        let mut context = sink_context(&study, &folder, &clock);
        describe_recording(&mut context, &bag);

        let source = BagSource::new(Arc::clone(&bag), Selection::Raw);
        let first =
            Session::of_recording(source, Clocks::collecting(settings.clone(), &hindsight), encode);
        let collected = read_through(first, &folder).await;
        if collected != Exit::Fine {
            return Ok(collected);
        }
        if hindsight.is_empty() {
            output::note(
                "warning: the bag contains no device with a clock: its times remain unchanged",
            );
        }

        let source = BagSource::new(Arc::clone(&bag), Selection::Raw);
        let unread = source.unread();
        let second = Session {
            clock,
            features: features(&study)?,
            sinks: sinks_into(sink, &study, &context)?,
            ..Session::of_recording(source, Clocks::with_hindsight(settings, hindsight), encode)
        };
        let exit = read_through(second, &folder).await;
        let exit = after_reading(&bag, &unread, exit);
        if exit != Exit::Failed {
            output::line(folder.display().to_string());
        }
        Ok(exit)
    }
}
