//! The best path through the pitch candidates of frames, at a fixed delay.

use super::periodicity::{Candidate, Candidates, MOST};

/// The number of frames by which a decision is delayed.
pub(super) const DELAY: usize = 20;
/// The states of a frame: its candidates, and unvoiced.
const STATES: usize = MOST + 1;
/// The cost of a jump by an octave within 10 ms.
const JUMP_COST: f64 = 0.35;
/// The cost of a change between voiced and unvoiced.
const CHANGE_COST: f64 = 0.14;

/// A frame whose decision is pending.
#[derive(Clone, Copy)]
struct Step {
    candidates: Candidates,
    /// The state of the previous frame from which each state was reached.
    from: [u8; STATES],
}

/// Tracks the pitch: Viterbi's algorithm over candidates, with decisions delayed by [`DELAY`] frames.
pub(super) struct Path {
    steps: [Step; DELAY + 1],
    costs: [f64; STATES],
    count: usize,
}

impl Path {
    pub(super) fn new() -> Path {
        let step = Step { candidates: Candidates::default(), from: [0; STATES] };
        Path { steps: [step; DELAY + 1], costs: [0.0; STATES], count: 0 }
    }

    /// Takes in the next frame, whose unvoiced state has the strength `unvoiced`; returns whether the frame
    /// [`DELAY`] before it can be [decided](Self::decision) now.
    pub(super) fn push(&mut self, candidates: &Candidates, unvoiced: f64) -> bool {
        let before = self.steps[(self.count + DELAY) % (DELAY + 1)].candidates;
        let mut step = Step { candidates: *candidates, from: [0; STATES] };
        let mut costs = [f64::INFINITY; STATES];
        let states = candidates.as_slice().len() + 1;
        for (to, (cost, from)) in costs.iter_mut().zip(&mut step.from).take(states).enumerate() {
            let to = pitch(candidates, to);
            let (least, state) = self.cheapest(&before, to);
            (*cost, *from) = (least - to.map_or(unvoiced, |to| to.strength), state as u8);
        }
        // Costs are relative: they don't grow with time.
        let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
        self.costs = costs.map(|cost| cost - least);
        self.steps[self.count % (DELAY + 1)] = step;
        self.count += 1;
        self.count > DELAY
    }

    /// The lowest cost of reaching a state, and the state of the previous frame on that path.
    fn cheapest(&self, before: &Candidates, to: Option<&Candidate>) -> (f64, usize) {
        let cost = |state: usize| (self.costs[state] + change(pitch(before, state), to), state);
        let all = (0..=before.as_slice().len()).map(cost);
        all.fold((f64::INFINITY, 0), |best, each| if each.0 < best.0 { each } else { best })
    }

    /// The decision on the frame [`DELAY`] before the newest: the chosen candidate, if it is voiced.
    pub(super) fn decision(&self) -> Option<Candidate> {
        let best = |best: usize, state: usize| {
            if self.costs[state] < self.costs[best] { state } else { best }
        };
        let mut state = (0..STATES).fold(0, best);
        for age in 0..DELAY {
            state = usize::from(self.step(age).from[state]);
        }
        pitch(&self.step(DELAY).candidates, state).copied()
    }

    fn step(&self, age: usize) -> &Step {
        &self.steps[(self.count + DELAY - age) % (DELAY + 1)]
    }
}

/// The candidate of a state; `None` for the first state, which is unvoiced.
fn pitch(candidates: &Candidates, state: usize) -> Option<&Candidate> {
    state.checked_sub(1).map(|index| &candidates.as_slice()[index])
}

fn change(from: Option<&Candidate>, to: Option<&Candidate>) -> f64 {
    match (from, to) {
        (None, None) => 0.0,
        (Some(from), Some(to)) => JUMP_COST * (from.pitch_hz / to.pitch_hz).log2().abs(),
        _ => CHANGE_COST,
    }
}
