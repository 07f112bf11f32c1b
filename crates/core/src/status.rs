//! The health of a stream, as published once a second.

use std::fmt;

use crate::text::{LONGEST_LABEL, LONGEST_NAME, is_clean};

/// The health of a stream.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamStatus {
    /// The stream's name; for a second type on its topic, with the type appended: `/r1/x (a_msgs/msg/A)`.
    pub name: String,
    /// Its place in the life cycle.
    pub state: State,
    /// Why it is not OK; empty when it is, unless it was stopped on purpose, which this says.
    pub reason: String,
    /// Its rate over the last seconds [Hz].
    pub rate_hz: f64,
    /// Time since its last sample arrived [s]; NaN before the first.
    pub age_secs: f64,
    /// The number of readings taken, duplicates included: a wave counts once.
    pub received: u64,
    /// The number of samples lost in transit, those within waves; `None` where that can't be known.
    pub lost_source: Option<u64>,
    /// The number of samples lost in our own queue, those within waves.
    pub lost_queue: u64,
    /// The number of samples out of order.
    pub late: u64,
    /// The number of duplicates.
    pub duplicates: u64,
    /// How its clock is modelled: 0 the host's, 1 one-way, 2 two-way, 3 by sample index, 4 another
    /// computer's; see [`ClockKind`](teampulse_timefilter::clock::ClockKind).
    pub clock: u8,
    /// The number of times that its clock was restarted.
    pub epoch: u32,
    /// How far its clock is ahead of the session's [s]; NaN where unknown.
    pub offset_secs: f64,
    /// How much faster its clock runs [ppm]; NaN where unknown.
    pub skew_ppm: f64,
    /// The standard deviation of its delays around the shortest [s]; NaN where unknown.
    pub jitter_secs: f64,
    /// The standard uncertainty of `measured` [s]; 1.96 times as much on either side holds the
    /// truth with a probability of 95 %. NaN where unknown.
    pub sigma_secs: f64,
    /// The median time from measuring to arrival over the last seconds [s]; NaN where unknown.
    pub latency_secs: f64,
}

/// Half the width of an interval that holds the truth with a probability of 95 %, in standard
/// uncertainties.
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

    /// Whether its texts are [short and clean](crate::text); the second type on a topic has both in its name.
    pub(crate) fn is_clean(&self) -> bool {
        is_clean(&self.name, 2 * LONGEST_NAME) && is_clean(&self.reason, LONGEST_LABEL)
    }

    /// Half the width of the interval that holds the true time of a sample with a probability of
    /// 95 % [s]; NaN where unknown.
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
    /// Its rate is as declared or learned.
    Ok = 1,
    /// It has samples, but with a fault.
    Degraded = 2,
    /// Its next sample is overdue.
    Stale = 3,
    /// It has had no samples for a long time.
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
