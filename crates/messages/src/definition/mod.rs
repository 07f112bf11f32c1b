//! Definitions of message types: the fields of a type and of all that it is made of.

mod link;
mod sections;
mod line;
mod name;
mod assemble;
mod describe;
mod hash;
mod walk;

use std::sync::Arc;

use teampulse_core::stream::Schema;
use thiserror::Error;

pub use assemble::{AssembleError, assemble};

/// The name of the field that a type without any is given, as CDR has no empty struct.
pub const EMPTY: &str = "structure_needs_at_least_one_member";

/// The definition of a message type.
#[derive(Clone, Debug)]
pub struct Definition {
    root: Arc<Struct>,
}

/// The fields of one type.
#[derive(Debug)]
pub struct Struct {
    /// The full name: `sensor_msgs/msg/BatteryState`.
    pub name: String,
    /// Its fields in their order; there is at least one, see [`EMPTY`].
    pub fields: Vec<Field>,
    /// Its constants.
    pub constants: Vec<Constant>,
    least_bytes: u64,
    depth: usize,
}

/// A field of a type.
#[derive(Debug)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// What it holds.
    pub kind: Kind,
    /// How many of them.
    pub count: Count,
    /// The value it begins with, as it is written in the definition; empty for none.
    pub default: String,
}

/// What a field holds.
#[derive(Clone, Debug)]
pub enum Kind {
    /// A number.
    Number(Number),
    /// A string, of at most so many bytes.
    Text(Option<u64>),
    /// A string of 16-bit units, of at most so many.
    WideText(Option<u64>),
    /// A message.
    Struct(Arc<Struct>),
}

/// The kinds of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it all")]
pub enum Number {
    Bool,
    /// Eight bits without a sign that mean anything.
    Byte,
    /// Since ROS 2 the same as `uint8`.
    Char,
    Int8,
    Uint8,
    Int16,
    Uint16,
    Int32,
    Uint32,
    Int64,
    Uint64,
    Float32,
    Float64,
}

/// How many values a field holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// One.
    One,
    /// Always so many.
    Array(u64),
    /// Any number up to so many.
    AtMost(u64),
    /// Any number.
    Any,
}

/// A name for a value.
#[derive(Debug)]
pub struct Constant {
    /// Its name.
    pub name: String,
    /// What it holds: a number or a text.
    pub kind: Kind,
    /// The value, as it is written in the definition.
    pub value: String,
}

/// Why a text is not the definition of a type.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DefinitionError {
    /// A line is not understood.
    #[error("read line {line} of the definition of {type_name}: {problem}")]
    Line {
        /// The type that was to be defined.
        type_name: String,
        /// The line in the text, counted from 1.
        line: usize,
        /// What is wrong with it.
        problem: Problem,
    },
    /// The name of the type is no such name.
    #[error("read a type named {0:?}: expected package/msg/Type")]
    Name(String),
    /// Only the name of the type is known.
    #[error("read the definition of {0}: it is not known")]
    Unknown(String),
    /// It is written in another language.
    #[error("read the definition of {type_name}: expected ros2msg, not {encoding}")]
    Encoding {
        /// The type that was to be defined.
        type_name: String,
        /// The language.
        encoding: String,
    },
}

/// What is wrong with a line of a definition.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Problem {
    /// It has no name behind its type.
    #[error("expected a type and a name, got {0:?}")]
    Incomplete(String),
    /// Something else stands where the name of a field should.
    #[error("{0:?} is no name of a field")]
    FieldName(String),
    /// Two fields have the same name.
    #[error("there are two fields named {0}")]
    Twice(String),
    /// The type can't be read.
    #[error("{0:?} is no type")]
    Type(String),
    /// The type is not defined in the text.
    #[error("{0} is not defined")]
    Undefined(String),
    /// A constant is neither a number nor a string.
    #[error("{0} can't be the type of a constant")]
    Constant(String),
    /// A type is part of itself.
    #[error("{0} is part of itself")]
    Recursive(String),
    /// Types are nested too deep.
    #[error("types are nested more than {DEEPEST} deep")]
    Deep,
    /// A message would be larger than any message is.
    #[error("it takes {0} bytes at least")]
    Large(u64),
    /// The line between two types is not followed by a name.
    #[error("expected `MSG: package/Type` below the line between two types")]
    Separator,
}

/// What is wrong with which line.
struct Misread {
    line: usize,
    problem: Problem,
}

/// How deep types may be nested.
pub const DEEPEST: usize = 32;

/// How much room the fixed parts of a message may take [bytes].
const LARGEST_BYTES: u64 = 1 << 30;

impl Definition {
    /// Reads a definition in the form that rosbag2 stores: the `.msg` text of the type, then that of
    /// each type it is made of behind a line of 80 `=` and a line `MSG: package/Type`.
    pub fn parse(type_name: &str, text: &str) -> Result<Definition, DefinitionError> {
        link::read(type_name, text).map(|root| Definition { root })
    }

    /// The `.msg` texts of which a definition is made: its own first, each with the full name of its
    /// type. [`assemble`] puts them together again.
    pub fn parts(type_name: &str, text: &str) -> Result<Vec<(String, String)>, DefinitionError> {
        link::parts(type_name, text)
    }

    /// Reads the definition of a schema.
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

impl Kind {
    /// How many bytes a value takes at least, padding not counted.
    pub fn least_bytes(&self) -> u64 {
        match self {
            Kind::Number(number) => number.bytes() as u64,
            Kind::Text(_) | Kind::WideText(_) => 4,
            Kind::Struct(nested) => nested.least_bytes,
        }
    }
}

impl Struct {
    fn new(name: String, fields: Vec<Field>, constants: Vec<Constant>) -> Struct {
        let least_bytes = fields.iter().map(Field::least_bytes).fold(0, u64::saturating_add);
        let nested = fields.iter().filter_map(|field| match &field.kind {
            Kind::Struct(nested) => Some(nested.depth),
            _ => None,
        });
        let depth = 1 + nested.max().unwrap_or(0);
        Struct { name, fields, constants, least_bytes, depth }
    }

    /// How many bytes a value takes at least, padding not counted.
    pub fn least_bytes(&self) -> u64 {
        self.least_bytes
    }
}

impl Field {
    /// How many bytes it takes at least, padding not counted.
    pub fn least_bytes(&self) -> u64 {
        match self.count {
            Count::One => self.kind.least_bytes(),
            Count::Array(count) => self.kind.least_bytes().saturating_mul(count),
            Count::AtMost(_) | Count::Any => 4,
        }
    }
}

impl Number {
    /// How many bytes it takes.
    pub fn bytes(self) -> usize {
        match self {
            Number::Bool | Number::Byte | Number::Char | Number::Int8 | Number::Uint8 => 1,
            Number::Int16 | Number::Uint16 => 2,
            Number::Int32 | Number::Uint32 | Number::Float32 => 4,
            Number::Int64 | Number::Uint64 | Number::Float64 => 8,
        }
    }
}
