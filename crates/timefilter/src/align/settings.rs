//! Settings of an aligner: its rows and its sources.

use super::error::AlignError;
use super::policy::{LONGEST_NANOS, Policy};

/// The most sources at once.
pub const MOST_SOURCES: usize = 4_096;
/// The most numbers that one source may keep: its capacity times its channels (128 MiB).
pub const MOST_NUMBERS: usize = 1 << 24;

/// The times of the rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Onto {
    /// The whole multiples of a period [ns, 1 to a day].
    ///
    /// The first row is the first one at or after the earliest sample. When no source delivers,
    /// rows go on for [`super::ROWS_IN_SILENCE`] periods and then rest until one does; those left
    /// out are counted.
    Grid {
        /// From one row to the next [ns].
        period_nanos: i64,
    },
    /// The samples of one source, the first that is added; its own policy is not asked. Samples
    /// with one and the same time make one row, of the last.
    Pivot,
}

/// When rows are given out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// When nothing that is still expected could change them, or its source's time is out: the
    /// same from a recording as from the session it came from, for recordings and statistics.
    Reproducible,
    /// At their time (a grid) or as soon as the pivot's sample is there, with what is there: for
    /// screens. As every sample comes after its time, none is called late, except a pivot's that
    /// comes after a later one.
    Available,
}

/// A source of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SourceSettings {
    /// How many values a sample has; at least one.
    pub channels: usize,
    /// How its values at a row's time are made.
    pub policy: Policy,
    /// Bounded lateness: a sample may come after one that was measured so much later [ns, 0 to a
    /// day]; the watermark is that far behind the newest sample.
    pub lateness_nanos: i64,
    /// Idle time-out: rows wait so long for a source that says nothing, and, beyond its lateness,
    /// for one that is behind [ns of session time, 1 to a day].
    pub idle_nanos: i64,
    /// How many samples are kept at most; at least one. Should hold what comes in the longest time
    /// that rows may have to wait for any source.
    pub capacity: usize,
}

impl SourceSettings {
    /// One channel, in order (no lateness), an idle time-out of two seconds, and at most 4096
    /// samples kept.
    pub fn new(policy: Policy) -> SourceSettings {
        SourceSettings {
            channels: 1,
            policy,
            lateness_nanos: 0,
            idle_nanos: 2_000_000_000,
            capacity: 4_096,
        }
    }

    pub(super) fn checked(self) -> Result<SourceSettings, AlignError> {
        self.policy.checked()?;
        time("lateness", 0, self.lateness_nanos)?;
        time("idle time-out", 1, self.idle_nanos)?;
        number("channels", MOST_NUMBERS, self.channels)?;
        number("samples of capacity", MOST_NUMBERS / self.channels, self.capacity)?;
        Ok(self)
    }
}

pub(super) fn time(what: &'static str, least_nanos: i64, got_nanos: i64) -> Result<(), AlignError> {
    let in_range = (least_nanos..=LONGEST_NANOS).contains(&got_nanos);
    if in_range { Ok(()) } else { Err(AlignError::Time { what, least_nanos, got_nanos }) }
}

fn number(what: &'static str, most: usize, got: usize) -> Result<(), AlignError> {
    let in_range = (1..=most).contains(&got);
    if in_range { Ok(()) } else { Err(AlignError::Number { what, most, got }) }
}

/// A source of one aligner, as long as it is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SourceId {
    pub(super) place: u32,
    pub(super) serial: u32,
}

/// One sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<'a> {
    /// When it was measured [ns since the Unix epoch].
    pub measured: i64,
    /// When it arrived [ns of session time]; one before the time of the session counts as that.
    pub arrival: i64,
    /// Its values, one a channel.
    pub values: &'a [f64],
}

/// Samples that arrived at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run<'a> {
    /// When the first was measured [ns since the Unix epoch].
    pub measured: i64,
    /// From one sample to the next [ns].
    pub period_nanos: f64,
    /// When they arrived [ns of session time]; one before the time of the session counts as that.
    pub arrival: i64,
    /// Their values, sample by sample.
    pub values: &'a [f64],
}
