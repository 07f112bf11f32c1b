//! Sinks: whatever keeps or shows data. The condition monitoring of the paper.

mod bag;
mod aligned;
mod csv;
mod tidy;
mod terminal;

use std::path::PathBuf;

use teampulse_core::clock::Clock;
use teampulse_core::registry::Entry;
use teampulse_core::sink::Sink;

pub use aligned::Aligned;
pub use bag::Bag;
pub use csv::Csv;
pub use terminal::{Board, Estimates, Terminal};
pub use tidy::Tidy;

/// The table of all sinks.
pub const SINKS: &[Entry<dyn Sink, SinkContext>] = &[
    Entry::new::<bag::Bag>("bag"),
    Entry::new::<csv::Csv>("csv"),
    Entry::new::<tidy::Tidy>("tidy"),
];

/// What sinks are built with.
#[derive(Clone, Debug)]
pub struct SinkContext {
    /// The folder of the session's bag; other sinks put their files beside it.
    pub bag: PathBuf,
    /// What the session is called.
    pub session: String,
    /// The text of the study.
    pub study: String,
    /// The session's clock.
    pub clock: Clock,
}
