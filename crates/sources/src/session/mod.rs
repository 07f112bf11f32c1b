//! What belongs to the session itself: its phases, its markers, its simulated clock.

mod clock;
mod computers;
mod events;
mod keys;
mod phases;

pub use clock::follow_clock;
pub use computers::Computers;
pub use events::RosEvents;
pub use keys::{Keys, PauseKeys, pause_by_key};
pub use phases::{Phase, Phases, check_phases};

use std::sync::Arc;

use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::outlet::Outlet;
use teampulse_core::pump::session_events;
use teampulse_core::source::Reading;

/// Hands over an event of the session, now.
fn happen(outlet: &Outlet, kind: EventKind, label: &str, duration_secs: f64) {
    let stream = outlet.declare(session_events());
    let event = Event { kind, label: label.to_owned(), value: f64::NAN, duration_secs };
    let data = Data::Event(Arc::new(event));
    outlet.offer(Reading { stream, device_time: None, source_time: None, data });
}
