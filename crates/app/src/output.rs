//! Data on standard output, and words on standard error.

use std::borrow::Cow;
use std::fmt::Display;
use std::io::{ErrorKind, Write};

use teampulse_core::text::is_unwanted;

use crate::exit::Exit;

/// Prints a line of data. A reader that has gone away ends the process quietly, as in a pipe to
/// `head`; a full disk does not.
pub fn line(text: impl AsRef<str>) {
    let written = writeln!(std::io::stdout().lock(), "{}", harmless(text.as_ref()));
    match written {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::BrokenPipe => std::process::exit(0),
        Err(error) => {
            say(format!("error: failed to write what was found: {error}"));
            std::process::exit(Exit::Failed as i32);
        }
    }
}

/// Lines, perhaps with tabs, in which nothing commands a terminal: names and cells are from elsewhere.
pub fn harmless(text: &str) -> Cow<'_, str> {
    let is_harmful = |each: char| is_unwanted(each) && !matches!(each, '\n' | '\t');
    if text.contains(is_harmful) {
        Cow::Owned(text.replace(is_harmful, " "))
    } else {
        Cow::Borrowed(text)
    }
}

/// Prints the last line of a command that has done its work: a reader that has gone away, such as a
/// closed terminal, changes nothing of how it ended.
pub fn last_line(text: impl AsRef<str>) {
    writeln!(std::io::stdout().lock(), "{}", text.as_ref()).ok();
}

/// Says something on standard error, in which nothing commands a terminal: paths, names and reasons are from
/// elsewhere. A terminal that was closed is no failure, as it would be for `eprintln!`, which panics.
pub fn say(text: impl Display) {
    draw(harmless(&text.to_string()));
}

/// Says something that may be coloured; what stands in it was made harmless before.
pub fn draw(text: impl Display) {
    writeln!(std::io::stderr().lock(), "{text}").ok();
}

/// Says a word beside the data.
pub fn note(text: impl AsRef<str>) {
    say(text.as_ref());
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
