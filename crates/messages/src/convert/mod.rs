//! From [`Data`] to its ROS message and back.

mod encode;
mod decode;
mod description;
mod earlier;
mod schema;

use teampulse_core::data::Data;
use teampulse_core::time::Time;
use thiserror::Error;

use crate::cdr::CdrError;

pub use decode::decode;
pub use description::MOST_CHANNELS;
pub use earlier::description;
pub use encode::encode;
pub use schema::{schema_of, shape_of, type_name};

/// A sample from one of our own messages.
#[derive(Clone, Debug)]
pub struct Decoded {
    /// The stamp of its header: when it was measured, or for a description when it was declared.
    pub stamp: Time,
    /// The device's own clock [ns]; `None` when it has none.
    pub device_time: Option<i64>,
    /// Its number in the stream; `None` for shapes that are not numbered on the wire.
    pub index: Option<u64>,
    /// What it holds.
    pub data: Data,
}

/// Why a message is not one of ours.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum DecodeError {
    /// Its bytes are no such message.
    #[error(transparent)]
    Cdr(#[from] CdrError),
    /// Its type is not one of ours.
    #[error("read a {0}: it is not a type of teampulse_msgs")]
    Type(String),
    /// A field holds a word that is not in its list.
    #[error("read {field} {word:?}: expected one of {expected}")]
    Word {
        /// The field.
        field: &'static str,
        /// What it holds.
        word: String,
        /// What it may hold.
        expected: String,
    },
    /// A field holds a code that is not in its list.
    #[error("read {field} {code}: it is not a known code")]
    Code {
        /// The field.
        field: &'static str,
        /// What it holds.
        code: u8,
    },
    /// A field has another length than the rest of the message asks for.
    #[error("read {length} {field}: expected {expected}")]
    Length {
        /// The field.
        field: &'static str,
        /// How many it has.
        length: usize,
        /// How many it should have.
        expected: String,
    },
    /// It is larger than any device sends.
    #[error("read a message of {0} bytes: expected at most 16 MiB")]
    Large(usize),
    /// The period of a wave is no span of time.
    #[error("read a period of {0} ns: expected a finite one that is not negative")]
    Period(f64),
}
