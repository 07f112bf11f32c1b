//! Type definitions: assembled from the texts of their parts, and split again.

mod installed;

pub(crate) use installed::installed;

use std::fmt::Write;

use teampulse_core::stream::Schema;
use teampulse_messages::definition::{Definition, DefinitionError, Problem};
use teampulse_messages::standard::type_description_interfaces::TypeSource;

/// The most types in a definition.
const MOST_PARTS: usize = 1000;

/// Assembles the schema of a type from the texts of its parts, which `text_of` returns for full names. The schema must
/// have the given hash, unless that is empty.
pub(crate) fn linked(
    type_name: &str,
    hash: &str,
    text_of: impl Fn(&str) -> Option<String>,
) -> Result<Schema, String> {
    let missing = |name: &str| format!("{name} is missing");
    let mut text = text_of(type_name).ok_or_else(|| missing(type_name))?;
    for _ in 0..MOST_PARTS {
        match Definition::parse(type_name, &text) {
            Ok(definition) => return verified(&definition, hash, text),
            Err(DefinitionError::Line { problem: Problem::Undefined(part), .. }) => {
                let part_text = text_of(&part).ok_or_else(|| missing(&part))?;
                append(&mut text, &part, &part_text);
            }
            Err(other) => return Err(format!("it failed to {other}")),
        }
    }
    Err(format!("it depends on more than {MOST_PARTS} types"))
}

/// Splits a definition into the texts of its types, each with its name; the type itself comes first.
pub(crate) fn sources(schema: &Schema) -> Vec<TypeSource> {
    let mut sources = vec![source(&schema.name)];
    let mut lines = schema.text.split_inclusive('\n');
    while let Some(line) = lines.next() {
        if is_separator(line) {
            let title = lines.next().unwrap_or_default();
            sources.push(source(&full_name(title)));
        } else if let Some(last) = sources.last_mut() {
            last.raw_file_contents.push_str(line);
        }
    }
    sources
}

fn verified(definition: &Definition, hash: &str, text: String) -> Result<Schema, String> {
    let actual = definition.hash();
    if !hash.is_empty() && actual != hash {
        return Err(format!("it has the hash {actual}, expected {hash}"));
    }
    let (name, encoding) = (definition.name().to_owned(), "ros2msg".to_owned());
    Ok(Schema { name, encoding, text, hash: actual })
}

/// Appends the text of a part, in the format of rosbag2.
fn append(text: &mut String, part: &str, part_text: &str) {
    let title = part.replace("/msg/", "/");
    write!(text, "\n{:=<80}\nMSG: {title}\n{part_text}", "")
        .expect("writing to a string never fails");
}

fn source(type_name: &str) -> TypeSource {
    TypeSource {
        type_name: type_name.to_owned(),
        encoding: "msg".into(),
        raw_file_contents: String::new(),
    }
}

fn is_separator(line: &str) -> bool {
    let line = line.trim_end();
    line.len() >= 80 && line.bytes().all(|byte| byte == b'=')
}

/// The full name in a separator: `MSG: std_msgs/Header` is `std_msgs/msg/Header`.
fn full_name(title: &str) -> String {
    let name = title.trim().strip_prefix("MSG:").unwrap_or_default().trim();
    match name.split_once('/') {
        Some((package, name)) if !name.contains('/') => format!("{package}/msg/{name}"),
        _ => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use teampulse_messages::catalogue;

    #[test]
    fn what_is_taken_apart_can_be_put_together_again() {
        for name in ["nav_msgs/msg/Odometry", "std_msgs/msg/Header", "rosgraph_msgs/msg/Clock"] {
            let shipped = catalogue::shipped(name).unwrap();
            let parts = sources(&shipped);
            let text_of = |name: &str| {
                let part = parts.iter().find(|part| part.type_name == name)?;
                Some(part.raw_file_contents.clone())
            };
            assert_eq!(linked(name, &shipped.hash, text_of).unwrap().hash, shipped.hash);
        }
    }

    #[test]
    fn a_definition_with_another_hash_is_refused() {
        let text_of = |_: &str| Some("uint8 x".to_owned());
        let hash = linked("a/msg/X", "", text_of).unwrap().hash;
        assert!(linked("a/msg/X", &hash, text_of).is_ok());
        let refused = linked("a/msg/X", "RIHS01_00", text_of).unwrap_err();
        assert_eq!(refused, format!("it has the hash {hash}, expected RIHS01_00"));
    }

    #[test]
    fn a_part_that_nobody_gives_is_named() {
        let text_of = |name: &str| (name == "a/msg/X").then(|| "b/Y y".to_owned());
        assert_eq!(linked("a/msg/X", "", text_of).unwrap_err(), "b/msg/Y is missing");
        assert_eq!(linked("a/msg/Z", "", text_of).unwrap_err(), "a/msg/Z is missing");
    }

    #[test]
    fn parts_without_end_are_refused() {
        let text_of = |name: &str| {
            let number: u32 = name.trim_start_matches("a/msg/X").parse().ok()?;
            Some(format!("X{} x", number + 1))
        };
        assert!(linked("a/msg/X1", "", text_of).is_err());
    }
}
