//! The health of a stream, as published once a second.

use std::fmt;

use crate::text::{LONGEST_LABEL, LONGEST_NAME, is_clean};

/// The health of a stream.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamStatus {
    /// The stream's name; for a second type on its topic, with the type appended: `/r1/x (a_msgs/msg/A)`.
    pub name: String,
    /// The stream's state in its life cycle.
    pub state: State,
    /// Why the stream is not OK; empty if it is OK, except that it also states that a stream was stopped on purpose.
    pub reason: String,
    /// The rate over the last seconds [Hz].
    pub rate_hz: f64,
    /// The time since the last sample arrived [s]; NaN before the first.
    pub age_secs: f64,
    /// The number of readings taken, including duplicates; a wave counts once.
    pub received: u64,
    /// The number of samples lost in transit, counting each sample in a wave; `None` if it can't be known.
    pub lost_source: Option<u64>,
    /// The number of samples lost in our own queue, counting each sample in a wave.
    pub lost_queue: u64,
    /// The number of samples out of order.
    pub late: u64,
    /// The number of duplicates.
    pub duplicates: u64,
    /// How the stream's clock is modelled: 0 the host's clock, 1 one-way, 2 two-way, 3 by sample index, 4 another
    /// computer's clock; see [`ClockKind`](teampulse_timefilter::clock::ClockKind).
    pub clock: u8,
    /// How many times the clock has restarted.
    pub epoch: u32,
    /// How far the clock is ahead of the session's [s]; NaN if unknown.
    pub offset_secs: f64,
    /// How much faster the clock runs than the session's [ppm]; NaN if unknown.
    pub skew_ppm: f64,
    /// The standard deviation of the delays around the shortest one [s]; NaN if unknown.
    pub jitter_secs: f64,
    /// The standard uncertainty of `measured` [s]: the true time is within 1.96 times this with a probability of 95 %.
    /// NaN if unknown.
    pub sigma_secs: f64,
    /// The median time from measuring to arrival over the last seconds [s]; NaN where unknown.
    pub latency_secs: f64,
}

/// Half the width of a 95 % interval, in standard uncertainties.
pub(crate) const SIGMAS_95: f64 = 1.96;

impl StreamStatus {
    /// The name of a second type on a topic.
    pub(crate) fn name_of_type(topic: &str, type_name: &str) -> String {
        format!("{topic} ({type_name})")
    }

    /// The topic of the stream: its name without a type.
    pub fn topic(&self) -> &str {
        self.name.split_once(' ').map_or(&self.name, |(topic, _)| topic)
    }

    /// Whether the texts are [short and clean](crate::text); the name may be twice as long, as it may contain a topic
    /// and a type.
    pub(crate) fn is_clean(&self) -> bool {
        is_clean(&self.name, 2 * LONGEST_NAME) && is_clean(&self.reason, LONGEST_LABEL)
    }

    /// Half the width of the 95 % interval of a sample's true time [s]; NaN if unknown.
    pub fn uncertainty_secs(&self) -> f64 {
        SIGMAS_95 * self.sigma_secs
    }
}

/// The life cycle of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum State {
    /// Declared, without any sample so far.
    Never = 0,
    /// The rate is as declared or learned.
    Ok = 1,
    /// Samples arrive, but with a fault.
    Degraded = 2,
    /// The next sample is overdue.
    Stale = 3,
    /// No sample has arrived for a long time.
    Dead = 4,
}

impl State {
    /// The state with this code on the wire; `None` for an unknown code.
    pub fn from_code(code: u8) -> Option<State> {
        [Self::Never, Self::Ok, Self::Degraded, Self::Stale, Self::Dead]
            .get(usize::from(code))
            .copied()
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            State::Never => "never seen",
            State::Ok => "ok",
            State::Degraded => "degraded",
            State::Stale => "stale",
            State::Dead => "dead",
        })
    }
}
