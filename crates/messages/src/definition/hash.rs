use sha2::{Digest, Sha256};

use super::Definition;
use crate::standard::type_description_interfaces::{
    Field, IndividualTypeDescription, TypeDescription,
};

impl Definition {
    /// The type hash of REP 2016: `RIHS01_` and the SHA-256 of the type description as JSON.
    pub fn hash(&self) -> String {
        let digest = Sha256::digest(json(&self.type_description()));
        let hex = digest.iter().map(|byte| format!("{byte:02x}"));
        format!("RIHS01_{}", hex.collect::<String>())
    }
}

/// The description without default values, formatted according to REP 2016. Names in it contain no
/// characters that JSON would escape.
fn json(description: &TypeDescription) -> String {
    format!(
        r#"{{"type_description": {}, "referenced_type_descriptions": {}}}"#,
        type_json(&description.type_description),
        list(&description.referenced_type_descriptions, type_json)
    )
}

fn type_json(described: &IndividualTypeDescription) -> String {
    let IndividualTypeDescription { type_name, fields } = described;
    format!(r#"{{"type_name": "{type_name}", "fields": {}}}"#, list(fields, field_json))
}

fn field_json(field: &Field) -> String {
    let Field { name, r#type: kind, .. } = field;
    format!(
        concat!(
            r#"{{"name": "{}", "type": {{"type_id": {}, "capacity": {}, "#,
            r#""string_capacity": {}, "nested_type_name": "{}"}}}}"#
        ),
        name, kind.type_id, kind.capacity, kind.string_capacity, kind.nested_type_name
    )
}

fn list<T>(items: &[T], json: impl Fn(&T) -> String) -> String {
    format!("[{}]", items.iter().map(json).collect::<Vec<_>>().join(", "))
}
