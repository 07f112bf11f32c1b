//! Settings of an aligner: its rows and its sources.

use super::error::AlignError;
use super::policy::{LONGEST_NANOS, Policy};

/// The most sources at once.
pub const MOST_SOURCES: usize = 4_096;
/// The most numbers that one source may buffer: its capacity times its channels (128 MiB).
pub const MOST_NUMBERS: usize = 1 << 24;

/// The times of the rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowTimes {
    /// The multiples of a period [ns, 1 to a day].
    ///
    /// The first row is the first one at or after the earliest sample. When no source delivers, rows
    /// continue for [`super::ROWS_IN_SILENCE`] periods and then pause until one does; those left out are
    /// counted.
    Grid {
        /// The time between rows [ns].
        period_nanos: i64,
    },
    /// The times of the samples of one source, the first one added; its own policy is ignored. Several samples with the
    /// same time give one row, with the values of the last.
    Pivot,
}

/// When rows are issued.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Rows are issued when no outstanding sample could change them, or when the time-out of a missing source has
    /// expired. They are identical in a session and in a replay of its recording, as needed for recordings and
    /// statistics.
    Reproducible,
    /// Rows are issued at their time (a grid) or when the pivot's sample arrives, with the data available then, as
    /// needed for displays. As every sample arrives after its time, none counts as late, except a pivot's sample that
    /// arrives after a later one.
    Available,
}

/// A source of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SourceSettings {
    /// The number of values in a sample; at least one.
    pub channels: usize,
    /// How the values at a row's time are computed.
    pub policy: Policy,
    /// Bounded lateness: a sample may arrive after one measured this much later [ns, 0 to a day]; the
    /// watermark is this far behind the newest sample.
    pub lateness_nanos: i64,
    /// Idle time-out: rows wait this long for a silent source and, beyond its lateness, for one that is
    /// behind [ns of session time, 1 to a day].
    pub idle_nanos: i64,
    /// The most samples that are buffered; at least one. It should hold the samples of the longest time
    /// that rows may wait for any source.
    pub capacity: usize,
}

impl SourceSettings {
    /// One channel, no lateness, an idle time-out of two seconds, and at most 4096 buffered samples.
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

/// The identifier of a source of one aligner, valid until the source leaves.
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
    /// When it arrived [ns of session time]; a time before the current session time counts as the current
    /// one.
    pub arrival: i64,
    /// The values, one per channel.
    pub values: &'a [f64],
}

/// Samples that arrived together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run<'a> {
    /// When the first sample was measured [ns since the Unix epoch].
    pub measured: i64,
    /// The sampling period [ns].
    pub period_nanos: f64,
    /// When they arrived [ns of session time]; a time before the current session time counts as the current
    /// one.
    pub arrival: i64,
    /// The values, sample by sample.
    pub values: &'a [f64],
}
