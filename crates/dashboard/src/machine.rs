//! The resources that this program uses.

use rustix::param::page_size;
use rustix::time::{ClockId, clock_gettime};
use teampulse_core::clock::Stopwatch;

/// The processor time of this program at the last check.
#[derive(Debug)]
pub struct Usage {
    used_secs: f64,
    since: Stopwatch,
}

impl Usage {
    /// Starts counting now.
    pub fn start() -> Usage {
        Usage { used_secs: processor_secs(), since: Stopwatch::start() }
    }

    /// Returns the processor time per elapsed time since the last call [cores].
    pub fn take(&mut self) -> f64 {
        let before = std::mem::replace(self, Usage::start());
        let elapsed_secs = before.since.elapsed().as_secs_f64();
        if elapsed_secs > 0.0 { (self.used_secs - before.used_secs) / elapsed_secs } else { 0.0 }
    }
}

/// The processor time of this program so far [s].
pub fn processor_secs() -> f64 {
    let used = clock_gettime(ClockId::ProcessCPUTime);
    used.tv_sec as f64 + used.tv_nsec as f64 * 1e-9
}

/// The memory used by this program [bytes]; `None` if the system has no /proc.
pub fn memory_bytes() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/statm").ok()?;
    let pages: u64 = text.split_whitespace().nth(1)?.parse().ok()?;
    Some(pages * page_size() as u64)
}
