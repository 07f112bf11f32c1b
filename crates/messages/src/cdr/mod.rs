//! CDR, the form in which ROS messages travel and are stored.
//!
//! Written is XCDR1, little endian, with its four-byte header (`00 01 00 00`): what every ROS 2
//! middleware writes. Read are also big endian and plain XCDR2. A reader never trusts a length: what
//! does not fit into the bytes that are left is an error before anything is allocated.

mod value;
mod reader;
mod writer;

use thiserror::Error;

pub use reader::Reader;
pub use value::Cdr;
pub use writer::Writer;

/// Why bytes could not be read as CDR.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum CdrError {
    /// There are too few bytes for the four-byte header.
    #[error("read a message of {0} bytes: even its header has four")]
    NoHeader(usize),
    /// The header names a representation that ROS messages don't use.
    #[error("read a message in representation {0:#06x}: expected CDR (0, 1) or plain CDR2 (6, 7)")]
    Representation(u16),
    /// A value, or a sequence by its own count, reaches beyond the end.
    #[error("read {needed} bytes at byte {at} of a message: {left} are left")]
    Short {
        /// How many bytes it takes at least.
        needed: u64,
        /// Where it begins, counted from the end of the header.
        at: usize,
        /// How many bytes are left there.
        left: usize,
    },
}
