use std::sync::Arc;

/// The name of the field that a type without any is given, as CDR has no empty struct.
pub const EMPTY: &str = "structure_needs_at_least_one_member";

/// The fields of one type.
#[derive(Debug)]
pub struct Struct {
    /// The full name: `sensor_msgs/msg/BatteryState`.
    pub name: String,
    /// Its fields in their order; there is at least one, see [`EMPTY`].
    pub fields: Vec<Field>,
    /// Its constants.
    pub constants: Vec<Constant>,
    pub(super) least_bytes: u64,
    pub(super) depth: usize,
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
    pub(super) fn new(name: String, fields: Vec<Field>, constants: Vec<Constant>) -> Struct {
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
