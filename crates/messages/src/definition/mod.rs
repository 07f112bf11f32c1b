//! Definitions of message types: the fields of a type and of all types that it refers to.

mod structure;
mod error;
mod link;
mod sections;
mod declaration;
mod name;
mod assemble;
mod describe;
mod hash;
mod walk;

use std::sync::Arc;

use teampulse_core::stream::Schema;

pub use assemble::{AssembleError, assemble};
pub use error::{DefinitionError, Problem};
pub use structure::{Constant, Count, EMPTY, Field, Kind, Number, Struct};

/// The definition of a message type.
#[derive(Clone, Debug)]
pub struct Definition {
    root: Arc<Struct>,
}

impl Definition {
    /// Parses a definition in rosbag2's format: the `.msg` text of the type, then the texts of the types that it refers
    /// to, each after a line of 80 `=` and a line `MSG: package/Type`.
    pub fn parse(type_name: &str, text: &str) -> Result<Definition, DefinitionError> {
        link::read(type_name, text).map(|root| Definition { root })
    }

    /// Splits a definition into `.msg` texts, that of the type itself first, each with the full name of its type.
    /// [`assemble`] joins them again.
    pub fn parts(type_name: &str, text: &str) -> Result<Vec<(String, String)>, DefinitionError> {
        sections::parts(type_name, text)
    }

    /// Parses the definition in a schema.
    pub fn of(schema: &Schema) -> Result<Definition, DefinitionError> {
        let type_name = || schema.name.clone();
        match schema.encoding.as_str() {
            _ if schema.text.is_empty() => Err(DefinitionError::Unknown(type_name())),
            "ros2msg" => Definition::parse(&schema.name, &schema.text),
            other => Err(DefinitionError::Encoding {
                type_name: type_name(),
                encoding: other.to_owned(),
            }),
        }
    }

    /// The full name of the type.
    pub fn name(&self) -> &str {
        &self.root.name
    }

    /// The type itself.
    pub fn root(&self) -> &Struct {
        &self.root
    }
}
