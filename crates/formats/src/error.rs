//! Why a file can't be read.

use thiserror::Error;

/// Why a file can't be read. The message fits after "failed to read the file: ".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum FormatError {
    /// The file ends too early.
    #[error("it ends within {0}")]
    Short(&'static str),
    /// A part of the file violates the format.
    #[error("{what}: {found:?}; expected {expected}")]
    Malformed {
        /// The part.
        what: String,
        /// What was found, shortened.
        found: String,
        /// What was expected.
        expected: &'static str,
    },
    /// A line of a text file in the archive violates the format.
    #[error("{what}: {found:?}; expected {expected}")]
    MalformedText {
        /// The part.
        what: String,
        /// What was found, shortened.
        found: String,
        /// What was expected.
        expected: &'static str,
    },
    /// The file contains nothing that can be imported.
    #[error("it contains no {0}")]
    Empty(&'static str),
    /// The contents would fill the memory.
    #[error("it has more than 64 million numbers, or unpacks to more than 256 MiB")]
    TooLarge,
    /// The file is compressed or encrypted in a way that is not supported.
    #[error("{0} is not supported")]
    Unsupported(String),
    /// The archive can't be unpacked.
    #[error("the archive can't be unpacked: {0}")]
    Archive(String),
}

impl FormatError {
    /// What the user can do about it.
    pub fn hint(&self) -> &'static str {
        match self {
            FormatError::Short(_) => "copy the file again from the device or its service",
            FormatError::Malformed { .. } => {
                "copy it again from where it was recorded; if it is the same there, export it again"
            }
            FormatError::MalformedText { .. } => {
                "export it again as it was recorded; a file that went through a spreadsheet has changed"
            }
            FormatError::Empty(_) => "choose the file that has the recorded signals",
            FormatError::TooLarge => "export a shorter part of the recording",
            FormatError::Unsupported(_) => "save it again without that, and import the new file",
            FormatError::Archive(_) => "download it again; if it was repacked, use plain zip",
        }
    }

    /// An error about a malformed part.
    pub(crate) fn malformed(
        what: impl Into<String>,
        found: &str,
        expected: &'static str,
    ) -> FormatError {
        FormatError::Malformed { what: what.into(), found: shortened(found), expected }
    }

    /// An error about a malformed line of text.
    pub(crate) fn malformed_text(
        what: impl Into<String>,
        found: &str,
        expected: &'static str,
    ) -> FormatError {
        FormatError::MalformedText { what: what.into(), found: shortened(found), expected }
    }
}

fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}
