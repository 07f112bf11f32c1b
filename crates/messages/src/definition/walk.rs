use super::{Count, Field, Kind, Number, Struct};
use crate::cdr::{CdrError, Reader};

impl Struct {
    /// Skips a message of this type.
    pub(crate) fn skip(&self, from: &mut Reader<'_>) -> Result<(), CdrError> {
        self.fields.iter().try_for_each(|field| field.skip(from))
    }
}

impl Field {
    /// Skips the field.
    pub(crate) fn skip(&self, from: &mut Reader<'_>) -> Result<(), CdrError> {
        let count = self.count.read(&self.kind, from)?;
        self.kind.skip(count, from)
    }
}

impl Count {
    /// Reads the number of values, unless the definition fixes it.
    pub(crate) fn read(self, kind: &Kind, from: &mut Reader<'_>) -> Result<usize, CdrError> {
        match self {
            Count::One => Ok(1),
            Count::Array(count) => Ok(count as usize),
            Count::AtMost(_) | Count::Any => from.count(kind.least_bytes() as usize),
        }
    }
}

impl Kind {
    /// Skips `count` values.
    pub(crate) fn skip(&self, count: usize, from: &mut Reader<'_>) -> Result<(), CdrError> {
        match self {
            Kind::Number(number) => from.numbers(count, number.bytes()).map(|_| ()),
            Kind::Text(_) => (0..count).try_for_each(|_| from.text().map(|_| ())),
            Kind::WideText(_) => (0..count).try_for_each(|_| from.wide_text().map(|_| ())),
            Kind::Struct(nested) => (0..count).try_for_each(|_| nested.skip(from)),
        }
    }
}

impl Number {
    /// Reads the next number.
    pub(crate) fn read(self, from: &mut Reader<'_>) -> Result<f64, CdrError> {
        Ok(match self {
            Number::Bool => f64::from(u8::from(from.read::<bool>()?)),
            Number::Byte | Number::Char | Number::Uint8 => f64::from(from.read::<u8>()?),
            Number::Int8 => f64::from(from.read::<i8>()?),
            Number::Int16 => f64::from(from.read::<i16>()?),
            Number::Uint16 => f64::from(from.read::<u16>()?),
            Number::Int32 => f64::from(from.read::<i32>()?),
            Number::Uint32 => f64::from(from.read::<u32>()?),
            Number::Int64 => from.read::<i64>()? as f64,
            Number::Uint64 => from.read::<u64>()? as f64,
            Number::Float32 => f64::from(from.read::<f32>()?),
            Number::Float64 => from.read::<f64>()?,
        })
    }
}
