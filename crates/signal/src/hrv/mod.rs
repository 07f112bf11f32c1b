//! Heart rate variability: features of the intervals between normal beats [ms].
//!
//! Correct the intervals first (see [`intervals`](crate::intervals)). A missing interval is NaN and keeps
//! its place: nothing is computed across it. Names are those of NeuroKit2 where it has the feature; where
//! its definition differs from the textbook's, the textbook's is used, and the difference is documented.

mod measure;
mod series;
mod time;
mod segments;
mod geometric;
mod frequency;
mod autoregressive;
mod poincare;
mod asymmetry;
mod fragmentation;
mod entropy;
mod fuzzy;
mod multiscale;
mod dfa;
mod event_related;
mod windows;
mod repeats;
pub mod analysis;

pub use asymmetry::{Asymmetry, asymmetry};
pub use dfa::{ALPHA1_BEATS, ALPHA2_BEATS, DetrendedFluctuation, detrended_fluctuation, dfa_alpha};
pub use entropy::{Entropies, approximate_entropy, entropies, sample_entropy};
pub use event_related::{EventRate, EventSpans};
pub use fragmentation::{Fragmentation, fragmentation};
pub use frequency::{FrequencyDomain, Recipe, frequency_domain};
pub use fuzzy::fuzzy_entropy;
pub use geometric::{BIN_MS, Geometric, geometric};
pub use measure::Measure;
pub use multiscale::{multiscale_entropy, multiscale_index};
pub use poincare::{Poincare, poincare};
pub use segments::{Segments, segments};
pub use time::{TimeDomain, time_domain};
pub use windows::{BEFORE_SECS, Domain, EDIT_WITHIN_SECS, HeartWindows, Treatment};
