use super::{FieldError, Path, Step, nearest};
use crate::definition::{Count, Definition, Field, Kind};

/// A path resolved for a type: the field index and the value index of each step.
pub(super) type ResolvedPath = Vec<(usize, Option<u64>)>;

/// Resolves a path against a type.
pub(super) fn resolve(definition: &Definition, text: &str) -> Result<ResolvedPath, FieldError> {
    let path: Path = text.parse()?;
    let unknown = || FieldError::Unknown {
        type_name: definition.name().to_owned(),
        path: text.to_owned(),
        nearest: nearest::nearest(definition, text),
    };
    let mut resolved = ResolvedPath::new();
    let mut within = Some(definition.root());
    for step in path.steps() {
        let fields = &within.ok_or_else(unknown)?.fields;
        let place = fields.iter().position(|field| field.name == step.field);
        let place = place.ok_or_else(unknown)?;
        expect_index(&fields[place], step, text)?;
        resolved.push((place, step.index));
        within = match &fields[place].kind {
            Kind::Struct(nested) => Some(nested),
            _ => None,
        };
    }
    match within {
        None => Ok(resolved),
        Some(nested) => {
            Err(FieldError::Message { path: text.to_owned(), type_name: nested.name.clone() })
        }
    }
}

/// The kind of the values at a path of a type, regardless of indices in the path; `None` if the path leads nowhere, or
/// to a message.
pub fn kind<'a>(definition: &'a Definition, path: &str) -> Option<&'a Kind> {
    let path: Path = path.parse().ok()?;
    let mut within = Some(definition.root());
    let mut found = None;
    for step in path.steps() {
        let field = within?.fields.iter().find(|field| field.name == step.field)?;
        found = Some(&field.kind);
        within = match &field.kind {
            Kind::Struct(nested) => Some(nested),
            _ => None,
        };
    }
    found.filter(|kind| !matches!(kind, Kind::Struct(_)))
}

/// Checks that a step has an index if and only if the field has several values.
fn expect_index(field: &Field, step: &Step, path: &str) -> Result<(), FieldError> {
    match (field.count, step.index) {
        (Count::One, None) | (Count::Any, Some(_)) => Ok(()),
        (Count::One, Some(_)) => Err(FieldError::One(step.field.clone())),
        (_, None) => Err(FieldError::Many(step.field.clone())),
        (Count::Array(most) | Count::AtMost(most), Some(index)) if index >= most => {
            Err(FieldError::Beyond { path: path.to_owned(), most })
        }
        _ => Ok(()),
    }
}
