//! The size of a recording on the disk, for display.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The progress of a recording on the disk; clones share it between the writer and displays.
#[derive(Clone, Debug, Default)]
pub struct Growth(Arc<Mutex<OnDisk>>);

/// The part of a recording that is on the disk.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OnDisk {
    /// The stage of the recording.
    pub stage: Stage,
    /// The folder of the newest bag; empty before the first.
    pub folder: PathBuf,
    /// The bytes synced to the disk, in all files.
    pub synced_bytes: u64,
    /// The free space on the disk at the first sync [bytes]; `None` before it.
    pub began_with_bytes: Option<u64>,
    /// The free space on the disk at the last sync [bytes]; `None` before the first sync.
    pub free_bytes: Option<u64>,
}

/// The stage of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Stage {
    /// Nothing is recorded.
    #[default]
    NotBegun,
    /// A bag is being recorded.
    Open,
    /// Nothing is recorded until a command starts a bag; the last seconds are kept in memory.
    Paused {
        /// The number of seconds that are kept.
        kept_secs: f64,
    },
    /// The recording ended with the session, and is complete.
    Finished,
    /// The recording ended before the session, for this reason.
    EndedEarly(String),
}

impl Growth {
    /// The current state of the recording on the disk.
    pub fn on_disk(&self) -> OnDisk {
        self.lock().clone()
    }

    /// Starts a recording in a folder; the bytes of a second recording in the same session are added to the first.
    pub fn begin(&self, folder: &Path) {
        let mut on_disk = self.lock();
        on_disk.stage = Stage::Open;
        folder.clone_into(&mut on_disk.folder);
    }

    /// Marks the recording as paused, with this many seconds kept in memory.
    pub fn pause(&self, kept_secs: f64) {
        self.lock().stage = Stage::Paused { kept_secs };
    }

    /// Adds newly synced bytes, and records the free space on the disk [bytes].
    pub fn synced(&self, more_bytes: u64, free_bytes: u64) {
        let mut on_disk = self.lock();
        on_disk.synced_bytes += more_bytes;
        on_disk.began_with_bytes.get_or_insert(free_bytes);
        on_disk.free_bytes = Some(free_bytes);
    }

    /// Adds newly synced bytes.
    pub fn add(&self, more_bytes: u64) {
        self.lock().synced_bytes += more_bytes;
    }

    /// Marks the recording as complete.
    pub fn finish(&self) {
        self.lock().stage = Stage::Finished;
    }

    /// Marks the recording as ended before its session.
    pub fn end_early(&self, why: impl Into<String>) {
        self.lock().stage = Stage::EndedEarly(why.into());
    }

    fn lock(&self) -> MutexGuard<'_, OnDisk> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
