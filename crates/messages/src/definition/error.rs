use thiserror::Error;

use super::link::DEEPEST;

/// Why a text is not a valid type definition.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DefinitionError {
    /// A line can't be parsed.
    #[error("read line {line} of the definition of {type_name}: {problem}")]
    Line {
        /// The type being defined.
        type_name: String,
        /// The line number in the text, starting at 1.
        line: usize,
        /// The problem with the line.
        problem: Problem,
    },
    /// This is not a valid type name.
    #[error("read a type named {0:?}: expected package/msg/Type")]
    Name(String),
    /// Only the name of the type is known.
    #[error("read the definition of {0}: it is not known")]
    Unknown(String),
    /// The definition is written in a different language.
    #[error("read the definition of {type_name}: expected ros2msg, not {encoding}")]
    Encoding {
        /// The type being defined.
        type_name: String,
        /// The language.
        encoding: String,
    },
}

/// The problem with a line of a definition.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Problem {
    /// The name is missing after the type.
    #[error("expected a type and a name, got {0:?}")]
    Incomplete(String),
    /// This is not a valid field name.
    #[error("{0:?} is not the name of a field")]
    FieldName(String),
    /// Two fields have the same name.
    #[error("there are two fields named {0}")]
    Twice(String),
    /// This is not a valid type.
    #[error("{0:?} is not a type")]
    Type(String),
    /// The type is not defined in the text.
    #[error("{0} is not defined")]
    Undefined(String),
    /// A constant is neither a number nor a string.
    #[error("{0} can't be the type of a constant")]
    Constant(String),
    /// A type contains itself.
    #[error("{0} contains itself")]
    Recursive(String),
    /// Types are nested too deep.
    #[error("types are nested more than {DEEPEST} deep")]
    Deep,
    /// The message would exceed the size limit.
    #[error("it takes at least {0} bytes")]
    Large(u64),
    /// The separator between two types is not followed by a name.
    #[error("expected `MSG: package/Type` below the line between two types")]
    Separator,
}

/// A problem, and the number of its line.
pub(super) struct Misread {
    pub line: usize,
    pub problem: Problem,
}
