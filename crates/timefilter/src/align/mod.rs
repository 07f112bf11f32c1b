//! Alignment: values of many streams at common times, onto a grid or onto a pivot stream.
//!
//! A view: the input is not changed, and everything that a row left out is reported ([`Aside`]) and counted
//! ([`Counts`]). See [`Aligner`].
//!
//! A sample whose values are all NaN is no value: nothing is held, interpolated or counted with
//! it, but it shows that its source is there. In a sample with some numbers each NaN is carried on
//! as it is: it is held as NaN, a line with a NaN at one end is NaN, and windows pass over it.

mod aligner;
mod row;
mod settings;
mod policy;
mod source;
mod window;
mod watermark;
mod samples;
mod error;

pub use aligner::{AHEAD_NANOS, Aligner, ROWS_IN_SILENCE};
pub use error::AlignError;
pub use policy::{Aggregate, LONGEST_NANOS, Policy};
pub use row::{Aside, Cell, News, Output, Row, Validity, Why};
pub use settings::{MOST_NUMBERS, MOST_SOURCES, Mode, Onto, Run, Sample, SourceId, SourceSettings};
pub use source::Counts;
