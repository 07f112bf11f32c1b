//! Other computers' clocks, reported in band: which computer's clock stamps a stream, and the results of probes of that
//! clock. Both are recorded like any other input, so that a replay makes the same corrections.

use std::sync::Arc;

use teampulse_timefilter::clock::{ClockKind, Probe};

use crate::data::{Data, Event, EventKind};
use crate::publishers;
use crate::session_streams::own_events;
use crate::stopped;
use crate::stream::Stream;
use crate::time::Time;

/// The topic that states which computer stamps a stream.
pub(crate) const STAMPED_BY: &str = "/teampulse/stamped_by";
/// The topic of probes of other computers' clocks.
const PROBES: &str = "/teampulse/clock_probes";

/// The topics of reports on computers' clocks, on publishers and on stopped streams: too frequent to be shown to users,
/// or said already by the command.
pub const UNTOLD: [&str; 4] = [STAMPED_BY, PROBES, publishers::TOPIC, stopped::TOPIC];

/// Stamps further in the past than this are those of a simulation that started at 0 [s]: ten years.
const SIMULATED_SECS: f64 = 10.0 * 365.25 * 86_400.0;

/// Whether stamps with this offset [s] are of simulated time. Not if the computer's clock was probed, as simulations do
/// not answer probes: that clock has another epoch, such as when the computer was switched on.
pub fn is_simulated(offset_secs: f64, clock: ClockKind) -> bool {
    is_far(offset_secs) && clock != ClockKind::TwoWay
}

/// Whether a clock this far ahead [s] does not count from 1970.
pub(crate) fn is_far(offset_secs: f64) -> bool {
    offset_secs < -SIMULATED_SECS
}

/// The note about simulated stamps in a session on another clock.
pub const SIMULATED: &str =
    "stamps in simulated time: set clock = \"/clock\" below [session] to follow it";

/// A report on another computer's clock.
#[derive(Clone, Debug, PartialEq)]
pub enum ClockReport {
    /// This computer's clock stamps a stream.
    StampedBy {
        /// The stream's topic.
        stream: String,
        /// The computer.
        computer: String,
    },
    /// A probe of this computer's clock has ended.
    Probed {
        /// The computer.
        computer: String,
        /// How far its clock is ahead [s].
        offset_secs: f64,
        /// The round trip [s].
        round_trip_secs: f64,
    },
}

impl ClockReport {
    /// The stream of this report.
    pub(crate) fn stream(&self) -> Stream {
        let (topic, doc) = match self {
            ClockReport::StampedBy { .. } => {
                (STAMPED_BY, "whose clock stamps a stream: topic, computer")
            }
            ClockReport::Probed { .. } => (
                PROBES,
                "how far another computer's clock is ahead, and the round trip of the probe",
            ),
        };
        own_events(topic, doc)
    }

    /// The event of this report. The label of the first kind is the stream's name and the computer,
    /// separated by a space; the value of the second is the offset [s], its duration the round trip [s].
    pub(crate) fn event(&self) -> Data {
        let (label, value, duration_secs) = match self {
            ClockReport::StampedBy { stream, computer } => {
                (format!("{stream} {computer}"), f64::NAN, 0.0)
            }
            ClockReport::Probed { computer, offset_secs, round_trip_secs } => {
                (computer.clone(), *offset_secs, *round_trip_secs)
            }
        };
        Data::Event(Arc::new(Event { kind: EventKind::Clock, label, value, duration_secs }))
    }

    /// The report in a sample of the stream of this name; `None` for any other stream.
    pub fn read(stream: &Stream, data: &Data) -> Option<ClockReport> {
        let Data::Event(event) = data else { return None };
        match stream.name.as_str() {
            STAMPED_BY => {
                let (stream, computer) = event.label.split_once(' ')?;
                Some(ClockReport::StampedBy { stream: stream.into(), computer: computer.into() })
            }
            PROBES => {
                let (offset_secs, round_trip_secs) = (event.value, event.duration_secs);
                Some(ClockReport::Probed {
                    computer: event.label.clone(),
                    offset_secs,
                    round_trip_secs,
                })
            }
            _ => None,
        }
    }

    /// The probe of an exchange that was reported at `arrival`.
    pub(crate) fn probe(offset_secs: f64, round_trip_secs: f64, arrival: Time) -> Probe {
        Probe { arrival: arrival.nanos(), offset_secs, round_trip_secs }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_was_probed_is_not_of_simulated_time() {
        assert!(is_simulated(-1.8e9, ClockKind::Remote));
        assert!(!is_simulated(-1.8e9, ClockKind::TwoWay));
        assert!(!is_simulated(-3600.0, ClockKind::Remote));
    }

    #[test]
    fn a_report_survives_its_event() {
        for report in [
            ClockReport::StampedBy {
                stream: "/r1/odom".into(),
                computer: "laptop2 (driver, 01)".into(),
            },
            ClockReport::Probed {
                computer: "laptop2".into(),
                offset_secs: -1.5,
                round_trip_secs: 0.001,
            },
        ] {
            assert_eq!(ClockReport::read(&report.stream(), &report.event()), Some(report));
        }
    }
}
