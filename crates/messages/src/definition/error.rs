use thiserror::Error;

use super::link::DEEPEST;

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
    #[error("{0:?} is not the name of a field")]
    FieldName(String),
    /// Two fields have the same name.
    #[error("there are two fields named {0}")]
    Twice(String),
    /// The type can't be read.
    #[error("{0:?} is not a type")]
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
pub(super) struct Misread {
    pub line: usize,
    pub problem: Problem,
}
