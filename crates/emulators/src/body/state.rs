//! The state of a person.

use super::step::STEP_SECS;

/// The time constant with which a state rises to its target [s].
const RISE_SECS: f64 = 8.0;
/// The time constant with which a state falls to its target [s].
const FALL_SECS: f64 = 20.0;
/// The valence that is neither pleasant nor unpleasant.
const NEUTRAL: f64 = 0.5;

/// Workload, arousal and valence, each from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Mental workload: 0 at rest, 1 at the limit.
    pub workload: f64,
    /// Arousal: 0 calm, 1 agitated.
    pub arousal: f64,
    /// Valence: 0 unpleasant, 0.5 neutral, 1 pleasant.
    pub valence: f64,
}

impl Default for State {
    /// Returns the state at rest.
    fn default() -> State {
        State { workload: 0.0, arousal: 0.0, valence: NEUTRAL }
    }
}

/// A state that approaches a target as a first-order system, with 8 s upwards and 20 s downwards.
#[derive(Clone, Debug, Default)]
pub struct Transition {
    now: State,
    target: State,
}

impl Transition {
    /// The present state.
    pub fn now(&self) -> State {
        self.now
    }

    /// Sets another target; parts that are NaN keep the present one.
    pub fn aim_at(&mut self, target: State) {
        let State { workload, arousal, valence } = self.target;
        let usable =
            |value: f64, old: f64| if value.is_nan() { old } else { value.clamp(0.0, 1.0) };
        self.target = State {
            workload: usable(target.workload, workload),
            arousal: usable(target.arousal, arousal),
            valence: usable(target.valence, valence),
        };
    }

    /// Advances by one step.
    pub fn advance(&mut self) {
        let State { workload, arousal, valence } = self.target;
        self.now = State {
            workload: nearer(self.now.workload, workload),
            arousal: nearer(self.now.arousal, arousal),
            valence: nearer(self.now.valence, valence),
        };
    }
}

fn nearer(now: f64, target: f64) -> f64 {
    let lag_secs = if target > now { RISE_SECS } else { FALL_SECS };
    now + (target - now) * (1.0 - (-STEP_SECS / lag_secs).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(transition: &mut Transition, secs: u32) -> f64 {
        (0..64 * secs).for_each(|_| transition.advance());
        transition.now().workload
    }

    #[test]
    fn a_state_rises_in_eight_seconds_and_falls_in_twenty() {
        let mut transition = Transition::default();
        transition.aim_at(State { workload: 1.0, ..State::default() });
        assert!((after(&mut transition, 8) - 0.632).abs() < 1e-3);
        let high = after(&mut transition, 120);
        transition.aim_at(State { workload: f64::NAN, ..State::default() });
        assert!(after(&mut transition, 1) >= high);
        transition.aim_at(State { workload: -7.0, ..State::default() });
        assert!((after(&mut transition, 20) - 0.368).abs() < 1e-3);
    }
}
