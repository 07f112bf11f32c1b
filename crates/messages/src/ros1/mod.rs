//! Converts ROS 1 messages to ROS 2: their definitions, and their bytes to CDR.
//!
//! ROS 1 serialises fields in order, little-endian, without padding; strings and sequences begin with a 32-bit count.
//! Source: <http://wiki.ros.org/msg>, and `genmsg` for how definitions are read.

mod definition;
mod serialized;

use teampulse_core::stream::Schema;
use thiserror::Error;

use crate::cdr::Writer;
use crate::definition::{Definition, DefinitionError};
use serialized::Serialized;

use bytes::Bytes;

/// A ROS 1 type, with the ROS 2 type to which its messages are converted.
#[derive(Debug)]
pub struct Ros1Type {
    schema: Schema,
    definition: Definition,
    /// Whether its headers begin with a sequence number, which ROS 2 no longer has.
    has_sequence_numbers: bool,
}

/// Why a ROS 1 message could not be converted. Fits after "failed to".
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum Ros1Error {
    /// A value extends beyond the end of the message.
    #[error("read {needed} bytes at byte {at} of a message: {left} are left")]
    Short {
        /// The number of bytes needed.
        needed: usize,
        /// The offset of the value [bytes].
        at: usize,
        /// The number of bytes left there.
        left: usize,
    },
    /// The message continues after its last field.
    #[error("match a message of {length} bytes with its definition: its fields end at byte {at}")]
    Long {
        /// The length of the message [bytes].
        length: usize,
        /// The offset of the end of its last field [bytes].
        at: usize,
    },
    /// The message would become far larger, as it contains sequences of empty messages.
    #[error("convert a message to more than {0} bytes")]
    Large(usize),
}

impl Ros1Type {
    /// Reads a definition as stored in a ROS 1 bag: `type_name` is `package/Type`, and the text is that of the type,
    /// then of each type that it refers to, after a line of 80 `=` and a line `MSG: package/Type`.
    pub fn parse(type_name: &str, text: &str) -> Result<Ros1Type, DefinitionError> {
        let translated = definition::translate(type_name, text)?;
        let definition = Definition::parse(&translated.name, &translated.text)?;
        let schema = Schema {
            name: translated.name,
            encoding: "ros2msg".to_owned(),
            text: translated.text,
            hash: definition.hash(),
        };
        let has_sequence_numbers = translated.has_sequence_numbers;
        Ok(Ros1Type { schema, definition, has_sequence_numbers })
    }

    /// The type in ROS 2: its name with `/msg/`, fields and constants named by ROS 2 rules.
    pub fn schema(&self) -> &Schema {
        &self.schema
    }

    /// Converts a message.
    pub fn cdr(&self, message: &[u8]) -> Result<Bytes, Ros1Error> {
        let mut from = Serialized::new(message, self.has_sequence_numbers);
        let mut to = Writer::new();
        from.convert(self.definition.root(), &mut to)?;
        from.ended().map(|()| to.finish())
    }
}

#[cfg(test)]
mod tests;
