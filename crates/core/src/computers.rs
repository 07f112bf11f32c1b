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

/// The topics of reports on computers' clocks, publishers and stopped streams. They are not shown to users: they are
/// too frequent, or repeat a command.
pub const UNTOLD: [&str; 4] = [STAMPED_BY, PROBES, publishers::TOPIC, stopped::TOPIC];

/// Stamps that are more than ten years in the past come from a clock that started at 0 [s].
const SIMULATED_SECS: f64 = 10.0 * 365.25 * 86_400.0;

/// Whether stamps with this offset [s] are in simulated time. They are not if the computer's clock was probed, as
/// simulations do not answer probes: that clock has another epoch, such as the boot of the computer.
pub fn is_simulated(offset_secs: f64, clock: ClockKind) -> bool {
    is_far(offset_secs) && clock != ClockKind::TwoWay
}

/// Whether a clock with this offset [s] does not count from 1970.
pub(crate) fn is_far(offset_secs: f64) -> bool {
    offset_secs < -SIMULATED_SECS
}

/// The note about simulated stamps in a session on another clock.
pub const SIMULATED: &str =
    "stamps in simulated time: set clock = \"/clock\" below [session] to follow it";

/// A report on another computer's clock.
#[derive(Clone, Debug, PartialEq)]
pub enum ClockReport {
    /// A computer's clock stamps a stream.
    StampedBy {
        /// The stream's topic.
        stream: String,
        /// The computer.
        computer: String,
    },
    /// A probe of a computer's clock has ended.
    Probed {
        /// The computer.
        computer: String,
        /// How far the computer's clock is ahead [s].
        offset_secs: f64,
        /// The round-trip time of the probe [s].
        round_trip_secs: f64,
    },
}

impl ClockReport {
    /// The stream of this report.
    pub(crate) fn stream(&self) -> Stream {
        let (topic, doc) = match self {
            ClockReport::StampedBy { .. } => {
                (STAMPED_BY, "which computer's clock stamps a stream: topic, computer")
            }
            ClockReport::Probed { .. } => (
                PROBES,
                "how far another computer's clock is ahead, and the round-trip time of the probe",
            ),
        };
        own_events(topic, doc)
    }

    /// The event of this report. For `StampedBy`, the label is the stream's name and the computer, separated by a
    /// space; for `Probed`, the value is the offset [s] and the duration the round-trip time [s].
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

    /// Reads the report from a sample of a report stream; `None` for any other stream.
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

    /// The probe for the clock model, from an exchange that was reported at `arrival`.
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
