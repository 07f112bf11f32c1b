//! `teampulse replay`: computes all derived streams again from raw data.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use teampulse_bag::{
    Bag, BagSink, BagSource, DAMAGE_NOTE, ENDED_NOTE, JOINED_NOTE, Options, Place, STUDY_NAME,
    Selection,
};
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::session::Session;
use teampulse_core::sink::Sink;
use teampulse_messages::convert::encode;
use teampulse_sinks::{Continuation, ContinuingBag, Part, SinkContext};
use teampulse_sources::robots::{Choice, Robots};

use crate::commands::info::{after_reading, open, warn_of_damage};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::folder::Claimed;
use crate::output;
use crate::recorded::read_through;
use crate::setup::{features, sink_context, tidy, try_out};
use crate::study::Study;

/// The note in a bag whose times were computed by `retime`.
pub const RETIMED: &str = "teampulse.times";
/// The note in a bag that was imported: it was not recorded by a session of ours, which would note its end.
pub const IMPORTED: &str = "teampulse.imported";

/// Computes all derived streams of a bag again from its raw data, as fast as possible, into a new bag.
///
/// With the study that the recording used, the derived streams are byte-identical to the recorded ones.
#[derive(Debug, Args)]
pub struct Replay {
    /// The bag's folder, or one of its .mcap or .db3 files
    bag: PathBuf,
    /// The study; by default the one stored in the bag, or else the default settings
    #[arg(long)]
    study: Option<PathBuf>,
    /// Where to create the new bag's folder
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl Replay {
    /// Runs the command.
    pub async fn run(self) -> Result<Exit, Failure> {
        let mut bag = open(&self.bag)?;
        warn_of_damage(&bag);
        bag.check();
        describe_foreign(&mut bag);
        let bag = Arc::new(bag);
        let study = study_for(self.study.as_deref(), &bag)?;
        let claimed = Claimed::new(&self.out, &format!("{}_replay", study.general.session.name))?;
        let exit = replayed(bag, &study, &claimed).await?;
        if exit != Exit::Failed {
            output::line(claimed.path().display().to_string());
        }
        Ok(exit)
    }
}

/// Computes all derived streams of a bag again, into a new bag.
pub async fn replayed(bag: Arc<Bag>, study: &Study, claimed: &Claimed) -> Result<Exit, Failure> {
    let source = source_of(&bag, Selection::Raw);
    replayed_from(source, bag, study, claimed).await
}

/// Computes all derived streams again, from a source that reads the bag.
pub async fn replayed_from(
    source: BagSource,
    bag: Arc<Bag>,
    study: &Study,
    claimed: &Claimed,
) -> Result<Exit, Failure> {
    let folder = claimed.path().to_owned();
    let mut notes = kept_notes(&bag);
    if study_of(&bag)?.is_none() {
        notes.insert(IMPORTED.to_owned(), "recording".to_owned());
    }
    let is_imported = notes.contains_key(IMPORTED);
    let options = Options {
        session: study.general.session.name.clone(),
        notes,
        place: Place::Claimed,
        ..Options::default()
    };
    let (text, out) = (study.text().to_owned(), folder.clone());
    let clock = Clock::settable();
    let mut context = sink_context(study, &folder, &clock);
    describe_recording(&mut context, &bag);
    context.is_imported = is_imported;
    let unread = source.unread();
    let session = Session {
        clock,
        features: features(study)?,
        sinks: sinks_into(BagSink { folder, study: text, options }, study, &context)?,
        ..Session::of_recording(source, clocks_of(&bag, Some(study)), encode)
    };
    let exit = read_through(session, &out).await;
    Ok(after_reading(&bag, &unread, exit))
}

/// Returns the sinks that write a bag again: the bag itself, and its tidy files.
pub fn sinks_into(
    bag: BagSink,
    study: &Study,
    context: &SinkContext,
) -> Result<Vec<Box<dyn Sink>>, Failure> {
    let (ended, again) = (context.bag_ended.clone(), Continuation::Never);
    // Commands in a recording applied to that recording only.
    let bag = ContinuingBag { bag, ended, again, ends_by_command: false };
    let mut sinks: Vec<Box<dyn Sink>> = vec![Box::new(bag)];
    sinks.extend(tidy(study, context)?);
    Ok(sinks)
}

/// Describes the recording from which a session is computed: what it lost, and which part of its session it is.
pub fn describe_recording(context: &mut SinkContext, bag: &Bag) {
    let notes = bag.notes();
    context.damage = bag.lost_to_damage();
    context.is_imported = notes.contains_key(IMPORTED);
    context.part =
        Part { has_joined: notes.contains_key(JOINED_NOTE), ended: notes.get(ENDED_NOTE).cloned() };
}

/// Returns the notes that a bag inherits from the one it is computed from: that its times are final, that it was
/// imported, how it was placed in a session, why it ended early, and what it lost to damage.
pub fn kept_notes(bag: &Bag) -> BTreeMap<String, String> {
    let kept = [RETIMED, IMPORTED, JOINED_NOTE, ENDED_NOTE]
        .into_iter()
        .filter_map(|note| bag.notes().get(note).map(|words| (note.to_owned(), words.clone())));
    let damage = bag.lost_to_damage().map(|damage| (DAMAGE_NOTE.to_owned(), damage));
    kept.chain(damage).collect()
}

/// Reads the study of a replay from a file, or else takes the one stored in the bag.
pub fn study_for(path: Option<&Path>, bag: &Bag) -> Result<Study, Failure> {
    path.map_or_else(|| study_or_defaults(bag), study_at)
}

/// Reads the study in a file, and fails where `check` would reject it.
pub fn study_at(path: &Path) -> Result<Study, Failure> {
    let study = Study::read(path)?;
    try_out(&study)?;
    Ok(study)
}

/// Returns a study that contains only the name of a recording.
pub fn defaults(recording: &Path) -> String {
    let name = recording.file_name().unwrap_or_default().to_string_lossy();
    let mut parts = name.split('.').map(|part| part.trim_start_matches('-'));
    let name = parts.find(|part| !part.is_empty()).unwrap_or("recording");
    let fits = |each: char| each.is_ascii_alphanumeric() || matches!(each, '_' | '-');
    let name = name.chars().map(|each| if fits(each) { each } else { '_' });
    let name: String = name.take(100).collect();
    format!(
        "# The recording contains no study: these are the defaults.\n[session]\nname = \"{name}\"\n"
    )
}

/// Creates a source that reads a bag, with the stamps of the original sources or with the final times of `retime`.
pub fn source_of(bag: &Arc<Bag>, selection: Selection) -> BagSource {
    let source = BagSource::new(Arc::clone(bag), selection);
    if bag.notes().contains_key(RETIMED) { source.as_placed() } else { source }
}

/// The timing of a bag's samples: from the clocks of a study, or as stamped if `retime` has computed the times.
pub fn clocks_of(bag: &Bag, study: Option<&Study>) -> Clocks {
    let settings = study.map(|study| study.general.clocks.clone()).unwrap_or_default();
    if bag.notes().contains_key(RETIMED) {
        Clocks::retimed(settings)
    } else {
        Clocks::new(settings)
    }
}

/// Recognises the robots' topics of other recorders by their types, with one robot for each namespace.
pub fn describe_foreign(bag: &mut Bag) {
    let settings: Result<Robots, _> = toml::from_str("namespace = \"/*\"");
    let choice = settings.ok().and_then(|settings| Choice::new(&settings).ok());
    let choice = choice.expect("a namespace is all that a choice needs");
    bag.describe_foreign(|topic, type_name| choice.stream(topic, type_name));
}

/// Reads the study stored in a bag; `None` if another recorder wrote the bag.
pub fn study_of(bag: &Bag) -> Result<Option<Study>, Failure> {
    let kept = bag.attachment(STUDY_NAME);
    let kept = kept.map_err(|error| Failure::to(&error).hint(error.hint()))?;
    let name = format!("{}:{STUDY_NAME}", bag.path().display());
    let study = kept
        .map(|kept| Study::parse(Path::new(&name), String::from_utf8_lossy(&kept).into_owned()));
    Ok(study.transpose()?)
}

/// Reads the study stored in a bag, or else returns the defaults.
pub fn study_or_defaults(bag: &Bag) -> Result<Study, Failure> {
    if let Some(study) = study_of(bag)? {
        return Ok(study);
    }
    let shown = bag.path().display();
    output::note(format!("note: {shown} contains no study: the defaults are used"));
    Ok(Study::parse(Path::new("the defaults"), defaults(bag.path()))?)
}
