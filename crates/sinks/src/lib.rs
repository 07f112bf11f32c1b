//! Sinks: whatever keeps or shows data. The condition monitoring of the paper.

mod bag;
mod aligned;
mod csv;
mod tidy;
mod terminal;
mod text;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use teampulse_core::clock::Clock;
use teampulse_core::registry::Entry;
use teampulse_core::sink::Sink;

pub use aligned::Aligned;
pub use bag::{Bag, Telling};
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
    /// Whether the bag has ended before the session did.
    pub bag_ended: Ended,
    /// What damage took from the recording that this session is computed from.
    pub damage: Option<String>,
}

/// Tells sinks that the one beside which they write has ended early.
#[derive(Clone, Debug, Default)]
pub struct Ended(Arc<AtomicBool>);

impl Ended {
    /// It has ended.
    pub fn tell(&self) {
        self.0.store(true, Ordering::Release);
    }

    /// Whether it has.
    pub fn is_told(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }
}
