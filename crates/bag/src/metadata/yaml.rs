//! The subset of YAML that `metadata.yaml` needs: block-style mappings and sequences, and scalars.

use std::fmt::Write as _;

use super::Span;

/// A YAML writer with an indentation of two spaces per level.
#[derive(Default)]
pub(super) struct YamlWriter(pub(super) String);

impl YamlWriter {
    pub(super) fn line(&mut self, level: usize, text: std::fmt::Arguments<'_>) {
        writeln!(self.0, "{:indent$}{text}", "", indent = 2 * level)
            .expect("writing to a string never fails");
    }

    pub(super) fn span(&mut self, level: usize, span: Span) {
        self.line(level, format_args!("duration:"));
        self.line(level + 1, format_args!("nanoseconds: {}", span.last.nanos_since(span.first)));
        self.line(level, format_args!("starting_time:"));
        self.line(level + 1, format_args!("nanoseconds_since_epoch: {}", span.first.nanos()));
        self.line(level, format_args!("message_count: {}", span.messages));
    }

    pub(super) fn list<T>(&mut self, key: &str, items: &[T], write: impl Fn(&mut YamlWriter, &T)) {
        let empty = if items.is_empty() { " []" } else { "" };
        self.line(0, format_args!("{key}:{empty}"));
        for item in items {
            write(self, item);
        }
    }
}

/// Formats a string as a single-line YAML scalar: plain where that is safe, otherwise double-quoted.
pub(super) fn scalar(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/_.-".contains(c);
    let is_plain = text.starts_with(|c: char| c == '/' || c.is_ascii_alphabetic())
        && text.chars().all(plain)
        && !["true", "false", "yes", "no", "on", "off", "null", "y", "n"]
            .contains(&text.to_ascii_lowercase().as_str());
    if is_plain { text.to_owned() } else { quoted(text) }
}

fn quoted(text: &str) -> String {
    let mut quoted = String::from('"');
    for c in text.chars() {
        match c {
            '"' => quoted.push_str("\\\""),
            '\\' => quoted.push_str("\\\\"),
            '\n' => quoted.push_str("\\n"),
            '\t' => quoted.push_str("\\t"),
            // Control characters, and Unicode line breaks, which YAML would fold.
            c if c.is_control() || "\u{2028}\u{2029}\u{feff}".contains(c) => {
                write!(quoted, "\\u{:04x}", c as u32).expect("writing to a string never fails");
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// Splits a line into key and value; the key may be quoted.
pub(super) fn split_entry(line: &str) -> Option<(String, String)> {
    let end_of_key = if line.starts_with('"') { closing_quote(line)? + 1 } else { line.find(':')? };
    let (key, rest) = line.split_at(end_of_key);
    Some((unquoted(key), unquoted(rest.trim_start().strip_prefix(':')?)))
}

fn closing_quote(line: &str) -> Option<usize> {
    let mut escaped = false;
    line.char_indices().skip(1).find_map(|(at, c)| {
        let closes = c == '"' && !escaped;
        escaped = c == '\\' && !escaped;
        closes.then_some(at)
    })
}

pub(super) fn unquoted(text: &str) -> String {
    let text = text.trim();
    let inside = |quote: char| text.strip_prefix(quote)?.strip_suffix(quote);
    if let Some(single) = inside('\'') {
        return single.replace("''", "'");
    }
    let Some(double) = inside('"') else { return text.to_owned() };
    let mut plain = String::new();
    let mut chars = double.chars();
    while let Some(c) = chars.next() {
        plain.push(if c == '\\' { unescaped(&mut chars) } else { c });
    }
    plain
}

fn unescaped(rest: &mut std::str::Chars<'_>) -> char {
    match rest.next() {
        Some('n') => '\n',
        Some('t') => '\t',
        Some('u') => {
            let code: String = rest.take(4).collect();
            let code = u32::from_str_radix(&code, 16).ok().and_then(char::from_u32);
            code.unwrap_or(char::REPLACEMENT_CHARACTER)
        }
        Some(c) => c,
        None => '\\',
    }
}
