//! An error in a study, with its place and a suggestion.

use std::ops::Range;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};
use thiserror::Error;

use super::{elsewhere, mistyped};

/// An error in a study, with its place.
#[derive(Debug, Error)]
#[error("{message}")]
pub struct StudyError {
    pub(super) message: String,
    pub(super) hint: Option<String>,
    pub(super) place: Option<Box<(NamedSource<String>, Range<usize>)>>,
}

impl Diagnostic for StudyError {
    fn help<'a>(&'a self) -> Option<Box<dyn std::fmt::Display + 'a>> {
        self.hint.as_ref().map(|hint| Box::new(hint) as Box<dyn std::fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.place.as_ref().map(|place| &place.0 as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let (_, span) = &**self.place.as_ref()?;
        Some(Box::new(std::iter::once(LabeledSpan::underline(span.clone()))))
    }
}

/// Remedies for addresses that the parser rejects, by its error message.
const ADDRESSES: [(&str, &str); 2] = [
    ("invalid socket address", "write the address with the port, as in \"127.0.0.1:5006\""),
    (
        "invalid IP address",
        "write only the address, as in \"0.0.0.0\"; `port` is a separate setting",
    ),
];

/// The start of the parser's message about a missing setting.
pub(super) const MISSING: &str = "missing field `";

/// Returns a suggestion for a missing or mistyped setting, an address, or a misspelt or misplaced word.
pub(super) fn suggestion(message: &str) -> Option<String> {
    if let Some((_, hint)) = ADDRESSES.iter().find(|(words, _)| message.contains(words)) {
        return Some((*hint).to_owned());
    }
    if let Some(rest) = message.strip_prefix(MISSING) {
        let word = rest.trim_end_matches('`');
        return Some(format!("add a line `{word} = …` to this table"));
    }
    if let Some(hint) = mistyped::remedy(message) {
        return Some(hint);
    }
    let words: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let (wrong, known) = words.split_first()?;
    if *wrong == "port" && known.contains(&"listen") && !known.contains(&"port") {
        return Some("the port is a part of `listen`, as in \"127.0.0.1:5006\"".to_owned());
    }
    if !message.starts_with("unknown") {
        return None;
    }
    if let Some(near) = nearest(wrong, known) {
        return Some(format!("did you mean `{near}`?"));
    }
    if !message.starts_with("unknown field") {
        return Some("use one of these words".to_owned());
    }
    let elsewhere = elsewhere::belongs(wrong);
    Some(elsewhere.unwrap_or_else(|| "remove it; `teampulse schema` lists all settings".to_owned()))
}

/// Returns the known word closest to another, if one is close.
pub(super) fn nearest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    let similarity = |known: &&&str| strsim::jaro_winkler(word, known);
    let near = known.iter().max_by(|a, b| similarity(a).total_cmp(&similarity(b)))?;
    is_near(word, near).then_some(*near)
}

/// Whether a word may be a misspelling of another: a few letters differ, or one starts with the other.
pub fn is_near(word: &str, known: &str) -> bool {
    let letters = word.chars().count().max(known.chars().count());
    let is_begun = word.chars().count() >= 3 && known.starts_with(word) || word.starts_with(known);
    let differing = strsim::osa_distance(word, known);
    differing > 0 && (is_begun || differing <= (letters / 3).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_is_suggested_for_a_misspelt_one_and_for_no_other() {
        for (word, known) in [
            ("robot", "robots"),
            ("heartrate", "heart_rate"),
            ("empatica", "empatica_e4"),
            ("sesion", "session"),
        ] {
            assert!(is_near(word, known), "{word} {known}");
        }
        for (word, known) in [("now", "note"), ("/a", "/team/state"), ("x", "act"), ("bag", "bag")]
        {
            assert!(!is_near(word, known), "{word} {known}");
        }
    }
}
