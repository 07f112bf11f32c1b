//! The steps in which a body is simulated.

/// The number of steps per second: a power of two, so that their times are exact.
pub const STEPS_HZ: f64 = 64.0;
/// The duration of a step [s].
pub const STEP_SECS: f64 = 1.0 / STEPS_HZ;

/// One step: slow quantities stay constant during it, and events in it have their exact time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// When the step begins, after the start [s].
    pub from_secs: f64,
    /// When the next step begins [s].
    pub to_secs: f64,
}

impl Step {
    /// Returns the step with this number, from 0.
    pub fn nth(number: u64) -> Step {
        let at = |number: u64| number as f64 * STEP_SECS;
        Step { from_secs: at(number), to_secs: at(number + 1) }
    }

    /// Returns the number of steps that end at or before a time.
    pub fn whole_until(secs: f64) -> u64 {
        (secs * STEPS_HZ).floor() as u64
    }
}
