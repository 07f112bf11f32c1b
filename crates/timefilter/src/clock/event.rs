//! Reports of clock events.

use std::fmt;

/// A clock event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClockEvent {
    /// The clock restarted near zero, as after the device was switched on again: a new epoch.
    Restarted {
        /// The number of the new epoch.
        epoch: u32,
    },
    /// The clock was set: a new epoch.
    Jumped {
        /// The number of the new epoch.
        epoch: u32,
        /// The size of the step, positive when set forward [s].
        secs: f64,
    },
    /// The counter wrapped; no new epoch.
    Wrapped,
    /// The clock is faster or slower than usual.
    Fast {
        /// The rate error relative to the session's clock [ppm].
        ppm: f64,
    },
    /// The sampling rate is not the declared one; a new epoch if device time is derived from sample
    /// indices.
    WrongRate {
        /// The declared rate [Hz].
        declared_hz: f64,
        /// The true rate [Hz].
        hz: f64,
    },
    /// The computer's timestamps are off, and are shifted from now on.
    Off {
        /// The offset, positive when ahead of the session's clock [s].
        secs: f64,
    },
    /// The computer's timestamps are right again, and are used unchanged.
    Trusted,
}

impl ClockEvent {
    /// The value of the event: offset or step [s], rate error [ppm] or rate [Hz]; NaN where there is none.
    pub fn value(&self) -> f64 {
        match self {
            ClockEvent::Jumped { secs, .. } | ClockEvent::Off { secs } => *secs,
            ClockEvent::Fast { ppm } => *ppm,
            ClockEvent::WrongRate { hz, .. } => *hz,
            ClockEvent::Restarted { .. } | ClockEvent::Wrapped | ClockEvent::Trusted => f64::NAN,
        }
    }
}

impl fmt::Display for ClockEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ClockEvent::Restarted { epoch } => write!(f, "restarted (epoch {epoch})"),
            ClockEvent::Jumped { epoch, secs } => {
                write!(f, "jumped by {secs:+.3} s (epoch {epoch})")
            }
            ClockEvent::Wrapped => f.write_str("counter wrapped"),
            ClockEvent::Fast { ppm } if ppm.abs() >= 1000.0 => {
                write!(f, "runs {:+.2} % fast", ppm / 10_000.0)
            }
            ClockEvent::Fast { ppm } => write!(f, "runs {ppm:+.0} ppm fast"),
            ClockEvent::WrongRate { declared_hz, hz } => {
                write!(f, "samples come at {hz:.2} Hz, not at the declared {declared_hz:.2} Hz")
            }
            ClockEvent::Off { secs } => write!(f, "is {secs:+.3} s off"),
            ClockEvent::Trusted => f.write_str("is right again"),
        }
    }
}
