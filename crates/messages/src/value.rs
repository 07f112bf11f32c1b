//! A message as a list of its values, each with its path.

use std::fmt;

use crate::cdr::{CdrError, Reader};
use crate::definition::{Count, Definition, EMPTY, Field, Kind, Number, Struct};

/// A value of a message.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A boolean.
    Bool(bool),
    /// A signed integer.
    Int(i64),
    /// An unsigned integer.
    Uint(u64),
    /// A single-precision floating-point number.
    Float32(f32),
    /// A double-precision floating-point number.
    Float64(f64),
    /// A string.
    Text(String),
    /// The number of values in a field with too many to list.
    Many(usize),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Bool(value) => value.fmt(f),
            Value::Int(value) => value.fmt(f),
            Value::Uint(value) => value.fmt(f),
            Value::Float32(value) => value.fmt(f),
            Value::Float64(value) => value.fmt(f),
            Value::Text(value) => value.fmt(f),
            Value::Many(count) => f.pad(&format!("[{count} values]")),
        }
    }
}

/// The most values that are listed; after that, fields with several values are listed by their number of
/// values.
const MOST_VALUES: usize = 100_000;

/// The values of a message in order, each with its path. Of a field with more than `limit` values only their number is
/// listed; after the first hundred thousand values, this applies to every field with several values.
pub fn flatten(
    definition: &Definition,
    cdr: &[u8],
    limit: usize,
) -> Result<Vec<(String, Value)>, CdrError> {
    let mut list = List { from: Reader::new(cdr)?, limit, values: Vec::new() };
    list.message(definition.root(), "")?;
    Ok(list.values)
}

struct List<'a> {
    from: Reader<'a>,
    limit: usize,
    values: Vec<(String, Value)>,
}

impl List<'_> {
    fn message(&mut self, within: &Struct, prefix: &str) -> Result<(), CdrError> {
        within.fields.iter().try_for_each(|field| self.field(field, prefix))
    }

    fn field(&mut self, field: &Field, prefix: &str) -> Result<(), CdrError> {
        let path = format!("{prefix}{}", field.name);
        let count = field.count.read(&field.kind, &mut self.from)?;
        if field.name == EMPTY {
            field.kind.skip(count, &mut self.from)
        } else if field.count == Count::One {
            self.value(&field.kind, path)
        } else if count > self.limit || self.values.len() >= MOST_VALUES {
            self.values.push((path, Value::Many(count)));
            field.kind.skip(count, &mut self.from)
        } else {
            (0..count).try_for_each(|k| self.value(&field.kind, format!("{path}[{k}]")))
        }
    }

    fn value(&mut self, kind: &Kind, path: String) -> Result<(), CdrError> {
        let value = match kind {
            Kind::Struct(nested) => return self.message(nested, &format!("{path}.")),
            Kind::Number(number) => self.number(*number)?,
            Kind::Text(_) => Value::Text(self.from.read()?),
            Kind::WideText(_) => Value::Text(self.from.wide_text()?),
        };
        self.values.push((path, value));
        Ok(())
    }

    fn number(&mut self, number: Number) -> Result<Value, CdrError> {
        let from = &mut self.from;
        Ok(match number {
            Number::Bool => Value::Bool(from.read()?),
            Number::Byte | Number::Char | Number::Uint8 => Value::Uint(from.read::<u8>()?.into()),
            Number::Int8 => Value::Int(from.read::<i8>()?.into()),
            Number::Int16 => Value::Int(from.read::<i16>()?.into()),
            Number::Uint16 => Value::Uint(from.read::<u16>()?.into()),
            Number::Int32 => Value::Int(from.read::<i32>()?.into()),
            Number::Uint32 => Value::Uint(from.read::<u32>()?.into()),
            Number::Int64 => Value::Int(from.read()?),
            Number::Uint64 => Value::Uint(from.read()?),
            Number::Float32 => Value::Float32(from.read()?),
            Number::Float64 => Value::Float64(from.read()?),
        })
    }
}
