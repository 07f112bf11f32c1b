//! How a bag is written.

use std::collections::BTreeMap;

use teampulse_core::clock::Clock;

use crate::growth::Growth;
use crate::metadata::Version;
use crate::write::chunk::Compression;

/// How a bag is written.
#[derive(Clone, Debug)]
pub struct Options {
    /// The session's name; kept in the bag.
    pub session: String,
    /// How its chunks are compressed.
    pub compression: Compression,
    /// A file of this size is followed by another [bytes]; `None` for no such limit.
    pub split_bytes: Option<u64>,
    /// A file that spans so much time is followed by another [s]; `None` for no such limit.
    pub split_secs: Option<f64>,
    /// The version of `metadata.yaml`.
    pub metadata_version: Version,
    /// Whether the bag makes its folder.
    pub place: Place,
    /// Words about the whole recording, kept in the bag.
    pub notes: BTreeMap<String, String>,
    /// The recording ends when the disk has less room than this [bytes].
    pub keep_free_bytes: u64,
    /// Where the growth of the recording is reported.
    pub growth: Growth,
    /// By whose time it is flushed.
    pub clock: Clock,
}

/// Where a bag begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Place {
    /// In a folder that it makes, and that must not be there yet.
    #[default]
    New,
    /// In a folder that was made for it alone, so that no other recording takes the same name.
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
