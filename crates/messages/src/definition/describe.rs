use std::collections::BTreeMap;

use super::{Count, Definition, Field, Kind, Number, Struct};
use crate::standard::type_description_interfaces as messages;

const IN_ARRAY: u8 = 48;
const IN_BOUNDED_SEQUENCE: u8 = 96;
const IN_SEQUENCE: u8 = 144;

impl Definition {
    /// The description of the type and of all types that it refers to, as in the response of
    /// `get_type_description`.
    pub fn type_description(&self) -> messages::TypeDescription {
        let mut referenced = BTreeMap::new();
        collect(&self.root, &mut referenced);
        messages::TypeDescription {
            type_description: individual(&self.root),
            referenced_type_descriptions: referenced.into_values().map(individual).collect(),
        }
    }
}

/// Collects the types that a type refers to, directly or not, by name.
fn collect<'a>(within: &'a Struct, referenced: &mut BTreeMap<&'a str, &'a Struct>) {
    for field in &within.fields {
        if let Kind::Struct(nested) = &field.kind
            && referenced.insert(&nested.name, nested).is_none()
        {
            collect(nested, referenced);
        }
    }
}

fn individual(of: &Struct) -> messages::IndividualTypeDescription {
    let fields = of.fields.iter().map(|field| messages::Field {
        name: field.name.clone(),
        r#type: field_type(field),
        default_value: field.default.clone(),
    });
    messages::IndividualTypeDescription { type_name: of.name.clone(), fields: fields.collect() }
}

fn field_type(field: &Field) -> messages::FieldType {
    let (times, capacity) = match field.count {
        Count::One => (0, 0),
        Count::Array(length) => (IN_ARRAY, length),
        Count::AtMost(bound) => (IN_BOUNDED_SEQUENCE, bound),
        Count::Any => (IN_SEQUENCE, 0),
    };
    let (type_id, string_capacity) = match &field.kind {
        Kind::Struct(_) => (1, 0),
        Kind::Number(number) => (number_id(*number), 0),
        Kind::Text(None) => (17, 0),
        Kind::WideText(None) => (18, 0),
        Kind::Text(Some(bound)) => (21, *bound),
        Kind::WideText(Some(bound)) => (22, *bound),
    };
    let nested_type_name = match &field.kind {
        Kind::Struct(nested) => nested.name.clone(),
        _ => String::new(),
    };
    messages::FieldType { type_id: type_id + times, capacity, string_capacity, nested_type_name }
}

/// The codes of `type_description_interfaces/msg/FieldType`; its `CHAR` does not exist in ROS 2.
fn number_id(number: Number) -> u8 {
    match number {
        Number::Int8 => 2,
        Number::Uint8 | Number::Char => 3,
        Number::Int16 => 4,
        Number::Uint16 => 5,
        Number::Int32 => 6,
        Number::Uint32 => 7,
        Number::Int64 => 8,
        Number::Uint64 => 9,
        Number::Float32 => 10,
        Number::Float64 => 11,
        Number::Bool => 15,
        Number::Byte => 16,
    }
}
