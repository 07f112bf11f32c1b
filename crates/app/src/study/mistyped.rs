//! Remedies for values of the wrong type.

/// How values of a type are written, by the parser's name of the type.
const FORMS: [(&str, &str); 6] = [
    ("a boolean", "write true or false, without quotes"),
    ("a sequence", "write a list in brackets, as in [\"a\", \"b\"] or [1, 2]"),
    ("struct", "write a table, as in { key = value }"),
    ("a map", "write a table, as in { key = value }"),
    ("a string", "write one text in quotes"),
    ("path string", "write one path in quotes"),
];
/// The parser's names of number types.
const NUMBERS: [&str; 10] =
    ["f64", "f32", "usize", "u64", "u32", "u16", "u8", "i64", "i32", "isize"];

/// Returns what to write instead of a value, given the parser's message; `None` for other messages.
pub(super) fn remedy(message: &str) -> Option<String> {
    let (found, expected) = message.strip_prefix("invalid type: ")?.split_once(", expected ")?;
    let (kind, value) = found.split_once(['`', '"']).unwrap_or((found, ""));
    let value = value.trim_end_matches(['`', '"']);
    let is_quoted = kind.starts_with("string");
    let is_bare = ["integer", "floating", "boolean"].iter().any(|bare| kind.starts_with(bare));
    if is_quoted && value.parse::<f64>().is_ok() && !expected.starts_with("a sequence") {
        return Some(format!("write it without quotes: {value}"));
    }
    if is_bare && ["a string", "path string"].contains(&expected) {
        return Some(format!("write it in quotes: \"{value}\""));
    }
    if NUMBERS.contains(&expected) {
        return Some("write one number, without quotes".to_owned());
    }
    let form = FORMS.iter().find(|(type_name, _)| expected.starts_with(type_name));
    Some(form.map_or_else(|| format!("write {expected}"), |(_, form)| (*form).to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_of_the_wrong_type_has_a_remedy_in_the_form_of_a_study() {
        for (found_and_expected, hint) in [
            ("string \"30\", expected f64", "write it without quotes: 30"),
            ("string \"soon\", expected f64", "write one number, without quotes"),
            ("string \"12\", expected a ROS domain, such as 12", "write it without quotes: 12"),
            ("string \"x\", expected a ROS domain, such as 12", "write a ROS domain, such as 12"),
            ("integer `1`, expected a string", "write it in quotes: \"1\""),
            ("boolean `true`, expected path string", "write it in quotes: \"true\""),
            ("string \"yes\", expected a boolean", "write true or false, without quotes"),
            ("map, expected a string", "write one text in quotes"),
            (
                "integer `3`, expected struct SessionSettings",
                "write a table, as in { key = value }",
            ),
        ] {
            let message = format!("invalid type: {found_and_expected}");
            assert_eq!(remedy(&message).as_deref(), Some(hint), "{message}");
        }
        let list = remedy("invalid type: string \"5\", expected a sequence");
        assert!(list.is_some_and(|hint| hint.starts_with("write a list in brackets")));
        assert_eq!(remedy("unknown field `a`, expected `b`"), None);
    }
}
