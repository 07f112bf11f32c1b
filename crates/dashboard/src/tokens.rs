//! The tokens of a dashboard, from a file.

use std::fmt;
use std::hint::black_box;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::wire::Right;

/// The shortest token [bytes].
const SHORTEST: usize = 16;

/// Tokens, each with the right that it grants.
#[derive(Clone, Default)]
pub struct Tokens {
    file: Option<PathBuf>,
    granted: Vec<(Right, String)>,
}

/// A file of tokens that can't be used. The message fits after "failed to".
#[derive(Debug, Error)]
pub enum TokensError {
    /// The file can't be read.
    #[error("read the tokens of {}: {error}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The reason.
        error: std::io::Error,
    },
    /// A line of the file is not a right followed by a token.
    #[error(
        "read the tokens of {}: line {line} is not `watch`, `mark` or `control` and a token of {SHORTEST} or more characters",
        path.display()
    )]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
    },
    /// The file has no tokens.
    #[error("read the tokens of {}: the file has no tokens", path.display())]
    None {
        /// The file.
        path: PathBuf,
    },
}

impl TokensError {
    /// What the user can do.
    pub const fn hint(&self) -> &'static str {
        match self {
            TokensError::Unreadable { .. } => {
                "paths are relative to the folder in which teampulse is started, and the file must be readable by you"
            }
            TokensError::Line { .. } | TokensError::None { .. } => {
                "each line is `watch`, `mark` or `control`, then 16 or more letters and digits: \
                 `echo control $(openssl rand -hex 16)` prints one"
            }
        }
    }
}

impl Tokens {
    /// Reads a file with a right and a token on each line; lines that start with `#` are comments.
    pub fn read(path: &Path) -> Result<Tokens, TokensError> {
        let text = std::fs::read_to_string(path)
            .map_err(|error| TokensError::Unreadable { path: path.to_owned(), error })?;
        let lines = text.lines().map(str::trim).enumerate();
        let written = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let token = |(place, line): (usize, &str)| {
            token(line).ok_or_else(|| TokensError::Line { path: path.to_owned(), line: place + 1 })
        };
        let tokens = written.map(token).collect::<Result<Vec<_>, _>>()?;
        if tokens.is_empty() {
            return Err(TokensError::None { path: path.to_owned() });
        }
        Ok(Tokens { file: Some(path.to_owned()), granted: tokens })
    }

    /// Whether there are no tokens.
    pub fn is_empty(&self) -> bool {
        self.granted.is_empty()
    }

    /// The file from which the tokens were read.
    pub fn file(&self) -> Option<&Path> {
        self.file.as_deref()
    }

    /// The right that a token grants.
    pub fn right_of(&self, token: &str) -> Option<Right> {
        // All tokens are compared, so that the time does not reveal which one matches.
        let rights =
            self.granted.iter().map(|(right, each)| is_equal(each, token).then_some(*right));
        rights.fold(None, Ord::max)
    }
}

impl fmt::Debug for Tokens {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Tokens({})", self.granted.len())
    }
}

/// Parses the right and the token of a line.
fn token(line: &str) -> Option<(Right, String)> {
    let (right, token) = line.split_once(char::is_whitespace)?;
    let right = match right {
        "watch" => Right::Watch,
        "mark" => Right::Mark,
        "control" => Right::Control,
        _ => return None,
    };
    let token = token.trim();
    let is_token = |c: u8| c.is_ascii_alphanumeric() || b"-_.~".contains(&c);
    (token.len() >= SHORTEST && token.bytes().all(is_token)).then(|| (right, token.to_owned()))
}

/// Whether two texts are equal, in a time that depends only on their lengths.
fn is_equal(one: &str, other: &str) -> bool {
    let pairs = one.bytes().zip(other.bytes());
    let differing = pairs.fold(0, |differing, (one, other)| black_box(differing | (one ^ other)));
    one.len() == other.len() && differing == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_grants_nothing_is_an_error_that_says_why() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("tokens");
        let read = |text: &str| {
            std::fs::write(&file, text).unwrap();
            Tokens::read(&file).map_err(|error| error.to_string())
        };
        let tokens = read("# lab\nmark mark-0123456789ab\n").unwrap();
        assert_eq!(tokens.right_of("mark-0123456789ab"), Some(Right::Mark));
        assert_eq!(format!("{tokens:?}"), "Tokens(1)");
        for (text, reason) in [
            ("# lab\n", "the file has no tokens"),
            ("\ncontrol short\n", "line 2 is not"),
            ("admin admin-0123456789\n", "line 1 is not"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(reason), "{error}");
        }
        let missing = Tokens::read(&folder.path().join("no")).unwrap_err();
        assert!(matches!(missing, TokensError::Unreadable { .. }));
    }
}
