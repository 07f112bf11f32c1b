//! The errors of an aligner.

use std::fmt;

/// The errors of an aligner; each message fits after "failed to align: ".
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AlignError {
    /// The text is not a policy.
    Policy {
        /// The first 64 characters of the text.
        got: String,
    },
    /// A time is out of range.
    Time {
        /// What the time belongs to.
        what: &'static str,
        /// The shortest time allowed [ns].
        least_nanos: i64,
        /// The given time [ns].
        got_nanos: i64,
    },
    /// A number is out of range.
    Number {
        /// What the number counts.
        what: &'static str,
        /// The largest number allowed; the smallest is one.
        most: usize,
        /// The given number.
        got: usize,
    },
    /// There are too many sources.
    Crowded {
        /// The most sources at once.
        most: usize,
    },
    /// Time has started: a source can only be added with the time at which it joins.
    Begun,
    /// The source has left, or belongs to another aligner.
    Unknown,
    /// The number of values is not a multiple of the source's channels.
    Channels {
        /// The number of channels of the source.
        expected: usize,
        /// The number of values given.
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
