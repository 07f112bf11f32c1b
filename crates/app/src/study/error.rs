//! An error in a study: its place, and a suggestion.

use std::ops::Range;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};
use thiserror::Error;

/// An error in a study, and its place.
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

/// A suggestion for a misspelt word, from the words that the message lists.
pub(super) fn suggestion(message: &str) -> Option<String> {
    let words: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let (wrong, known) = words.split_first()?;
    let near = message.starts_with("unknown").then(|| nearest(wrong, known)).flatten()?;
    Some(format!("did you mean `{near}`?"))
}

/// The known word that is nearest to another, if one is near.
pub(super) fn nearest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    let similarity = |known: &&&str| strsim::jaro_winkler(word, known);
    let near = known.iter().max_by(|a, b| similarity(a).total_cmp(&similarity(b)))?;
    (similarity(&near) > 0.75).then_some(near)
}
