//! Data on standard output.

use std::io::{ErrorKind, Write};

use crate::exit::Exit;

/// Prints a line of data. A reader that has gone away ends the process quietly, as in a pipe to
/// `head`; a full disk does not.
pub fn line(text: impl AsRef<str>) {
    let written = writeln!(std::io::stdout().lock(), "{}", text.as_ref());
    match written {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::BrokenPipe => std::process::exit(0),
        Err(error) => {
            eprintln!("error: failed to write what was found: {error}");
            std::process::exit(Exit::Failed as i32);
        }
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
