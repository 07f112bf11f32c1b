//! What a study requires but did not appear during the whole session.

use std::io;
use std::path::Path;
use std::time::Duration;

use teampulse_bag::private;
use teampulse_core::session_streams::SESSION_EVENTS;
use teampulse_core::stream::{Origin, Stream};
use teampulse_core::streams::Streams;
use teampulse_sinks::{LOST_OR_WRONG, NOTHING_NOTICED, Unmet};

use crate::failure::Failure;
use crate::required::Requirements;
use crate::supplies::{PATIENCE, Unsupplied};
use crate::tidied::SUMMARY;

/// The kinds of sources that supply markers: markers are recorded as the session's own events, and only when something
/// happens.
const MARKERS: [&str; 2] = ["marker_lines", "ttl"];

/// The devices, robots and people that never sent anything.
pub struct Absent(Vec<Unmet>);

impl Absent {
    /// Finds what was absent from a session with these streams, given the sources whose devices could not be opened or
    /// that supplied nothing. Returns nothing if the session was too short for devices to appear.
    pub fn of(
        required: &Requirements,
        streams: &Streams,
        unsupplied: &Unsupplied,
        lasted: Duration,
    ) -> Absent {
        if lasted < PATIENCE {
            return Absent(Vec::new());
        }
        let streams = streams.all();
        let raw = streams.iter().map(|(_, stream)| &**stream);
        let raw: Vec<&Stream> = raw.filter(|stream| is_received(stream)).collect();
        let received: Vec<&Stream> =
            raw.iter().copied().filter(|stream| stream.has_health()).collect();
        let mut absent = required.absent(&received);
        absent.extend(required.absent_lsl(&raw));
        let mut absent = unsupplied.added_to(absent);
        let markers = required.kinds.iter().filter(|kind| MARKERS.contains(&kind.as_str())).count();
        if absent.is_empty() && raw.is_empty() && markers < required.kinds.len() {
            let but = if markers == 0 { "" } else { ", apart from those of markers" };
            let what = format!("every source of the study{but}");
            absent.push(Unmet { what, fix: "Run `teampulse check` to see what is wrong.".into() });
        }
        Absent(absent)
    }

    /// Whether nothing was absent.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Prints everything absent, each with a remedy.
    pub fn show(&self) {
        for Unmet { what, fix } in &self.0 {
            Failure::new(format!("missing during the whole session: {what}")).hint(fix).show();
        }
    }

    /// Adds everything absent to the summary in a bag's folder, if there is one.
    pub fn write(&self, folder: &Path) -> Result<(), Failure> {
        let summary = folder.join(SUMMARY);
        if self.is_empty() || !summary.exists() {
            return Ok(());
        }
        self.add_to(&summary).map_err(|error| {
            Failure::new(format!("failed to write {}: {error}", summary.display()))
        })
    }

    fn add_to(&self, summary: &Path) -> io::Result<()> {
        let page = std::fs::read_to_string(summary)?;
        // Written next to the page first: on a full disk, the old page is kept.
        let new = summary.with_extension("md.new");
        private::write(&new, self.added_to(&page))
            .and_then(|()| std::fs::rename(&new, summary))
            .inspect_err(|_| drop(std::fs::remove_file(&new)))
    }

    /// Returns the page with everything absent at the start of the section on what was lost or wrong.
    fn added_to(&self, page: &str) -> String {
        let missing =
            |Unmet { what, .. }: &Unmet| format!("- Missing during the whole session: {what}\n");
        let lines: String = self.0.iter().map(missing).collect();
        let head = format!("{LOST_OR_WRONG}\n\n");
        let Some((before, after)) = page.split_once(&head) else {
            return format!("{page}\n{head}{lines}");
        };
        let after = after.strip_prefix(&format!("{NOTHING_NOTICED}\n")).unwrap_or(after);
        format!("{before}{head}{lines}{after}")
    }
}

/// Whether a stream comes from a source: features and the session's own events exist without one.
fn is_received(stream: &Stream) -> bool {
    stream.origin == Origin::Raw && stream.name != SESSION_EVENTS
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Shape, Subject};

    use crate::study::Study;

    use super::*;

    #[test]
    fn the_summary_states_what_was_missing_where_it_states_what_was_wrong() {
        let unmet = Unmet { what: "no robot matches /robot*".into(), fix: String::new() };
        let absent = Absent(vec![unmet]);
        let missing = "- Missing during the whole session: no robot matches /robot*\n";
        let page = |wrong: &str| format!("# a\n\n{LOST_OR_WRONG}\n\n{wrong}\n## Where\n");
        let nothing = page(&format!("{NOTHING_NOTICED}\n"));
        assert_eq!(absent.added_to(&nothing), page(missing));
        assert_eq!(absent.added_to(&page("- a fault\n")), page(&format!("{missing}- a fault\n")));
    }

    #[test]
    fn a_stream_of_lsl_that_never_came_was_missing() {
        let text = "[[sources]]\ntype = \"lsl\"\nname = \"NoSuch\"\n";
        let study = Study::parse(Path::new("study.toml"), text.to_owned()).expect("a study");
        let required = Requirements::of(&study).expect("settings that read");
        let whats = |streams: &Streams| {
            let absent =
                Absent::of(&required, streams, &Unsupplied::default(), Duration::from_secs(20));
            absent.0.into_iter().map(|it| it.what).collect::<Vec<_>>()
        };
        let streams = Streams::default();
        assert_eq!(whats(&streams), ["an LSL stream with name='NoSuch'"]);
        let marker = Stream::raw("/session/nosuch/markers", Subject::session(), Shape::Event);
        let doc = "LSL stream NoSuch of the type Markers from here".to_owned();
        streams.declare(Stream { doc, ..marker });
        assert_eq!(whats(&streams), [""; 0]);
    }

    #[test]
    fn a_session_with_nothing_but_markers_lacks_nothing() {
        let absent = |kinds: &[&str]| {
            let kinds = kinds.iter().map(|kind| (*kind).to_owned()).collect();
            let (robots, people, voices) = (Vec::new(), Vec::new(), Vec::new());
            let required =
                Requirements { robots, people, voices, topics: Vec::new(), lsl: Vec::new(), kinds };
            let lasted = Duration::from_secs(20);
            Absent::of(&required, &Streams::default(), &Unsupplied::default(), lasted)
                .0
                .into_iter()
                .map(|it| it.what)
                .collect::<Vec<_>>()
        };
        assert_eq!(absent(&["marker_lines", "ttl"]), [""; 0]);
        assert_eq!(absent(&["inputs"]), ["every source of the study"]);
        let but = "every source of the study, apart from those of markers";
        assert_eq!(absent(&["ttl", "inputs"]), [but]);
    }
}
