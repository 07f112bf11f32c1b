//! Finds where a setting belongs that was written in the wrong table of a study.

use serde_json::Value;

use crate::commands::schema;

use super::header;

/// The most kinds of one component that are listed.
const MOST_KINDS: usize = 4;

/// Returns where a setting of this name belongs; `None` if no table has it.
pub(super) fn belongs(word: &str) -> Option<String> {
    let schema = schema::study();
    let study = schema["properties"].as_object()?;
    if let Some(own) = study.get(word) {
        return Some(of_study(word, &schema, own));
    }
    let places: Vec<String> =
        study.iter().filter_map(|(table, found)| within(table, found, word, &schema)).collect();
    match places.as_slice() {
        [] => None,
        [last] => Some(format!("`{word}` belongs to {last}")),
        [first @ .., last] => Some(format!("`{word}` belongs to {} or {last}", first.join(", "))),
    }
}

/// Returns where a setting or a table of the study itself is written.
fn of_study(word: &str, schema: &Value, own: &Value) -> String {
    let settings = entry_of(schema, own);
    if ["properties", "additionalProperties", "oneOf"].iter().any(|part| !settings[part].is_null())
    {
        return format!("`{word}` is a separate table: start it with {}", header_of(word, own));
    }
    format!("`{word}` belongs to the study as a whole: write it above the first [table]")
}

/// Returns the place below a table that has this setting.
fn within(table: &str, found: &Value, word: &str, schema: &Value) -> Option<String> {
    if let Some(kinds) = found["items"]["oneOf"].as_array() {
        return of_kinds(table, kinds, word);
    }
    let settings = entry_of(schema, found);
    let knows = |settings: &Value| settings["properties"].get(word).is_some();
    if knows(settings) {
        return Some(header_of(table, found));
    }
    let below = settings["properties"].as_object().into_iter().flatten();
    let mut below = below.filter(|(_, each)| table == "features" && knows(each));
    below.next().map(|(feature, _)| format!("[features.{feature}]"))
}

/// Names the kinds of a component that have this setting.
fn of_kinds(table: &str, kinds: &[Value], word: &str) -> Option<String> {
    let knowing = kinds.iter().filter(|kind| kind["properties"].get(word).is_some());
    let named: Vec<String> = knowing
        .filter_map(|kind| kind["properties"]["type"]["const"].as_str())
        .map(|kind| format!("`{kind}`"))
        .collect();
    match named.len() {
        0 => None,
        1..=MOST_KINDS => Some(format!("{} with the `type` {}", header(table), named.join(", "))),
        _ => Some(format!("some of the {}", header(table))),
    }
}

/// Returns the schema of a table, or of the tables in an array.
fn entry_of<'v>(schema: &'v Value, found: &'v Value) -> &'v Value {
    resolved(schema, found.get("items").unwrap_or(found))
}

/// Resolves a schema that refers to another one.
fn resolved<'v>(schema: &'v Value, found: &'v Value) -> &'v Value {
    let name = found["$ref"].as_str().and_then(|reference| reference.strip_prefix("#/$defs/"));
    name.map_or(found, |name| &schema["$defs"][name])
}

fn header_of(table: &str, found: &Value) -> String {
    if found["items"].is_object() { format!("[[{table}]]") } else { format!("[{table}]") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_in_the_wrong_table_is_sent_to_its_own() {
        for (word, place) in [
            (
                "publish",
                "`publish` belongs to the study as a whole: write it above the first [table]",
            ),
            (
                "dashboard",
                "`dashboard` belongs to the study as a whole: write it above the first [table]",
            ),
            ("show_estimates", "`show_estimates` belongs to [session]"),
            ("mains_hz", "`mains_hz` belongs to [features]"),
            ("weak_dbm", "`weak_dbm` belongs to [features.link_quality]"),
            ("lasts_secs", "`lasts_secs` belongs to [[phases]]"),
            ("phases", "`phases` is a separate table: start it with [[phases]]"),
            ("sources", "`sources` is a separate table: start it with [[sources]]"),
            ("split_secs", "`split_secs` belongs to [[sinks]] with the `type` `bag`"),
        ] {
            assert_eq!(belongs(word).as_deref(), Some(place));
        }
        assert_eq!(belongs("no_such_setting"), None);
    }
}
