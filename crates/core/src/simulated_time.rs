//! Breaks of simulated time, as events of the session: formatted and parsed.

use std::fmt;

use crate::data::{Data, Event, EventKind};

/// The topic of simulated time.
pub const SIMULATED_CLOCK: &str = "/clock";

/// A break of simulated time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Break {
    /// Simulated time went back by this much [s].
    Back(f64),
    /// Simulated time jumped forward by this much [s].
    Ahead(f64),
    /// No new simulated time was published for this long [s].
    Stopped(f64),
    /// Simulated time resumed, after the session's time had followed the host's clock for this long [s].
    GoesOn(f64),
    /// A second publisher of simulated time appeared, and is not followed.
    Several,
}

impl Break {
    /// The event that reports this break: its label begins with the topic, and its value is the size [s].
    pub fn event(self) -> Event {
        let (kind, value) = match self {
            Break::Back(secs) => (EventKind::Clock, -secs),
            Break::Ahead(secs) | Break::Stopped(secs) | Break::GoesOn(secs) => {
                (EventKind::Clock, secs)
            }
            Break::Several => (EventKind::Fault, f64::NAN),
        };
        Event { kind, label: format!("{SIMULATED_CLOCK} {self}"), value, duration_secs: 0.0 }
    }
}

impl fmt::Display for Break {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Break::Back(secs) => write!(f, "jumped back by {secs:.3} s"),
            Break::Ahead(secs) => write!(f, "jumped ahead by {secs:.3} s"),
            Break::Stopped(_) => {
                f.write_str("stopped; the session's time follows this host's clock")
            }
            Break::GoesOn(_) => f.write_str("resumed"),
            Break::Several => f.write_str("has two publishers; only the first is followed"),
        }
    }
}

/// Whether an event of the session reports that simulated time jumped, stopped or resumed.
pub(crate) fn breaks_simulated_time(data: &Data) -> bool {
    let of_clock = |label: &str| label.split(' ').next() == Some(SIMULATED_CLOCK);
    matches!(data, Data::Event(event) if event.kind == EventKind::Clock && of_clock(&event.label))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[test]
    fn a_break_survives_its_event() {
        let is_read = |each: Break| breaks_simulated_time(&Data::Event(Arc::new(each.event())));
        let breaks = [Break::Back(1.0), Break::Ahead(1.0), Break::Stopped(4.0), Break::GoesOn(8.0)];
        assert!(breaks.into_iter().all(is_read));
        assert!(!is_read(Break::Several), "the first is still followed");
        assert_eq!(Break::Back(1.5).event().label, "/clock jumped back by 1.500 s");
    }
}
