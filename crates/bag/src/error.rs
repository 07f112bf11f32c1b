//! What can go wrong with a bag.

use std::io;
use std::path::{Path, PathBuf};

use mcap::McapError;
use thiserror::Error;

/// What can go wrong with a bag. The message fits after "failed to".
#[derive(Debug, Error)]
pub enum BagError {
    /// A recording never overwrites another.
    #[error("record to {}: it exists already", path.display())]
    Exists {
        /// The folder.
        path: PathBuf,
    },
    /// The disk has no more room; what was recorded before is whole.
    #[error("record to {}: the disk is full", path.display())]
    DiskFull {
        /// The bag's folder.
        path: PathBuf,
    },
    /// It is something else.
    #[error("open {}: {found}, not an MCAP bag", path.display())]
    NotABag {
        /// The file or folder.
        path: PathBuf,
        /// What it seems to be.
        found: Found,
    },
    /// The operating system refused.
    #[error("{doing} {}: {error}", path.display())]
    Io {
        /// What was tried: `read`, `write`.
        doing: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// Why it was refused.
        #[source]
        error: io::Error,
    },
    /// A file's contents make no sense here.
    #[error("read {} at byte {offset}: {reason}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where in it.
        offset: u64,
        /// What was expected and found.
        reason: String,
    },
    /// A message could not be encoded into the file's format.
    #[error("write {}: {error}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Why not.
        #[source]
        error: McapError,
    },
}

/// What was found where a bag was expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum Found {
    /// An `SQLite` file of rosbag2.
    #[error("a rosbag2 recording in SQLite")]
    Sqlite,
    /// A bag of ROS 1.
    #[error("a ROS 1 bag")]
    Ros1,
    /// A bag that rosbag2 compressed as a whole, or message by message.
    #[error("a recording that rosbag2 compressed outside MCAP")]
    Compressed,
    /// A folder without any MCAP file.
    #[error("a folder without MCAP files")]
    NoFiles,
    /// Any other file.
    #[error("another kind of file")]
    Other,
}

impl BagError {
    /// What the user can do about it; may be empty.
    pub fn hint(&self) -> &'static str {
        match self {
            BagError::Exists { .. } => "choose another folder, or move the recording away",
            BagError::DiskFull { .. } => "free some space, or record to another disk with --out",
            BagError::NotABag { found, .. } => found.hint(),
            BagError::Damaged { .. } => "run `teampulse recover` to keep what is whole",
            BagError::Io { .. } | BagError::Format { .. } => "",
        }
    }

    pub(crate) fn io(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> BagError {
        move |error| BagError::Io { doing, path: path.to_owned(), error }
    }
}

impl Found {
    fn hint(self) -> &'static str {
        match self {
            Found::Sqlite => "convert it with `ros2 bag convert` to storage_id mcap",
            Found::Ros1 => "convert it with `rosbags-convert` to a rosbag2 in MCAP",
            Found::Compressed => {
                "convert it with `ros2 bag convert` to compression_mode none; \
                 MCAP compresses its own chunks"
            }
            Found::NoFiles | Found::Other => {
                "give the folder of a recording or one of its .mcap files"
            }
        }
    }
}
