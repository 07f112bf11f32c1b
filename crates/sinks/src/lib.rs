#![doc = include_str!("../README.md")]

mod bag;
mod aligned;
mod csv;
mod dashboard;
mod diagnostics;
mod foxglove;
mod hri;
mod lsl;
mod local_addresses;
mod announcements;
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
pub use announcements::Announcements;
pub use bag::{Bag, Continuation, ContinuingBag};
pub use csv::{Csv, tables_beside};
pub use dashboard::{ALLOWED, Announce, DashboardContext, MarkerSettings};
pub use ros::RosContext;
pub use teampulse_dashboard::wire::{PhasePlan, Unmet};
pub use teampulse_dashboard::{Addresses, FindUnmet};
pub use terminal::{
    Board, Colours, Estimates, Kept, NextPhase, Scroll, Terminal, TerminalContext, View,
    WarningOutput, leave_screen,
};
pub use tidy::{LOST_OR_WRONG, NOTHING_NOTICED, Tidy};

/// The table of all sinks.
pub const SINKS: &[Entry<dyn Sink, SinkContext>] = &[
    Entry::new::<bag::Bag>("bag"),
    Entry::new::<csv::Csv>("csv"),
    Entry::new::<tidy::Tidy>("tidy"),
    Entry::new::<terminal::Terminal>("terminal"),
    Entry::new::<ros::Ros>("ros"),
    Entry::new::<diagnostics::Diagnostics>("diagnostics"),
    Entry::new::<lsl::Lsl>("lsl"),
    Entry::new::<hri::Hri>("hri"),
    Entry::new::<dashboard::Dashboard>("dashboard"),
    Entry::new::<foxglove::Foxglove>("foxglove"),
];

/// The sinks that every session has, with default settings unless the study sets them. They store nothing.
pub const SHOWN: [&str; 4] = ["terminal", "ros", "diagnostics", "dashboard"];

/// The sinks that pass data on to other programs. They store nothing, either.
pub const PASSED_ON: [&str; 3] = ["foxglove", "hri", "lsl"];

/// The context in which sinks are built.
#[derive(Clone)]
pub struct SinkContext {
    /// The folder of the session's bag; other sinks put their files beside it.
    pub bag: PathBuf,
    /// The name of the session.
    pub session: String,
    /// The text of the study.
    pub study: String,
    /// The session's clock.
    pub clock: Clock,
    /// Whether the bag has ended before the session, and where it continues.
    pub bag_ended: Ended,
    /// The growth of the bag on disk.
    pub growth: Growth,
    /// What was lost to damage in the recording from which this session is computed.
    pub damage: Option<String>,
    /// Whether the recording comes from another program, which does not record the end of a session.
    pub is_imported: bool,
    /// The lines that sinks announce on the terminal. A sink keeps a clone, as it knows its address only once it runs.
    pub announcements: Announcements,
    /// The part of its session that is covered by the recording from which this session is computed.
    pub part: Part,
    /// What the terminal shows.
    pub terminal: TerminalContext,
    /// What is published on ROS, and where.
    pub ros: RosContext,
    /// What the dashboard shows.
    pub dashboard: DashboardContext,
}

impl SinkContext {
    /// The context of a named session that is recorded into a folder and shown nowhere.
    pub fn new(bag: impl Into<PathBuf>, session: impl Into<String>, clock: Clock) -> SinkContext {
        SinkContext {
            bag: bag.into(),
            session: session.into(),
            study: String::new(),
            clock,
            bag_ended: Ended::default(),
            growth: Growth::default(),
            damage: None,
            is_imported: false,
            announcements: Announcements::default(),
            part: Part::default(),
            terminal: TerminalContext::default(),
            ros: RosContext::default(),
            dashboard: DashboardContext::default(),
        }
    }
}

/// The part of its session that a recording covers; by default all of it.
#[derive(Clone, Debug, Default)]
pub struct Part {
    /// Whether the session was already running when the recording began.
    pub has_joined: bool,
    /// Why the recording ended before the session, if it did.
    pub ended: Option<String>,
}

/// Notifies the sinks that write beside a bag that it has ended early, and where the recording continues.
#[derive(Clone, Debug, Default)]
pub struct Ended(Arc<Mutex<Ending>>);

#[derive(Debug, Default)]
struct Ending {
    begins_later: bool,
    why: Option<String>,
    goes_on_in: Vec<PathBuf>,
}

impl Ended {
    /// Reports that the bag begins later than the session, by command.
    pub fn begins_later(&self) {
        self.lock().begins_later = true;
    }

    /// Whether the bag begins later than the session.
    pub fn is_later(&self) -> bool {
        self.lock().begins_later
    }

    /// Reports that the bag has ended early; the reason is a sentence about the failure.
    pub fn report(&self, why: impl Into<String>) {
        self.lock().why.get_or_insert_with(|| why.into());
    }

    /// Why the bag has ended early; `None` if it has not.
    pub fn why(&self) -> Option<String> {
        self.lock().why.clone()
    }

    /// Reports that the recording continues in another folder.
    pub fn goes_on_in(&self, folder: PathBuf) {
        self.lock().goes_on_in.push(folder);
    }

    /// The folders in which the recording continued, in order.
    pub fn folders(&self) -> Vec<PathBuf> {
        self.lock().goes_on_in.clone()
    }

    fn lock(&self) -> MutexGuard<'_, Ending> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
