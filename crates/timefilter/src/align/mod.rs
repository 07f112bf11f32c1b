//! Alignment: resampling many streams at common times, on a grid or at the samples of a pivot stream.
//!
//! The input is not changed, and every sample that rows left out is reported ([`LeftOut`]) and counted
//! ([`Counts`]). See [`Aligner`].
//!
//! A sample whose values are all NaN is blank: it is not held, interpolated or counted, but shows that its
//! source is alive. In a sample with some numbers each NaN is kept: it is held as NaN, a line with a NaN at
//! one end is NaN, and windows skip it.

mod aligner;
mod row;
mod settings;
mod policy;
mod source;
mod cell;
mod segment;
mod window;
mod watermark;
mod samples;
mod error;

pub use aligner::{AHEAD_NANOS, Aligner, ROWS_IN_SILENCE};
pub use error::AlignError;
pub use policy::{Aggregate, LONGEST_NANOS, Policy};
pub use row::{Cell, LeftOut, LeftOutReason, Output, Row, SourceEvent, Validity};
pub use settings::{
    MOST_NUMBERS, MOST_SOURCES, Mode, RowTimes, Run, Sample, SourceId, SourceSettings,
};
pub use source::Counts;
