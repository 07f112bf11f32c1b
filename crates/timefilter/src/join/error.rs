use std::fmt;

/// Why a recording could not be joined. The message fits after "failed to".
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JoinError {
    /// There are too few events on one side.
    Few {
        /// The number of events on the side with fewer events.
        found: usize,
        /// The number of events needed.
        needed: usize,
    },
    /// No event in one recording is within the largest allowed offset of one in the other.
    Apart,
    /// Two offsets fit about equally well.
    Ambiguous {
        /// The best offset [s].
        offset_secs: f64,
        /// The next best offset [s].
        next_offset_secs: f64,
    },
    /// There are too few segments with similar motion in both recordings.
    Still {
        /// The number of segments found.
        found: usize,
        /// The number of segments needed.
        needed: usize,
    },
    /// No more events match than would by chance.
    Chance {
        /// The number of events that match at the best offset.
        agree: usize,
        /// The number of events of the recording.
        events: usize,
    },
    /// The events of the two recordings do not match.
    Unlike {
        /// The share of events that match at the best offset [0..1].
        share: f64,
    },
}

impl JoinError {
    /// What the user can do about it.
    pub fn hint(&self) -> &'static str {
        match self {
            JoinError::Few { .. } => "choose a stream and a file that recorded the same minutes",
            JoinError::Apart => {
                "allow a larger offset, and make sure that both recordings cover the same time"
            }
            JoinError::Ambiguous { .. } => {
                "the events are too regular or too few: join by a tap or a marker, or allow only a smaller offset"
            }
            JoinError::Still { .. } => {
                "choose sensors that move together for a few minutes, or join by a tap or a marker"
            }
            JoinError::Chance { .. } => {
                "name the events that both recorded, or allow only a smaller offset; four or more at uneven intervals are safe"
            }
            JoinError::Unlike { .. } => {
                "make sure that both recorded the same person at the same time"
            }
        }
    }
}

impl fmt::Display for JoinError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            JoinError::Few { found, needed } => {
                write!(
                    f,
                    "find enough events in both recordings: found {found}, need at least {needed}"
                )
            }
            JoinError::Apart => f.write_str(
                "match the events: none in one recording is within the largest allowed offset of one in the other",
            ),
            JoinError::Ambiguous { offset_secs, next_offset_secs } => write!(
                f,
                "determine the offset: {offset_secs:.3} s and {next_offset_secs:.3} s fit about equally well"
            ),
            JoinError::Still { found, needed } => write!(
                f,
                "find enough half-minute segments with similar motion in both recordings: found {found}, need at least {needed}"
            ),
            JoinError::Chance { agree, events } => write!(
                f,
                "tell the match from chance: at the best offset {agree} of {events} events have a partner, and unrelated recordings would often have as many"
            ),
            JoinError::Unlike { share } => write!(
                f,
                "match the two: at the best offset {:.0} % of the events have a partner",
                100.0 * share
            ),
        }
    }
}

impl std::error::Error for JoinError {}
