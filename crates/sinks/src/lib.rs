#![doc = include_str!("../README.md")]

mod bag;
mod aligned;
mod csv;
mod diagnostics;
mod ros;
mod tidy;
mod terminal;
mod text;

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use teampulse_bag::Growth;
use teampulse_core::clock::Clock;
use teampulse_core::registry::Entry;
use teampulse_core::sink::Sink;

pub use aligned::Aligned;
pub use bag::{Again, Bag, ContinuingBag};
pub use csv::{Csv, tables_beside};
pub use ros::RosContext;
pub use terminal::{
    Aside, Board, Colours, Estimates, Kept, NextPhase, Scroll, Terminal, TerminalContext, View,
    leave_screen,
};
pub use tidy::Tidy;

/// The table of all sinks.
pub const SINKS: &[Entry<dyn Sink, SinkContext>] = &[
    Entry::new::<bag::Bag>("bag"),
    Entry::new::<csv::Csv>("csv"),
    Entry::new::<tidy::Tidy>("tidy"),
    Entry::new::<terminal::Terminal>("terminal"),
    Entry::new::<ros::Ros>("ros"),
    Entry::new::<diagnostics::Diagnostics>("diagnostics"),
];

/// The sinks that every session has that is run, with their defaults where the study has no settings for
/// them. They keep nothing.
pub const SHOWN: [&str; 3] = ["terminal", "ros", "diagnostics"];

/// What sinks are built with.
#[derive(Clone)]
pub struct SinkContext {
    /// The folder of the session's bag; other sinks put their files beside it.
    pub bag: PathBuf,
    /// What the session is called.
    pub session: String,
    /// The text of the study.
    pub study: String,
    /// The session's clock.
    pub clock: Clock,
    /// Whether the bag has ended before the session did, and where it goes on.
    pub bag_ended: Ended,
    /// How the bag grows on the disk.
    pub growth: Growth,
    /// What damage took from the recording that this session is computed from.
    pub damage: Option<String>,
    /// What the terminal shows.
    pub terminal: TerminalContext,
    /// What is published on ROS, and where.
    pub ros: RosContext,
}

impl SinkContext {
    /// That of a session of a name which is recorded into a folder and shown nowhere.
    pub fn new(bag: impl Into<PathBuf>, session: impl Into<String>, clock: Clock) -> SinkContext {
        SinkContext {
            bag: bag.into(),
            session: session.into(),
            study: String::new(),
            clock,
            bag_ended: Ended::default(),
            growth: Growth::default(),
            damage: None,
            terminal: TerminalContext::default(),
            ros: RosContext::default(),
        }
    }
}

/// Notifies the sinks that write beside a bag that it has ended early, and where the recording continues.
#[derive(Clone, Debug, Default)]
pub struct Ended(Arc<Mutex<Ending>>);

#[derive(Debug, Default)]
struct Ending {
    why: Option<String>,
    goes_on_in: Vec<PathBuf>,
}

impl Ended {
    /// It has ended, for a reason that is a sentence about what failed.
    pub fn report(&self, why: impl Into<String>) {
        self.lock().why.get_or_insert_with(|| why.into());
    }

    /// Why it has ended; `None` while it goes on.
    pub fn why(&self) -> Option<String> {
        self.lock().why.clone()
    }

    /// The recording goes on in another folder.
    pub fn goes_on_in(&self, folder: PathBuf) {
        self.lock().goes_on_in.push(folder);
    }

    /// The folders in which the recording went on, in their order.
    pub fn folders(&self) -> Vec<PathBuf> {
        self.lock().goes_on_in.clone()
    }

    fn lock(&self) -> MutexGuard<'_, Ending> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
