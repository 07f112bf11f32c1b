//! Reports of what happens to clocks.

use std::fmt;

/// Something that happened to a clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum News {
    /// It began anew near zero, as a device does that was switched on again: a new epoch.
    Restarted {
        /// The number of the new epoch.
        epoch: u32,
    },
    /// It stepped: a new epoch.
    Jumped {
        /// The number of the new epoch.
        epoch: u32,
        /// By how much, ahead when positive [s].
        secs: f64,
    },
    /// Its counter came to its end and began at zero; no new epoch.
    Wrapped,
    /// It runs faster or slower than clocks do.
    Fast {
        /// How much faster than the session's clock [ppm].
        ppm: f64,
    },
    /// Its samples come at another rate than was declared; a new epoch where their numbers are all
    /// that is known of its time.
    WrongRate {
        /// What was declared [Hz].
        declared_hz: f64,
        /// What is true [Hz].
        hz: f64,
    },
    /// Its stamps are off, and are shifted from now on.
    Off {
        /// How far it is ahead of the session's clock [s].
        secs: f64,
    },
    /// Its stamps are right again, and are taken as they are.
    Trusted,
}

impl News {
    /// The number that belongs to it: how far off [s], how fast [ppm] or what rate [Hz]; NaN where there is none.
    pub fn value(&self) -> f64 {
        match self {
            News::Jumped { secs, .. } | News::Off { secs } => *secs,
            News::Fast { ppm } => *ppm,
            News::WrongRate { hz, .. } => *hz,
            News::Restarted { .. } | News::Wrapped | News::Trusted => f64::NAN,
        }
    }
}

impl fmt::Display for News {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            News::Restarted { epoch } => write!(f, "restarted (epoch {epoch})"),
            News::Jumped { epoch, secs } => write!(f, "jumped by {secs:+.3} s (epoch {epoch})"),
            News::Wrapped => f.write_str("counter wrapped"),
            News::Fast { ppm } if ppm.abs() >= 1000.0 => {
                write!(f, "runs {:+.2} % fast", ppm / 10_000.0)
            }
            News::Fast { ppm } => write!(f, "runs {ppm:+.0} ppm fast"),
            News::WrongRate { declared_hz, hz } => {
                write!(f, "samples come at {hz:.2} Hz, not at the declared {declared_hz:.2} Hz")
            }
            News::Off { secs } => write!(f, "is {secs:+.3} s off"),
            News::Trusted => f.write_str("is right again"),
        }
    }
}
