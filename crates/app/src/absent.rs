//! What a study requires and a whole session lacked.

use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::Path;
use std::time::Duration;

use teampulse_core::session_streams::SESSION_EVENTS;
use teampulse_core::stream::{Origin, Stream};
use teampulse_core::streams::Streams;
use teampulse_sinks::Unmet;

use crate::failure::Failure;
use crate::required::Requirements;
use crate::tidied::SUMMARY;

/// How long devices may take to appear: a scan and a connection of Bluetooth take several seconds.
const PATIENCE: Duration = Duration::from_secs(10);

/// The devices, robots and people that never sent anything.
pub struct Absent(Vec<Unmet>);

impl Absent {
    /// Those of a session with these streams that lasted this long; none of a session that was too short for devices
    /// to appear.
    pub fn of(required: &Requirements, streams: &Streams, lasted: Duration) -> Absent {
        if lasted < PATIENCE {
            return Absent(Vec::new());
        }
        let streams = streams.all();
        let raw = streams.iter().map(|(_, stream)| &**stream);
        let raw: Vec<&Stream> = raw.filter(|stream| is_received(stream)).collect();
        let received: Vec<&Stream> =
            raw.iter().copied().filter(|stream| stream.has_health()).collect();
        let mut absent = required.absent(&received);
        if absent.is_empty() && raw.is_empty() {
            let what = "every source of the study".into();
            absent.push(Unmet { what, fix: "`teampulse check` says what is wrong.".into() });
        }
        Absent(absent)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Prints them, each with a remedy.
    pub fn show(&self) {
        for Unmet { what, fix } in &self.0 {
            Failure::new(format!("missing during the whole session: {what}")).hint(fix).show();
        }
    }

    /// Adds them to the summary in a bag's folder, if it has one.
    pub fn write(&self, folder: &Path) -> Result<(), Failure> {
        let summary = folder.join(SUMMARY);
        if self.is_empty() || !summary.exists() {
            return Ok(());
        }
        append(&summary, &self.section()).map_err(|error| {
            Failure::new(format!("failed to write {}: {error}", summary.display()))
        })
    }

    fn section(&self) -> String {
        let lines: Vec<String> =
            self.0.iter().map(|Unmet { what, .. }| format!("- {what}\n")).collect();
        format!("\n## Missing during the whole session\n\n{}", lines.concat())
    }
}

/// Whether it comes from a source: features and the session's own events are there without one.
fn is_received(stream: &Stream) -> bool {
    stream.origin == Origin::Raw && stream.name != SESSION_EVENTS
}

fn append(path: &Path, text: &str) -> io::Result<()> {
    OpenOptions::new().append(true).open(path)?.write_all(text.as_bytes())
}
