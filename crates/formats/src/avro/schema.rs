//! The schema of a container file.

use std::collections::BTreeMap;

use super::json::Json;
use crate::error::FormatError;

/// The largest size of a fixed value [bytes].
const MOST_FIXED: f64 = 1e6;

/// The type of a value. Other schemas are referred to by their index.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Kind {
    Null,
    Boolean,
    /// `int` or `long`.
    Long,
    Float,
    Double,
    Text,
    Bytes,
    Enum,
    Fixed(usize),
    Array(usize),
    Map(usize),
    Union(Vec<usize>),
    Record(Vec<(String, usize)>),
}

/// All schemas of a file, by index.
#[derive(Debug, Default)]
pub(super) struct Schemas {
    kinds: Vec<Kind>,
    named: BTreeMap<String, usize>,
}

impl Schemas {
    /// Parses a schema, and returns the index of its root.
    pub(super) fn parse(text: &str) -> Result<(Schemas, usize), FormatError> {
        let json =
            Json::parse(text).ok_or_else(|| FormatError::malformed("its schema", text, "JSON"))?;
        let mut schemas = Schemas::default();
        let root = schemas.add(&json)?;
        Ok((schemas, root))
    }

    pub(super) fn kind(&self, of: usize) -> &Kind {
        &self.kinds[of]
    }

    fn push(&mut self, kind: Kind) -> usize {
        self.kinds.push(kind);
        self.kinds.len() - 1
    }

    fn add(&mut self, json: &Json) -> Result<usize, FormatError> {
        match json {
            Json::Text(word) => self.named(word),
            Json::Array(branches) => {
                let branches =
                    branches.iter().map(|branch| self.add(branch)).collect::<Result<_, _>>()?;
                Ok(self.push(Kind::Union(branches)))
            }
            Json::Object(_) => self.add_object(json),
            _ => Err(FormatError::malformed("its schema", "", "a type")),
        }
    }

    fn named(&mut self, word: &str) -> Result<usize, FormatError> {
        let kind = match word {
            "null" => Kind::Null,
            "boolean" => Kind::Boolean,
            "int" | "long" => Kind::Long,
            "float" => Kind::Float,
            "double" => Kind::Double,
            "string" => Kind::Text,
            "bytes" => Kind::Bytes,
            name => {
                let known = self.named.get(short(name)).copied();
                return known.ok_or_else(|| {
                    FormatError::malformed(
                        "a type in its schema",
                        name,
                        "a type that is defined before it",
                    )
                });
            }
        };
        Ok(self.push(kind))
    }

    fn add_object(&mut self, json: &Json) -> Result<usize, FormatError> {
        let part = |name: &'static str| {
            json.get(name).ok_or_else(|| {
                FormatError::malformed(
                    "a missing key in its schema",
                    name,
                    "this key in each such type",
                )
            })
        };
        let of = part("type")?;
        let Some(word) = of.text() else { return self.add(of) };
        if !["array", "map", "enum", "fixed", "record", "error"].contains(&word) {
            return self.named(word);
        }
        // The type gets its index before its parts are read, as these may refer to it by name.
        let place = self.push(Kind::Null);
        if let Some(name) = json.get("name").and_then(Json::text) {
            self.named.insert(short(name).to_owned(), place);
        }
        self.kinds[place] = match word {
            "array" => Kind::Array(self.add(part("items")?)?),
            "map" => Kind::Map(self.add(part("values")?)?),
            "enum" => Kind::Enum,
            "fixed" => match part("size")? {
                Json::Number(size) if (0.0..=MOST_FIXED).contains(size) => {
                    Kind::Fixed(*size as usize)
                }
                _ => return Err(FormatError::malformed("its schema", "size", "a number of bytes")),
            },
            _ => Kind::Record(self.fields(part("fields")?)?),
        };
        Ok(place)
    }

    fn fields(&mut self, json: &Json) -> Result<Vec<(String, usize)>, FormatError> {
        let Json::Array(fields) = json else {
            return Err(FormatError::malformed("its schema", "fields", "a list"));
        };
        let field = |field: &Json| {
            let name = field.get("name").and_then(Json::text).unwrap_or_default().to_owned();
            let of = field.get("type");
            let of =
                of.ok_or_else(|| FormatError::malformed("a field in its schema", &name, "a type"))?;
            Ok((name, self.add(of)?))
        };
        fields.iter().map(field).collect()
    }
}

/// A name without its namespace.
fn short(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}
