//! The name of a bus in a study.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::buses::BusKind;
use crate::{BUSES, cyclone};

/// A bus as named in a study: a ROS domain by its number, `12`, or a bus of any [kind](BUSES) by its kind and address,
/// `"dds:12"`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct BusId {
    kind: String,
    address: String,
}

impl BusId {
    /// The kind of the bus; `None` if no kind has this word.
    pub fn kind(&self) -> Option<&'static BusKind> {
        BUSES.iter().find(|kind| kind.word == self.kind)
    }

    /// The spelling of the bus in a study: `12`, `"dds:12"`.
    pub fn in_study(&self) -> String {
        match self.domain() {
            Some(domain) => domain.to_string(),
            None => format!("\"{}:{}\"", self.kind, self.address),
        }
    }

    /// The domain number, if the bus is a ROS domain.
    fn domain(&self) -> Option<u32> {
        self.address.parse().ok().filter(|_| self.kind == cyclone::DDS.word)
    }

    /// The address of the bus within its kind.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// Fails if there is no such bus; the message fits after "join ROS domain 233: ".
    pub(crate) fn check(&self) -> Result<&'static BusKind, String> {
        let kind = self.kind().ok_or_else(|| format!("expected one of the kinds {}", kinds()))?;
        (kind.check)(&self.address).map(|()| kind)
    }
}

impl From<u32> for BusId {
    fn from(domain: u32) -> BusId {
        BusId { kind: cyclone::DDS.word.to_owned(), address: domain.to_string() }
    }
}

impl From<&BusId> for BusId {
    fn from(id: &BusId) -> BusId {
        id.clone()
    }
}

/// Parses a bus as written on a command line: `12`, `dds:12`.
impl FromStr for BusId {
    type Err = String;

    fn from_str(text: &str) -> Result<BusId, String> {
        if let Ok(domain) = text.parse::<i64>() {
            return known_domain(domain).ok_or_else(|| not_a_domain(domain));
        }
        let (kind, address) =
            text.split_once(':').ok_or_else(|| format!("expected {}", expected()))?;
        let id = BusId { kind: kind.to_owned(), address: address.to_owned() };
        id.check().map_err(|reason| format!("there is no such bus: {reason}"))?;
        Ok(id)
    }
}

impl fmt::Display for BusId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.kind() {
            Some(kind) => f.write_str(&(kind.name)(&self.address)),
            None => write!(f, "{}:{}", self.kind, self.address),
        }
    }
}

/// Serializes the bus as in a study.
impl Serialize for BusId {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.domain() {
            Some(domain) => serializer.serialize_u32(domain),
            None => serializer.serialize_str(&format!("{}:{}", self.kind, self.address)),
        }
    }
}

impl<'de> Deserialize<'de> for BusId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<BusId, D::Error> {
        deserializer.deserialize_any(NumberOrText)
    }
}

struct NumberOrText;

impl Visitor<'_> for NumberOrText {
    type Value = BusId;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&expected())
    }

    fn visit_i64<E: Error>(self, domain: i64) -> Result<BusId, E> {
        known_domain(domain).ok_or_else(|| E::custom(not_a_domain(domain)))
    }

    fn visit_u64<E: Error>(self, domain: u64) -> Result<BusId, E> {
        self.visit_i64(i64::try_from(domain).unwrap_or(i64::MAX))
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<BusId, E> {
        let Some((kind, address)) = text.split_once(':') else {
            return Err(E::invalid_type(serde::de::Unexpected::Str(text), &self));
        };
        let id = BusId { kind: kind.to_owned(), address: address.to_owned() };
        id.check().map_err(|reason| E::custom(format!("there is no bus \"{text}\": {reason}")))?;
        Ok(id)
    }
}

/// The words of all kinds of buses.
fn kinds() -> String {
    BUSES.iter().map(|kind| kind.word).collect::<Vec<_>>().join(", ")
}

/// How a bus is written in a study.
fn expected() -> String {
    format!("a ROS domain, such as 12, or a bus as KIND:ADDRESS (kinds: {})", kinds())
}

/// The bus of a ROS domain; `None` if there is no such domain.
fn known_domain(domain: i64) -> Option<BusId> {
    let known = u32::try_from(domain).ok().map(BusId::from);
    known.filter(|id| id.check().is_ok())
}

fn not_a_domain(domain: i64) -> String {
    let highest = crate::environment::HIGHEST_DOMAIN;
    format!("{domain} is not a ROS domain: expected 0 to {highest}")
}

impl JsonSchema for BusId {
    fn schema_name() -> Cow<'static, str> {
        "BusId".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let highest = crate::environment::HIGHEST_DOMAIN;
        json_schema!({
            "description": "A ROS domain by its number, or a bus as \"KIND:ADDRESS\".",
            "anyOf": [
                { "type": "integer", "minimum": 0, "maximum": highest },
                { "type": "string", "pattern": "^[a-z][a-z0-9_]*:.+$" },
            ],
        })
    }
}

#[cfg(test)]
mod tests {
    use serde::de::IntoDeserializer;
    use serde::de::value::Error;

    use super::*;

    fn text(text: &str) -> Result<BusId, String> {
        let read: Result<BusId, Error> = BusId::deserialize(text.into_deserializer());
        read.map_err(|error| error.to_string())
    }

    #[test]
    fn a_domain_is_the_same_bus_by_number_and_by_text() {
        let number: Result<BusId, Error> = BusId::deserialize(12_u32.into_deserializer());
        assert_eq!(number, Ok(BusId::from(12)));
        assert_eq!(text("dds:12"), Ok(BusId::from(12)));
        assert_eq!(BusId::from(12).to_string(), "ROS domain 12");
        assert_eq!(("12".parse(), "dds:12".parse()), (Ok(BusId::from(12)), Ok(BusId::from(12))));
    }

    #[test]
    fn a_bus_that_does_not_exist_is_refused_with_what_was_expected() {
        let expected = "expected a ROS domain, such as 12, or a bus as KIND:ADDRESS (kinds: dds";
        assert!(text("twelve").unwrap_err().contains(expected));
        assert!(text("smoke:12").unwrap_err().contains("expected one of the kinds dds"));
        assert!(text("dds:233").unwrap_err().contains("expected 0 to 232"));
        assert!("twelve".parse::<BusId>().unwrap_err().contains(expected));
        assert_eq!("300".parse::<BusId>(), Err(not_a_domain(300)));
        assert!("smoke:12".parse::<BusId>().unwrap_err().contains("expected one of the kinds dds"));
        let negative: Result<BusId, Error> = BusId::deserialize((-1_i64).into_deserializer());
        assert!(negative.unwrap_err().to_string().contains("-1 is not a ROS domain"));
    }
}
