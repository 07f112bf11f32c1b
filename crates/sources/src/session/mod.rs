//! The session's own sources: phases, markers, and the simulated clock.

mod clock;
mod computers;
mod events;
mod commands;
mod keyboard;
mod keys;
mod overflows;
mod phases;
mod schedule;

pub use clock::{SimulatedClock, follow_clock};
pub use commands::RosCommands;
pub use computers::Computers;
pub use events::RosEvents;
pub use keyboard::Key;
pub use keys::{Keys, PauseKeys, marker, pause_by_key};
pub use overflows::Overflows;
pub use phases::{Phase, Phases, check_phases};
pub use schedule::ScheduleHandle;

use teampulse_core::data::{Event, EventKind};
use teampulse_core::outlet::Outlet;

/// Offers an event of the session, stamped now.
fn happen(outlet: &Outlet, kind: EventKind, label: &str, duration_secs: f64) {
    outlet.happen(Event { kind, label: label.to_owned(), value: f64::NAN, duration_secs });
}
