//! The messages published or read here, as plain structs; one module per package.
//!
//! Any other message is read by its definition; see [`fields`](crate::fields).

pub mod std_msgs;
pub mod geometry_msgs;
pub mod nav_msgs;
pub mod sensor_msgs;
pub mod diagnostic_msgs;
pub mod hri_msgs;
pub mod wireless_msgs;
pub mod rosgraph_msgs;
pub mod rmw_dds_common;
pub mod rcl_interfaces;
pub mod type_description_interfaces;
pub mod teampulse_msgs;

use bytes::Bytes;

use crate::cdr::{Cdr, CdrError, Reader, Writer};

/// A message type with its ROS name.
pub trait Message: Cdr {
    /// The full name of the type: `sensor_msgs/msg/BatteryState`.
    const NAME: &'static str;

    /// Encodes the message as CDR with its four-byte header.
    fn encode(&self) -> Bytes {
        let mut writer = Writer::new();
        self.write(&mut writer);
        writer.finish()
    }

    /// Decodes the message from CDR with its four-byte header. Trailing bytes are ignored, as middlewares
    /// pad messages.
    fn decode(cdr: &[u8]) -> Result<Self, CdrError> {
        Reader::new(cdr)?.read()
    }
}

/// Implements the CDR form of a struct: its fields, in this order.
macro_rules! message {
    ($name:ident { $($field:ident),* $(,)? } = $ros_name:literal) => {
        impl $crate::cdr::Cdr for $name {
            fn write(&self, to: &mut $crate::cdr::Writer) {
                let $name { $($field),* } = self;
                $(to.write($field);)*
            }

            fn read(
                from: &mut $crate::cdr::Reader<'_>,
            ) -> Result<$name, $crate::cdr::CdrError> {
                $(let $field = from.read()?;)*
                Ok($name { $($field),* })
            }
        }

        impl $crate::standard::Message for $name {
            const NAME: &'static str = $ros_name;
        }
    };
}
use message;
