//! Shows a bag in a browser.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use teampulse_bag::{Bag, Recorded};
use teampulse_core::clock::Clock;
use teampulse_core::sample::Record;
use teampulse_core::stream::Stream;
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_dashboard::wire::RecordingStage;
use teampulse_dashboard::{Context, Disk, Playhead, Recording, Settings, Shown};

use crate::failure::Failure;

/// Shows a bag in a browser; `None`, with a warning, if no port is free and none was requested.
pub(super) fn show(
    bag: &Arc<Bag>,
    playhead: &Playhead,
    port: Option<u16>,
) -> Result<Option<Shown>, Failure> {
    let name = bag.path().file_name().unwrap_or(bag.path().as_os_str());
    let stage = if bag.damage().next().is_some() {
        RecordingStage::EndedEarly
    } else {
        RecordingStage::Finished
    };
    let bytes = bytes_of(bag.path());
    let disk = move || Disk { stage, bytes, ..Disk::default() };
    let context = Context {
        path: bag.path().display().to_string(),
        disk: Arc::new(disk),
        ..Context::new(name.to_string_lossy(), Clock::host())
    };
    let settings = Settings { port, ..Settings::default() };
    let recording = Arc::new(Shows {
        recorded: Recorded::new(Arc::clone(bag)),
        has_warned: AtomicBool::new(false),
    });
    match teampulse_dashboard::show(recording, playhead, context, settings) {
        Ok(shown) => Ok(Some(shown)),
        Err(error) if port.is_none() => {
            tracing::warn!("dashboard: failed to {error}");
            Ok(None)
        }
        Err(error) => {
            let message = format!("dashboard: failed to {error}");
            Err(Failure::new(message)
                .hint("choose another --port, or omit the dashboard with --no-dashboard"))
        }
    }
}

/// The size of a file, or of the files of a folder [bytes].
fn bytes_of(path: &Path) -> u64 {
    let size = |path: &Path| path.metadata().map_or(0, |file| file.len());
    match std::fs::read_dir(path) {
        Ok(files) => files.flatten().map(|file| size(&file.path())).sum(),
        Err(_) => size(path),
    }
}

/// A bag whose recorded data the dashboard reads.
struct Shows {
    recorded: Recorded,
    has_warned: AtomicBool,
}

impl Recording for Shows {
    fn streams(&self) -> Streams {
        self.recorded.streams().clone()
    }

    fn records<'a>(
        &'a self,
        from: Time,
        wants: &dyn Fn(&Stream) -> bool,
    ) -> Box<dyn Iterator<Item = Record> + 'a> {
        Box::new(self.recorded.records(from, wants).filter_map(|record| match record {
            Ok(record) => Some(record),
            Err(error) => {
                if !self.has_warned.swap(true, Ordering::Relaxed) {
                    tracing::warn!("failed to {error}: parts that can't be read are not shown");
                }
                None
            }
        }))
    }
}
