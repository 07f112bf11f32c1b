//! Puts the parser's errors in the words of a study: without Rust types and numbers of hundreds of digits.

use super::error::MISSING;

/// Phrases of the parser, and their replacements.
const WORDS: [(&str, &str); 15] = [
    (" as i128", ""),
    (" as u128", ""),
    ("expected usize", "expected a whole number, 0 or more"),
    ("expected u64", "expected a whole number, 0 or more"),
    ("expected u32", "expected a whole number from 0 to 4294967295"),
    ("expected u16", "expected a whole number from 0 to 65535"),
    ("expected u8", "expected a whole number from 0 to 255"),
    ("expected i64", "expected a whole number"),
    ("expected f64", "expected a number"),
    ("expected f32", "expected a number"),
    ("expected path string", "expected a path in quotes"),
    ("expected a boolean", "expected true or false"),
    ("expected a sequence", "expected a list"),
    ("invalid type: sequence", "invalid type: list"),
    ("invalid type: map", "invalid type: table"),
];
/// Numbers with more digits are written with an exponent.
const MOST_DIGITS: usize = 16;

/// Puts an error message in plain words.
pub(super) fn plain(message: &str) -> String {
    if let Some(rest) = message.strip_prefix(MISSING) {
        return shortened(&format!("`{rest} is missing"));
    }
    let words =
        WORDS.iter().fold(message.to_owned(), |text, (theirs, ours)| text.replace(theirs, ours));
    shortened(&without_types(&words))
}

/// Replaces the name of a Rust type, which no study uses, by `a table`.
fn without_types(text: &str) -> String {
    match text.split_once("expected struct ") {
        Some((before, named)) if !named.contains(' ') => format!("{before}expected a table"),
        _ => text.to_owned(),
    }
}

/// Shortens long whole numbers to the form `1e300`.
fn shortened(text: &str) -> String {
    let is_part = |each: char| each.is_ascii_alphanumeric() || matches!(each, '.' | '_');
    let mut short = String::new();
    let mut rest = text;
    while let Some(begin) = rest.find(is_part) {
        let (before, part) = rest.split_at(begin);
        let end = part.find(|each: char| !is_part(each)).unwrap_or(part.len());
        let (part, after) = part.split_at(end);
        let is_long = part.len() > MOST_DIGITS && part.bytes().all(|each| each.is_ascii_digit());
        let value = part.parse::<f64>().ok().filter(|_| is_long);
        short.push_str(before);
        short.push_str(&value.map_or(part.to_owned(), |value| format!("{value:e}")));
        rest = after;
    }
    short + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_of_rust_and_hundreds_of_digits_are_not_shown() {
        let huge = format!("a phase can't begin at {:.0} s", 1e300_f64);
        for (theirs, ours) in [
            (
                "invalid type: integer `99999999999999999999` as i128, expected usize",
                "invalid type: integer `1e20`, expected a whole number, 0 or more",
            ),
            (
                "invalid value: integer `80000`, expected u16",
                "invalid value: integer `80000`, expected a whole number from 0 to 65535",
            ),
            ("missing field `person`", "`person` is missing"),
            (
                "invalid type: integer `3`, expected struct SessionSettings",
                "invalid type: integer `3`, expected a table",
            ),
            (huge.as_str(), "a phase can't begin at 1e300 s"),
            ("unknown field `a1`, expected `b22`", "unknown field `a1`, expected `b22`"),
        ] {
            assert_eq!(plain(theirs), ours);
        }
    }
}
