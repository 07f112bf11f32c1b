use std::collections::{BTreeMap, BTreeSet};

use crate::definition::{AssembleError, Definition, DefinitionError, assemble};

/// A ROS 1 definition in ROS 2 form.
pub(super) struct Translated {
    /// The name of the type: `package/msg/Type`.
    pub name: String,
    pub text: String,
    pub has_sequence_numbers: bool,
}

/// The ROS 2 types of `time` and `duration`, which are built into ROS 1.
const BUILTIN: [(&str, &str); 2] = [
    ("builtin_interfaces/msg/Time", "int32 sec\nuint32 nanosec\n"),
    ("builtin_interfaces/msg/Duration", "int32 sec\nuint32 nanosec\n"),
];

const HEADER: &str = "std_msgs/msg/Header";
const HEADER_TEXT: &str = "builtin_interfaces/Time stamp\nstring frame_id\n";
/// The fields of a ROS 1 header.
const HEADER_FIELDS: [&str; 3] = ["uint32 seq", "time stamp", "string frame_id"];

/// The most fields whose names become equal under ROS 2 rules.
const MOST_ALIKE: usize = 20;

/// The text of a type without fields: readers take an empty text for a missing definition.
const NO_FIELDS: &str = "# It has no fields.\n";

/// A type that has a different name in ROS 2, with the same fields.
const RENAMED: (&str, &str) = ("tf/msg/tfMessage", "tf2_msgs/msg/TFMessage");

/// Translates the definitions of a type and of the types that it refers to.
pub(super) fn translate(type_name: &str, text: &str) -> Result<Translated, DefinitionError> {
    let mut texts: BTreeMap<String, String> =
        BTreeMap::from(BUILTIN.map(|(name, text)| (name.to_owned(), text.to_owned())));
    let (mut has_sequence_numbers, mut root) = (false, String::new());
    for (name, part) in Definition::parts(type_name, text)? {
        let name = if name == RENAMED.0 { RENAMED.1.to_owned() } else { name };
        if root.is_empty() {
            root.clone_from(&name);
        }
        if name == HEADER && declarations(&part).eq(HEADER_FIELDS.map(str::to_owned)) {
            has_sequence_numbers = true;
            texts.insert(name, HEADER_TEXT.to_owned());
        } else {
            texts.entry(name).or_insert_with(|| translated(&part));
        }
    }
    let text = assemble(&root, |name| texts.get(name)).map_err(|error| match error {
        AssembleError::Missing(name) | AssembleError::Endless(name) => {
            DefinitionError::Unknown(name)
        }
    })?;
    Ok(Translated { name: root, text, has_sequence_numbers })
}

/// The declarations in a text, without comments, with one space between words.
fn declarations(text: &str) -> impl Iterator<Item = String> {
    let codes = text.lines().map(|line| line.split('#').next().unwrap_or_default());
    let words = codes.map(|code| code.split_whitespace().collect::<Vec<_>>().join(" "));
    words.filter(|code| !code.is_empty())
}

fn translated(text: &str) -> String {
    let mut names = BTreeSet::new();
    let lines = text.lines().map(|line| {
        let line = translated_line(line, &mut names).unwrap_or_else(|| line.trim_end().to_owned());
        line + "\n"
    });
    let lines: String = lines.collect();
    if lines.trim().is_empty() { NO_FIELDS.to_owned() } else { lines }
}

/// A line with a declaration in ROS 2 form; `None` if it is unchanged.
fn translated_line(line: &str, names: &mut BTreeSet<String>) -> Option<String> {
    let (code, comment) = line.split_at(line.find('#').unwrap_or(line.len()));
    let (kind, rest) = code.trim().split_once(char::is_whitespace)?;
    let comment = comment.trim_end();
    let Some((name, value)) = rest.split_once('=') else {
        let name = unused(&field_name(rest.trim()), names);
        let behind = if comment.is_empty() { "" } else { "  " };
        return Some(format!("{} {name}{behind}{comment}", kind_of(kind)));
    };
    let name = name.trim().to_ascii_uppercase();
    if kind == "string" {
        // In ROS 1, the value of a string is everything after the equals sign, even a `#`.
        let text = line.split_once('=').map_or("", |(_, text)| text.trim());
        let text = text.replace('\\', "\\\\").replace('"', "\\\"");
        return Some(format!("string {name}=\"{text}\""));
    }
    let behind = if comment.is_empty() { "" } else { "  " };
    Some(format!("{kind} {name}={}{behind}{comment}", value.trim()))
}

/// Translates a type to ROS 2, with the number of its values.
fn kind_of(written: &str) -> String {
    let (kind, count) = written.split_at(written.find('[').unwrap_or(written.len()));
    let kind = match kind {
        "time" => "builtin_interfaces/Time",
        "duration" => "builtin_interfaces/Duration",
        // ROS 1 allows a header without a package anywhere.
        "Header" => "std_msgs/Header",
        other => other,
    };
    format!("{kind}{count}")
}

/// Converts a field's name to ROS 2 rules: lower case, words separated by one underscore, none at the ends.
fn field_name(name: &str) -> String {
    let mut words = String::new();
    let mut was_lower = false;
    for c in name.chars() {
        if c.is_ascii_uppercase() && was_lower {
            words.push('_');
        }
        was_lower = c.is_ascii_lowercase() || c.is_ascii_digit();
        words.push(c.to_ascii_lowercase());
    }
    words.split('_').filter(|word| !word.is_empty()).collect::<Vec<_>>().join("_")
}

/// The name, followed by a number if another field already has it: in ROS 1 `x` and `X` differ. Names shared by too
/// many fields are left unchanged, which is an error of the definition.
fn unused(name: &str, names: &mut BTreeSet<String>) -> String {
    let numbered = (2..=MOST_ALIKE).map(|number| format!("{name}_{number}"));
    let mut candidates = std::iter::once(name.to_owned()).chain(numbered);
    candidates.find(|candidate| names.insert(candidate.clone())).unwrap_or_else(|| name.to_owned())
}
