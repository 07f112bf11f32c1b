//! What an aligner refuses.

use std::fmt;

/// What an aligner refuses; each fits after "failed to align: ".
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AlignError {
    /// The text names no policy.
    Policy {
        /// The text, its first 64 characters.
        got: String,
    },
    /// A time is out of range.
    Time {
        /// What it is the time of.
        what: &'static str,
        /// The shortest that is allowed [ns].
        least_nanos: i64,
        /// What was given [ns].
        got_nanos: i64,
    },
    /// A number is out of range.
    Number {
        /// What it is the number of.
        what: &'static str,
        /// The largest that is allowed; the smallest is one.
        most: usize,
        /// What was given.
        got: usize,
    },
    /// There are as many sources already as there can be.
    Crowded {
        /// How many there can be at once.
        most: usize,
    },
    /// Time has begun to pass: a source joins at a time now.
    Begun,
    /// The source has left, or is another aligner's.
    Unknown,
    /// The values are no whole samples of the source.
    Channels {
        /// How many channels the source has.
        expected: usize,
        /// How many values were given.
        got: usize,
    },
}

impl fmt::Display for AlignError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            AlignError::Policy { got } => write!(
                f,
                "expected a policy such as `exact`, `nearest:20ms`, `hold:2s`, `linear:0.5s` or \
                 `mean:1s` (or min, max, last, count), got `{got}`"
            ),
            AlignError::Time { what, least_nanos, got_nanos } => write!(
                f,
                "expected a time of the {what} of at least {least_nanos} ns and at most one day, \
                 got {got_nanos} ns"
            ),
            AlignError::Number { what, most, got } => {
                write!(f, "expected 1 to {most} {what}, got {got}")
            }
            AlignError::Crowded { most } => {
                write!(f, "expected at most {most} sources at once, got one more")
            }
            AlignError::Begun => f.write_str("expected the time at which the source joins"),
            AlignError::Unknown => f.write_str("expected a source of this aligner"),
            AlignError::Channels { expected, got } => {
                write!(f, "expected samples of {expected} channels, got {got} values")
            }
        }
    }
}

impl std::error::Error for AlignError {}
