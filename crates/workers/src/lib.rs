#![doc = include_str!("../README.md")]

mod program;

use teampulse_core::registry::Entry;
use teampulse_core::worker::Worker;

pub use program::Program;

/// The table of all workers.
pub const WORKERS: &[Entry<dyn Worker, ()>] = &[Entry::new::<program::Program>("program")];
