//! Data on standard output.

use std::io::Write;

/// Prints a line of data. A reader that has gone away ends the process quietly, as in a pipe to
/// `head`.
pub fn line(text: impl AsRef<str>) {
    if writeln!(std::io::stdout().lock(), "{}", text.as_ref()).is_err() {
        std::process::exit(0);
    }
}

/// Prints lines of data.
pub fn lines(texts: impl IntoIterator<Item = String>) {
    texts.into_iter().for_each(line);
}

/// Prints a value as JSON, one object.
pub fn json(value: &impl serde::Serialize) {
    let text = serde_json::to_string_pretty(value);
    line(text.expect("what is printed has string keys and no failing parts"));
}
