//! Avro's object container files, read with the schema that they contain: the part of the format that devices use.
//!
//! Apache Avro 1.11 specification. The crate `apache-avro` has 25 dependencies, and builds a tree of values in
//! which each number of an array takes 56 bytes.

use std::collections::BTreeMap;
use std::io::Read;

use flate2::read::DeflateDecoder;

use crate::cursor::Cursor;
use crate::error::FormatError;
use crate::recording::bounded;

mod json;
mod schema;

use schema::{Kind, Schemas};

/// The first bytes of a container file.
pub(crate) const MAGIC: &[u8] = b"Obj\x01";
/// The most bytes to which a block may unpack.
const MOST_BYTES: u64 = 256 << 20;
/// How many numbers any other value counts as, towards the memory limit.
const NUMBERS_A_VALUE: usize = 16;
/// The deepest nesting of values.
const MOST_DEPTH: usize = 64;

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    Null,
    Number(f64),
    Integer(i64),
    Text(String),
    /// An array of numbers only, which is most of a file.
    Numbers(Vec<f64>),
    Integers(Vec<i64>),
    Array(Vec<Value>),
    Record(BTreeMap<String, Value>),
    /// Bytes, whose contents are not used here.
    Bytes,
}

impl Value {
    /// The value at a path of fields.
    pub(crate) fn at(&self, path: &[&str]) -> Option<&Value> {
        path.iter().try_fold(self, |value, name| match value {
            Value::Record(fields) => fields.get(*name),
            _ => None,
        })
    }

    pub(crate) fn number(&self) -> Option<f64> {
        match self {
            Value::Number(number) => Some(*number),
            Value::Integer(integer) => Some(*integer as f64),
            _ => None,
        }
    }

    pub(crate) fn integer(&self) -> Option<i64> {
        match self {
            Value::Integer(integer) => Some(*integer),
            _ => None,
        }
    }

    /// The numbers of an array.
    pub(crate) fn numbers(&self) -> Option<Vec<f64>> {
        match self {
            Value::Numbers(numbers) => Some(numbers.clone()),
            Value::Integers(integers) => Some(integers.iter().map(|each| *each as f64).collect()),
            Value::Array(values) => values.iter().map(Value::number).collect(),
            _ => None,
        }
    }

    /// The integers of an array.
    pub(crate) fn integers(&self) -> Option<Vec<i64>> {
        match self {
            Value::Integers(integers) => Some(integers.clone()),
            Value::Array(values) => values.iter().map(Value::integer).collect(),
            _ => None,
        }
    }
}

/// The values of a container file.
pub(crate) fn read(bytes: &[u8]) -> Result<Vec<Value>, FormatError> {
    let mut file = Cursor::new(bytes, "its header");
    if file.take(MAGIC.len())? != MAGIC {
        return Err(FormatError::malformed("its first bytes", "", "an Avro container file"));
    }
    let (schema, codec) = header(&mut file)?;
    let sync: [u8; 16] = file.array()?;
    let (schemas, root) = Schemas::parse(&schema)?;
    let mut values = Vec::new();
    let mut reader = Reader { schemas: &schemas, numbers: 0 };
    let mut file = Cursor::new(file.rest(), "a block");
    while !file.is_empty() {
        let (count, length) = (long(&mut file)?, long(&mut file)?);
        let packed = file.length(length as u64)?;
        let unpacked;
        let block = match &*codec {
            "null" => packed,
            "deflate" => {
                unpacked = inflated(packed)?;
                &unpacked
            }
            other => return Err(FormatError::Unsupported(format!("Avro's codec {other}"))),
        };
        let mut block = Cursor::new(block, "a record");
        for _ in 0..count {
            reader.count(NUMBERS_A_VALUE)?;
            values.push(reader.value(&mut block, root, 0)?);
        }
        if file.array::<16>()? != sync {
            return Err(FormatError::malformed("the end of a block", "", "the file's sync marker"));
        }
    }
    Ok(values)
}

/// Reads the schema and the codec from the header.
fn header(file: &mut Cursor<'_>) -> Result<(String, String), FormatError> {
    let (mut schema, mut codec) = (String::new(), "null".to_owned());
    loop {
        let count = block_count(file)?;
        if count == 0 {
            return Ok((schema, codec));
        }
        for _ in 0..count {
            let (key, value) = (text(file)?, text(file)?);
            match &*key {
                "avro.schema" => schema = value,
                "avro.codec" => codec = value,
                _ => {}
            }
        }
    }
}

fn inflated(packed: &[u8]) -> Result<Vec<u8>, FormatError> {
    let mut unpacked = Vec::new();
    let mut decoder = DeflateDecoder::new(packed).take(MOST_BYTES + 1);
    decoder.read_to_end(&mut unpacked).map_err(|error| FormatError::Archive(error.to_string()))?;
    if unpacked.len() as u64 > MOST_BYTES { Err(FormatError::TooLarge) } else { Ok(unpacked) }
}

/// The number of items in the next block of an array or a map; 0 at its end.
fn block_count(file: &mut Cursor<'_>) -> Result<u64, FormatError> {
    let count = long(file)?;
    if count < 0 {
        long(file)?;
    }
    Ok(count.unsigned_abs())
}

/// Reads a zig-zag encoded integer of up to ten bytes.
fn long(file: &mut Cursor<'_>) -> Result<i64, FormatError> {
    let mut number = 0_u64;
    for shift in (0..64).step_by(7) {
        let byte = file.u8()?;
        number |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Ok((number >> 1) as i64 ^ -((number & 1) as i64));
        }
    }
    Err(FormatError::malformed("an integer", "", "at most ten bytes"))
}

fn text(file: &mut Cursor<'_>) -> Result<String, FormatError> {
    let length = long(file)?;
    Ok(String::from_utf8_lossy(file.length(length as u64)?).into_owned())
}

/// Reads values of a schema.
struct Reader<'a> {
    schemas: &'a Schemas,
    /// The size of the values so far, in numbers.
    numbers: usize,
}

impl Reader<'_> {
    /// Counts values towards the limit, which also bounds values that take no bytes.
    fn count(&mut self, count: usize) -> Result<(), FormatError> {
        self.numbers = self.numbers.saturating_add(count);
        bounded(self.numbers)
    }

    fn value(
        &mut self,
        file: &mut Cursor<'_>,
        of: usize,
        depth: usize,
    ) -> Result<Value, FormatError> {
        if depth > MOST_DEPTH {
            return Err(FormatError::malformed("a record", "", "less deeply nested values"));
        }
        Ok(match self.schemas.kind(of) {
            Kind::Null => Value::Null,
            Kind::Boolean => Value::Integer(file.u8()?.into()),
            Kind::Long | Kind::Enum => Value::Integer(long(file)?),
            Kind::Float => Value::Number(f32::from_le_bytes(file.array()?).into()),
            Kind::Double => Value::Number(file.f64()?),
            Kind::Text => Value::Text(text(file)?),
            Kind::Bytes => {
                let length = long(file)?;
                file.length(length as u64)?;
                Value::Bytes
            }
            Kind::Fixed(size) => {
                file.take(*size)?;
                Value::Bytes
            }
            Kind::Array(items) => self.array(file, *items, depth)?,
            Kind::Map(values) => self.map(file, *values, depth)?,
            Kind::Union(branches) => {
                let branch =
                    usize::try_from(long(file)?).ok().and_then(|place| branches.get(place));
                let branch = branch.ok_or_else(|| {
                    FormatError::malformed("a union", "", "the index of one of its branches")
                })?;
                self.value(file, *branch, depth + 1)?
            }
            Kind::Record(fields) => {
                let mut record = BTreeMap::new();
                for (name, of) in fields {
                    self.count(NUMBERS_A_VALUE)?;
                    record.insert(name.clone(), self.value(file, *of, depth + 1)?);
                }
                Value::Record(record)
            }
        })
    }

    fn array(
        &mut self,
        file: &mut Cursor<'_>,
        items: usize,
        depth: usize,
    ) -> Result<Value, FormatError> {
        let kind = self.schemas.kind(items);
        let (is_real, is_integer) =
            (matches!(kind, Kind::Float | Kind::Double), matches!(kind, Kind::Long));
        let (mut numbers, mut integers, mut values) = (Vec::new(), Vec::new(), Vec::new());
        loop {
            let count = block_count(file)?;
            if count == 0 {
                break;
            }
            for _ in 0..count {
                self.count(if is_real || is_integer { 1 } else { NUMBERS_A_VALUE })?;
                match self.value(file, items, depth + 1)? {
                    Value::Number(number) if is_real => numbers.push(number),
                    Value::Integer(integer) if is_integer => integers.push(integer),
                    value => values.push(value),
                }
            }
        }
        Ok(match (is_real, is_integer) {
            (true, _) => Value::Numbers(numbers),
            (_, true) => Value::Integers(integers),
            _ => Value::Array(values),
        })
    }

    fn map(
        &mut self,
        file: &mut Cursor<'_>,
        values: usize,
        depth: usize,
    ) -> Result<Value, FormatError> {
        let mut map = BTreeMap::new();
        loop {
            let count = block_count(file)?;
            if count == 0 {
                return Ok(Value::Record(map));
            }
            for _ in 0..count {
                self.count(NUMBERS_A_VALUE)?;
                let name = text(file)?;
                map.insert(name, self.value(file, values, depth + 1)?);
            }
        }
    }
}
