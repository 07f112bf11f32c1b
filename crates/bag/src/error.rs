//! The errors of reading and writing bags.

use std::io;
use std::path::{Path, PathBuf};

use mcap::McapError;
use thiserror::Error;

/// An error in reading or writing a bag. The message fits after "failed to".
#[derive(Debug, Error)]
pub enum BagError {
    /// The folder of a new recording already exists; recordings are never overwritten.
    #[error("record to {}: it already exists", path.display())]
    Exists {
        /// The folder.
        path: PathBuf,
    },
    /// The disk is full; everything recorded before is intact.
    #[error("record to {}: the disk is full", path.display())]
    DiskFull {
        /// The bag's folder.
        path: PathBuf,
    },
    /// The path is not a bag.
    #[error("open {}: {found}, not an MCAP bag", path.display())]
    NotABag {
        /// The file or folder.
        path: PathBuf,
        /// What it appears to be instead.
        found: Found,
    },
    /// The bag can't be repaired, as another program is writing it.
    #[error("repair {}: it is still being written", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// A file was deleted or moved while it was being recorded.
    #[error("record to {}: it was deleted while it was recorded", path.display())]
    Deleted {
        /// The file.
        path: PathBuf,
    },
    /// The operating system returned an error.
    #[error("{doing} {}: {error}", path.display())]
    Io {
        /// The operation: `read`, `write`.
        doing: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        #[source]
        error: io::Error,
    },
    /// The contents of a file are invalid.
    #[error("read {} at byte {offset}: {reason}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The offset in the file [bytes].
        offset: u64,
        /// What was expected and found.
        reason: String,
    },
    /// A message could not be encoded into the file's format.
    #[error("write {}: {error}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// The error of the encoder.
        #[source]
        error: McapError,
    },
}

/// What a path contains instead of a bag.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum Found {
    /// An `SQLite` file of another application, or a broken one.
    #[error("an SQLite file that is not a rosbag2 recording")]
    Sqlite,
    /// A recording that can be read, but not repaired: a ROS 1 bag, or a rosbag2 recording that is not plain MCAP.
    #[error("a ROS 1 bag, a recording in SQLite or a compressed file")]
    Foreign,
    /// A ROS 1 bag that is damaged at its start, or of a version before 2.0.
    #[error("a ROS 1 bag that is damaged at its start or older than version 2.0")]
    Ros1,
    /// An encrypted ROS 1 bag.
    #[error("an encrypted ROS 1 bag")]
    Encrypted,
    /// A recording compressed with something other than Zstandard, or a file that can't be decompressed.
    #[error("a recording that can't be decompressed")]
    Compressed,
    /// A folder without any MCAP file.
    #[error("a folder without MCAP files")]
    NoFiles,
    /// A file without any bytes.
    #[error("an empty file")]
    Empty,
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
            BagError::Damaged { .. } => "run `teampulse recover` to keep all readable messages",
            BagError::InUse { .. } => {
                "wait until its session has ended: the recording is then complete"
            }
            BagError::Deleted { .. } => {
                "keep the folder of a recording in place until it has ended"
            }
            BagError::Io { doing: "open" | "read" | "unpack", error, .. } => hint_of_reading(error),
            BagError::Io { error, .. } => hint_of(error),
            BagError::Format { .. } => "",
        }
    }

    pub(crate) fn io(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> BagError {
        move |error| BagError::Io { doing, path: path.to_owned(), error }
    }
}

/// The hint for an error of the operating system.
fn hint_of(error: &io::Error) -> &'static str {
    use io::ErrorKind::{FileTooLarge, NotFound, PermissionDenied, ReadOnlyFilesystem};
    match error.kind() {
        FileTooLarge => {
            "this account may not write larger files (`ulimit -f`): raise the limit, or set split_mib"
        }
        NotFound => "its folder was deleted or moved",
        PermissionDenied => "use --out to choose a folder that you can write to",
        ReadOnlyFilesystem => {
            "the disk can't be written: look at `dmesg`, or record to another disk with --out"
        }
        _ if matches!(error.raw_os_error(), Some(EMFILE | ENFILE)) => {
            "too many files are open: raise the limit (`ulimit -n`), or close other programs"
        }
        _ => "",
    }
}

/// The hint for a recording that can't be read.
fn hint_of_reading(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::NotFound => "give the folder of a recording, or its file",
        io::ErrorKind::PermissionDenied => {
            "a recording is private to the user who made it: read it as that user"
        }
        _ => hint_of(error),
    }
}

/// The error code for too many open files, in this process or on this machine.
const EMFILE: i32 = 24;
const ENFILE: i32 = 23;

impl Found {
    fn hint(self) -> &'static str {
        match self {
            Found::Foreign => "`teampulse import` makes a bag of all readable messages",
            Found::Ros1 => "repair it with ROS 1's `rosbag reindex` or `rosbag fix` first",
            Found::Encrypted => "decrypt it with ROS 1's `rosbag decrypt` first",
            Found::Compressed => {
                "convert it with `ros2 bag convert` to compression_mode none; \
                 MCAP compresses its own chunks"
            }
            Found::Empty => "nothing was recorded into it, or it was not copied",
            Found::Sqlite | Found::NoFiles | Found::Other => {
                "give the folder of a recording or one of its .mcap or .db3 files"
            }
        }
    }
}
