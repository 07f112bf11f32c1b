//! The recording as it is observed: it grows only if its size on the disk does.

use std::collections::VecDeque;

use teampulse_core::clock::Stopwatch;

use crate::hub::Hub;
use crate::wire::Recording;

/// Over how long its speed is measured [s]; it is looked at once a second.
const SPEED_SECS: usize = 10;

/// What was seen of the recording.
#[derive(Debug, Default)]
pub struct Observed {
    grown: Option<(u64, Stopwatch)>,
    seen: VecDeque<(Stopwatch, u64)>,
}

impl Observed {
    /// Looks at the disk.
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
        let grown_secs = self.grown.map(|(_, since)| since.elapsed().as_secs_f64());
        Recording {
            stage: disk.stage,
            path: hub.context.path.clone(),
            bytes: disk.bytes,
            bytes_per_sec: speed.unwrap_or(0.0),
            free_bytes: disk.free_bytes,
            sync_age_secs: grown_secs.filter(|_| disk.bytes > 0),
            elapsed_secs: hub.now(),
            reason: disk.reason,
        }
    }
}
