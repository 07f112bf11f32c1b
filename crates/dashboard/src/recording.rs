//! The recording as observed from outside: it counts as growing only if its size on the disk grows.

use std::collections::VecDeque;

use teampulse_core::clock::Stopwatch;

use crate::hub::Hub;
use crate::wire::{Recording, RecordingStage};

/// The time over which the speed of the recording is measured [s]; the recording is checked once a second.
const SPEED_SECS: usize = 10;

/// A bag that is first seen within this time is considered to have started with the session [s].
const FIRST_SECS: f64 = 5.0;

/// The state of the recording over the last checks.
#[derive(Debug, Default)]
pub struct Observed {
    /// The folder of the newest bag, and when it was first seen [s of the session].
    newest: Option<(String, f64)>,
    grown: Option<(u64, Stopwatch)>,
    seen: VecDeque<(Stopwatch, u64)>,
}

impl Observed {
    /// Checks the disk, and returns the state of the recording.
    pub fn look(&mut self, hub: &Hub) -> Recording {
        let disk = (hub.context.disk)();
        if self.grown.is_none_or(|(bytes, _)| disk.bytes > bytes) {
            self.grown = Some((disk.bytes, Stopwatch::start()));
        }
        self.seen.push_back((Stopwatch::start(), disk.bytes));
        if self.seen.len() > SPEED_SECS + 1 {
            self.seen.pop_front();
        }
        let speed = self.seen.front().map(|(since, bytes)| {
            let secs = since.elapsed().as_secs_f64();
            if secs > 0.5 { disk.bytes.saturating_sub(*bytes) as f64 / secs } else { 0.0 }
        });
        let now = hub.now();
        // The first bag starts with the session, unless the session starts paused.
        let began = if self.newest.is_none() && now < FIRST_SECS { 0.0 } else { now };
        let is_new = |(path, _): &(String, f64)| *path != disk.path;
        if !disk.path.is_empty() && self.newest.as_ref().is_none_or(is_new) {
            self.newest = Some((disk.path.clone(), began));
        }
        let began = match disk.stage {
            RecordingStage::Paused => 0.0,
            _ => self.newest.as_ref().map_or(0.0, |(_, began)| *began),
        };
        let grown_secs = self.grown.map(|(_, since)| since.elapsed().as_secs_f64());
        Recording {
            stage: disk.stage,
            path: if disk.path.is_empty() { hub.context.path.clone() } else { disk.path },
            bytes: disk.bytes,
            bytes_per_sec: speed.unwrap_or(0.0),
            free_bytes: disk.free_bytes,
            sync_age_secs: grown_secs.filter(|_| disk.bytes > 0),
            elapsed_secs: now - began,
            kept_secs: disk.kept_secs,
            reason: disk.reason,
        }
    }
}
