//! What a study requires and a whole session lacked.

use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::Path;

use teampulse_core::stream::Stream;
use teampulse_core::streams::Streams;
use teampulse_sinks::Unmet;

use crate::failure::Failure;
use crate::required::Requirements;
use crate::tidied::SUMMARY;

/// The devices, robots and people that never sent anything.
pub struct Absent(Vec<Unmet>);

impl Absent {
    /// Those of a session with these streams.
    pub fn of(required: &Requirements, streams: &Streams) -> Absent {
        let streams = streams.all();
        let streams = streams.iter().map(|(_, stream)| &**stream);
        let received: Vec<&Stream> = streams.filter(|stream| stream.has_health()).collect();
        let mut absent = required.absent(&received);
        if absent.is_empty() && received.is_empty() {
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

fn append(path: &Path, text: &str) -> io::Result<()> {
    OpenOptions::new().append(true).open(path)?.write_all(text.as_bytes())
}
