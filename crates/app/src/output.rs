//! Data on standard output, messages on standard error.

use std::borrow::Cow;
use std::fmt::Display;
use std::io::{ErrorKind, Write};
use std::path::Path;

use teampulse_core::text::is_unwanted;

use crate::exit::Exit;

/// Prints a line of data. A closed pipe, as with `head`, ends the process quietly; a full disk is reported as an error.
pub fn line(text: impl AsRef<str>) {
    let written = writeln!(std::io::stdout().lock(), "{}", harmless(text.as_ref()));
    match written {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::BrokenPipe => std::process::exit(0),
        Err(error) => {
            say(format!("error: failed to write the results: {error}"));
            std::process::exit(Exit::Failed as i32);
        }
    }
}

/// Removes terminal control characters from lines, except tabs: names and cells come from elsewhere.
pub fn harmless(text: &str) -> Cow<'_, str> {
    let is_harmful = |each: char| is_unwanted(each) && !matches!(each, '\n' | '\t');
    if text.contains(is_harmful) {
        Cow::Owned(text.replace(is_harmful, " "))
    } else {
        Cow::Borrowed(text)
    }
}

/// Prints the last line of a command that has finished. A closed output, such as a closed terminal, does not change the
/// exit code.
pub fn last_line(text: impl AsRef<str>) {
    writeln!(std::io::stdout().lock(), "{}", text.as_ref()).ok();
}

/// Prints a message on standard error without terminal control characters, since paths, names and reasons come from
/// elsewhere. A closed terminal is not an error; `eprintln!` would panic.
pub fn say(text: impl Display) {
    draw(harmless(&text.to_string()));
}

/// Prints a message that may be coloured; it must already be free of unwanted control characters.
pub fn draw(text: impl Display) {
    writeln!(std::io::stderr().lock(), "{text}").ok();
}

/// Prints a note that is not part of the data, on standard error.
pub fn note(text: impl AsRef<str>) {
    say(text.as_ref());
}

/// Quotes a path for a shell if it has spaces or other characters with a special meaning.
pub fn pasted(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |each: char| each.is_alphanumeric() || "_-./:+,@%".contains(each);
    if text.chars().all(is_plain) { text } else { format!("'{}'", text.replace('\'', r"'\''")) }
}

/// Prints lines of data.
pub fn lines(texts: impl IntoIterator<Item = String>) {
    texts.into_iter().for_each(line);
}

/// Prints a value as one JSON object.
pub fn json(value: &impl serde::Serialize) {
    let text = serde_json::to_string_pretty(value);
    line(text.expect("printed values have string keys and can be serialised"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_with_spaces_is_one_word_of_a_shell() {
        assert_eq!(
            pasted(Path::new("sessions/my_team_20260105T101500Z")),
            "sessions/my_team_20260105T101500Z"
        );
        assert_eq!(pasted(Path::new("mein Team/ü")), "'mein Team/ü'");
        assert_eq!(pasted(Path::new("Ann's")), r"'Ann'\''s'");
    }
}
