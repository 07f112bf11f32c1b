//! The options for writing a bag.

use std::collections::BTreeMap;

use teampulse_core::clock::Clock;

use crate::growth::Growth;
use crate::metadata::Version;
use crate::write::chunk::Compression;

/// The options for writing a bag.
#[derive(Clone, Debug)]
pub struct Options {
    /// The session's name, stored in the bag.
    pub session: String,
    /// The compression of chunks.
    pub compression: Compression,
    /// The size from which a file is followed by another [bytes]; `None` for no limit.
    pub split_bytes: Option<u64>,
    /// The duration from which a file is followed by another [s]; `None` for no limit.
    pub split_secs: Option<f64>,
    /// The version of `metadata.yaml`.
    pub metadata_version: Version,
    /// Whether the bag creates its folder.
    pub place: Place,
    /// Notes about the whole recording, stored in the bag.
    pub notes: BTreeMap<String, String>,
    /// The free space on the disk below which the recording ends [bytes].
    pub keep_free_bytes: u64,
    /// Receives the growth of the recording.
    pub growth: Growth,
    /// The clock that schedules flushes.
    pub clock: Clock,
}

/// The folder of a new bag.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Place {
    /// A folder that the bag creates, and that must not exist yet.
    #[default]
    New,
    /// A folder that was already created for this bag, so that no other recording takes the same name.
    Claimed,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            session: String::new(),
            compression: Compression::default(),
            split_bytes: None,
            split_secs: None,
            metadata_version: Version::default(),
            place: Place::New,
            notes: BTreeMap::new(),
            keep_free_bytes: 64 << 20,
            growth: Growth::default(),
            clock: Clock::host(),
        }
    }
}
