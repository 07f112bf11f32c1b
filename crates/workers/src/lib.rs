#![doc = include_str!("../README.md")]

mod program;
mod frames;
pub mod model;
mod blur;
mod pose_3d;
mod child;
mod guard;

use teampulse_core::clock::Clock;
use teampulse_core::registry::Entry;
use teampulse_core::worker::Worker;

pub use blur::Blur;
pub use frames::Frames;
pub use model::Model;
pub use pose_3d::Pose3d;
pub use program::Program;

/// The table of all workers.
pub const WORKERS: &[Entry<dyn Worker, WorkerContext>] = &[
    Entry::new::<program::Program>("program"),
    Entry::new::<frames::Frames>("frames"),
    Entry::new::<model::Model>("model"),
    Entry::new::<blur::Blur>("blur"),
    Entry::new::<pose_3d::Pose3d>("pose_3d"),
];

/// The context in which workers are built.
#[derive(Clone, Debug)]
pub struct WorkerContext {
    /// The session's clock.
    pub clock: Clock,
}
