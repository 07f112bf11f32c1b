//! Writes the tidy files of a bag that was recorded without them, or was cut off before they were finished.

use std::path::Path;
use std::sync::Arc;

use teampulse_bag::Selection;
use teampulse_core::clock::Clock;
use teampulse_core::session::Session;
use teampulse_messages::convert::encode;

use crate::commands::info::open;
use crate::commands::replay::{clocks_of, describe_recording, source_of, study_of};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::outcome::conclude;
use crate::output::say;
use crate::setup::{features, sink_context, tidy};
use crate::stop::Stop;

/// The summary page of a bag: what was usable, and what was lost.
pub const SUMMARY: &str = "summary.md";

/// Writes the tidy files of a bag into its folder, computed from raw data as in a replay.
pub async fn write_tidy_files(folder: &Path) -> Result<Exit, Failure> {
    let bag = Arc::new(open(folder)?);
    // Bags of other recorders have no study that names the wanted streams.
    let Some(study) = study_of(&bag)? else { return Ok(Exit::Fine) };
    let clock = Clock::settable();
    let mut context = sink_context(&study, folder, &clock);
    describe_recording(&mut context, &bag);
    let Some(tidy) = tidy(&study, &context)? else { return Ok(Exit::Fine) };
    say(format!("writing the tidy files of {} (summary.md and the tables)", folder.display()));
    let session = Session {
        clock,
        features: features(&study)?,
        sinks: vec![tidy],
        ..Session::of_recording(
            source_of(&bag, Selection::Raw),
            clocks_of(&bag, Some(&study)),
            encode,
        )
    };
    Ok(conclude(Stop::default().run(session, Clock::host(), None).await))
}
