use std::fmt;

/// Why no lag could be found. The message fits after "failed to".
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CalibrationError {
    /// There are too few samples to distinguish events from the quiet level.
    Short(Which),
    /// No event exceeds the noise.
    Quiet(Which),
    /// Both streams have events, but none within the longest lag of each other.
    Apart {
        /// The longest lag searched [s].
        max_lag_secs: f64,
    },
    /// Two lags explain the events about equally well.
    Ambiguous {
        /// The best lag [s].
        lag_secs: f64,
        /// The second best lag [s].
        next_lag_secs: f64,
    },
}

/// One of the two streams.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// The stream whose times are taken to be right.
    Reference,
    /// The stream that is calibrated.
    Stream,
}

impl CalibrationError {
    /// What the user can do about it.
    pub fn hint(&self) -> &'static str {
        match self {
            CalibrationError::Short(_) => "record at least a few seconds around each event",
            CalibrationError::Quiet(_) => {
                "tap harder, with a second of quiet before each tap, and choose the part of the \
                 recording with the taps"
            }
            CalibrationError::Apart { .. } => {
                "allow a longer lag, and make sure that both streams recorded the same event"
            }
            CalibrationError::Ambiguous { .. } => {
                "tap a few times at uneven intervals, or allow only a shorter lag"
            }
        }
    }
}

impl fmt::Display for CalibrationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CalibrationError::Short(which) => {
                write!(f, "find an event in the {which}: it has too few samples")
            }
            CalibrationError::Quiet(which) => {
                write!(f, "find an event in the {which}: nothing stands out from its noise")
            }
            CalibrationError::Apart { max_lag_secs } => {
                write!(f, "find a shared event: none are within {max_lag_secs:.3} s of one another")
            }
            CalibrationError::Ambiguous { lag_secs, next_lag_secs } => write!(
                f,
                "determine the lag: {lag_secs:.3} s and {next_lag_secs:.3} s fit about equally well"
            ),
        }
    }
}

impl std::error::Error for CalibrationError {}

impl fmt::Display for Which {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Which::Reference => "reference",
            Which::Stream => "stream",
        })
    }
}
