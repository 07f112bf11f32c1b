//! Intervals between heartbeats: detection and correction of wrong ones.
//!
//! Times of beats are in seconds, ascending; an interval belongs to the beat that ends it. The steps are a
//! person's edits of single beats ([`Beats::edited`]), then the [`Correction`] of Lipponen and Tarvainen,
//! which keeps those edits, then the [`gate`](gated_ms) against implausible intervals. Corrections are
//! counted and reported; above [`MOST_PERCENT`], the remaining intervals are not reliable.

mod beats;
mod artefacts;
mod natural;
mod rolling;
mod correction;
mod range;

pub use artefacts::{Artefact, Artefacts, Kind};
pub use beats::{Beats, Edit};
pub use correction::{Corrected, Correction, Passes};
pub use range::{PLAUSIBLE_MS, gated_ms};

/// A series with a larger share of corrected beats than this [%] should be checked by a person. Task Force
/// (1996), doi:10.1161/01.CIR.93.5.1043, recommends editing; the usual limit is 5 %.
pub const MOST_PERCENT: f64 = 5.0;
