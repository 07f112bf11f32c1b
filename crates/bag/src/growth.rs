//! How a recording grows on the disk, for those who show it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// How a recording grows on the disk: written by who records, read by who shows it. Clones are one.
#[derive(Clone, Debug, Default)]
pub struct Growth(Arc<Mutex<OnDisk>>);

/// What of a recording is on the disk.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OnDisk {
    /// How far the recording has come.
    pub stage: Stage,
    /// How much was synced to the disk, in all files [bytes].
    pub synced_bytes: u64,
    /// How much room the disk had left at the last sync [bytes]; `None` before.
    pub free_bytes: Option<u64>,
}

/// How far a recording has come.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Stage {
    /// Nothing is recorded.
    #[default]
    NotBegun,
    /// It is being recorded.
    Open,
    /// It ended with the session, and is whole.
    Finished,
    /// It ended before the session, and why.
    EndedEarly(String),
}

impl Growth {
    /// What is on the disk now.
    pub fn on_disk(&self) -> OnDisk {
        self.lock().clone()
    }

    /// A recording begins; a second one of a session adds to the first.
    pub fn begin(&self) {
        self.lock().stage = Stage::Open;
    }

    /// So much more was synced [bytes], and the disk has so much room left [bytes].
    pub fn synced(&self, more_bytes: u64, free_bytes: u64) {
        self.add(more_bytes);
        self.lock().free_bytes = Some(free_bytes);
    }

    /// So much more was synced [bytes].
    pub fn add(&self, more_bytes: u64) {
        self.lock().synced_bytes += more_bytes;
    }

    /// The recording is whole.
    pub fn finish(&self) {
        self.lock().stage = Stage::Finished;
    }

    /// The recording ended before its session.
    pub fn end_early(&self, why: impl Into<String>) {
        self.lock().stage = Stage::EndedEarly(why.into());
    }

    fn lock(&self) -> MutexGuard<'_, OnDisk> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
