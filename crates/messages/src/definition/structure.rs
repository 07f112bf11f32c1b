use std::sync::Arc;

/// The name of the placeholder field in a type without fields, as CDR has no empty struct.
pub const EMPTY: &str = "structure_needs_at_least_one_member";

/// The fields of one type.
#[derive(Debug)]
pub struct Struct {
    /// The full name: `sensor_msgs/msg/BatteryState`.
    pub name: String,
    /// The fields in order; there is at least one, see [`EMPTY`].
    pub fields: Vec<Field>,
    /// The constants of the type.
    pub constants: Vec<Constant>,
    pub(super) least_bytes: u64,
    pub(super) depth: usize,
}

/// A field of a type.
#[derive(Debug)]
pub struct Field {
    /// The field's name.
    pub name: String,
    /// The type of the field's values.
    pub kind: Kind,
    /// The number of values in the field.
    pub count: Count,
    /// The default value, as written in the definition; empty for none.
    pub default: String,
}

/// The type of a field's values.
#[derive(Clone, Debug)]
pub enum Kind {
    /// A number.
    Number(Number),
    /// A string, with its bound [bytes].
    Text(Option<u64>),
    /// A string of 16-bit units, with its bound [units].
    WideText(Option<u64>),
    /// A nested message.
    Struct(Arc<Struct>),
}

/// The kinds of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names are self-explanatory")]
pub enum Number {
    Bool,
    /// An uninterpreted octet.
    Byte,
    /// The same as `uint8`, since ROS 2.
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

/// The number of values in a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// A single value.
    One,
    /// A fixed-size array.
    Array(u64),
    /// A bounded sequence.
    AtMost(u64),
    /// An unbounded sequence.
    Any,
}

/// A named constant.
#[derive(Debug)]
pub struct Constant {
    /// The constant's name.
    pub name: String,
    /// The constant's type: a number or a string.
    pub kind: Kind,
    /// The constant's value, as written in the definition.
    pub value: String,
}

impl Kind {
    /// The minimum number of bytes of a value, excluding padding.
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

    /// The minimum number of bytes of a value, excluding padding.
    pub fn least_bytes(&self) -> u64 {
        self.least_bytes
    }
}

impl Field {
    /// The minimum number of bytes of the field, excluding padding.
    pub fn least_bytes(&self) -> u64 {
        match self.count {
            Count::One => self.kind.least_bytes(),
            Count::Array(count) => self.kind.least_bytes().saturating_mul(count),
            Count::AtMost(_) | Count::Any => 4,
        }
    }
}

impl Number {
    /// The size of the number [bytes].
    pub fn bytes(self) -> usize {
        match self {
            Number::Bool | Number::Byte | Number::Char | Number::Int8 | Number::Uint8 => 1,
            Number::Int16 | Number::Uint16 => 2,
            Number::Int32 | Number::Uint32 | Number::Float32 => 4,
            Number::Int64 | Number::Uint64 | Number::Float64 => 8,
        }
    }
}
