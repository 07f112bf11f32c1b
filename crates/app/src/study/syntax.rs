//! Mistakes in the TOML of a study: typographic quotes, and keys that are set twice.

use std::ops::Range;

use teampulse_core::registry::SettingsError;
use teampulse_core::text::{LONGEST_NAME, label};

use super::{ARRAYS, header};

/// The typographic quotes of word processors, which TOML does not accept.
const TYPOGRAPHIC: [char; 8] = ['“', '”', '„', '‘', '’', '‚', '«', '»'];

/// Explains the parser's error for mistakes that it does not recognise, with their place and remedy.
pub(super) fn explained(text: &str, message: &str, span: Option<Range<usize>>) -> SettingsError {
    let span = span.unwrap_or(0..0);
    let own = quoted(text, &span)
        .or_else(|| (message == "duplicate key").then(|| (span.clone(), doubled(text, &span))));
    let (span, error) = own.unwrap_or_else(|| (span, SettingsError::new(message)));
    SettingsError { span: Some(span), ..error }
}

/// Finds the first typographic quote used as a straight one in the line of an error, with its remedy.
fn quoted(text: &str, span: &Range<usize>) -> Option<(Range<usize>, SettingsError)> {
    let begin = begin_of_line(text, span.start);
    let line = text[begin..].lines().next()?;
    let (at, quote) = line.char_indices().find(|(_, each)| TYPOGRAPHIC.contains(each))?;
    let is_text = !line[..at].matches('"').count().is_multiple_of(2) || line[..at].contains('#');
    let place = begin + at..begin + at + quote.len_utf8();
    let error =
        SettingsError::new(format!("{quote} is a typographic quote, which TOML does not accept"));
    let hint = "write straight quotes, as in name = \"my_team\"";
    (!is_text).then(|| (place, error.with_hint(hint)))
}

/// Describes a key or a table that is written a second time.
fn doubled(text: &str, span: &Range<usize>) -> SettingsError {
    let begin = begin_of_line(text, span.start);
    let line = text[begin..].lines().next().unwrap_or_default();
    let word = text.get(span.clone()).unwrap_or_default();
    let shown = label(word.to_owned(), LONGEST_NAME);
    if !line.trim_start().starts_with('[') {
        let first = line_of_key(&text[..begin], word);
        let first = first.map_or_else(String::new, |line| format!(", first in line {line}"));
        let error = SettingsError::new(format!("`{shown}` is set twice in this table{first}"));
        return error.with_hint("keep one of the two");
    }
    let error = SettingsError::new(format!("the table `{shown}` is written twice"));
    error.with_hint(if ARRAYS.contains(&word) {
        format!("there may be several, each starting with {}", header(word))
    } else {
        "put the settings of both under one header".to_owned()
    })
}

/// Returns the line, from 1, in which a key was set in the last table of a text.
fn line_of_key(before: &str, key: &str) -> Option<usize> {
    let lines: Vec<&str> = before.lines().collect();
    let table = lines.iter().rposition(|line| line.trim_start().starts_with('[')).unwrap_or(0);
    let is_set = |line: &&str| line.split_once('=').is_some_and(|(set, _)| set.trim() == key);
    lines[table..].iter().position(is_set).map(|place| table + place + 1)
}

fn begin_of_line(text: &str, at: usize) -> usize {
    text.get(..at).and_then(|before| before.rfind('\n')).map_or(0, |line_end| line_end + 1)
}
