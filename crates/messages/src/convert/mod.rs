//! Conversion between [`Data`] and its ROS message.

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

/// A sample decoded from one of our own messages.
#[derive(Clone, Debug)]
pub struct Decoded {
    /// The stamp of the message's header: the time of measurement or, for a description, of declaration.
    pub stamp: Time,
    /// The time by the device's own clock [ns]; `None` if it has no clock.
    pub device_time: Option<i64>,
    /// The sample's index in the stream; `None` for shapes without an index on the wire.
    pub index: Option<u64>,
    /// The content of the sample.
    pub data: Data,
}

/// Why a message can't be decoded as one of ours.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum DecodeError {
    /// The bytes are not a valid message of this type.
    #[error(transparent)]
    Cdr(#[from] CdrError),
    /// The type is not one of ours.
    #[error("read a {0}: it is not a type of teampulse_msgs")]
    Type(String),
    /// A field contains a word that is not in its list.
    #[error("read {field} {word:?}: expected one of {expected}")]
    Word {
        /// The field.
        field: &'static str,
        /// The value of the field.
        word: String,
        /// The valid values.
        expected: String,
    },
    /// A field contains a code that is not in its list.
    #[error("read {field} {code}: it is not a known code")]
    Code {
        /// The field.
        field: &'static str,
        /// The value of the field.
        code: u8,
    },
    /// The length of a field does not match the rest of the message.
    #[error("read {length} {field}: expected {expected}")]
    Length {
        /// The field.
        field: &'static str,
        /// The length of the field.
        length: usize,
        /// The length expected.
        expected: String,
    },
    /// The message is larger than any that a device sends.
    #[error("read a message of {0} bytes: expected at most 16 MiB")]
    Large(usize),
    /// The period of a wave is not a valid duration.
    #[error("read a period of {0} ns: expected a finite number that is not negative")]
    Period(f64),
}
