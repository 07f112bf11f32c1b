//! CDR, the serialisation of ROS messages on the wire and in bags.
//!
//! The writer produces little-endian XCDR1 with its four-byte header (`00 01 00 00`), like every ROS 2 middleware. The
//! reader also accepts big-endian data and plain XCDR2. It never trusts a length: a length that exceeds the remaining
//! bytes is an error before anything is allocated.

mod value;
mod reader;
mod writer;

use thiserror::Error;

pub use reader::Reader;
pub use value::Cdr;
pub use writer::Writer;

/// An error in reading CDR.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum CdrError {
    /// There are fewer bytes than the four-byte header needs.
    #[error("read a message of {0} bytes: the header alone has four")]
    NoHeader(usize),
    /// The representation in the header is not used for ROS messages.
    #[error("read a message in representation {0:#06x}: expected CDR (0, 1) or plain CDR2 (6, 7)")]
    Representation(u16),
    /// A value, or a sequence of the stated length, extends beyond the end.
    #[error("read {needed} bytes at byte {at} of a message: {left} are left")]
    Short {
        /// The minimum number of bytes needed.
        needed: u64,
        /// The offset of the value after the header [bytes].
        at: usize,
        /// The number of bytes left there.
        left: usize,
    },
}
