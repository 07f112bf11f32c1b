//! The best path through the candidates of frames, at a fixed delay.

use super::periodicity::{Candidate, Candidates, MOST};

/// How many frames a decision waits.
pub(super) const DELAY: usize = 20;
/// The states of a frame: its candidates, and that it is not voiced.
const STATES: usize = MOST + 1;
/// What an octave's jump in 10 ms costs.
const JUMP_COST: f64 = 0.35;
/// What a change between voiced and not costs.
const CHANGE_COST: f64 = 0.14;

/// A frame that waits for its decision.
#[derive(Clone, Copy)]
struct Step {
    candidates: Candidates,
    /// From which state of the frame before each state came.
    from: [u8; STATES],
}

/// Follows the pitch: Viterbi's algorithm over candidates, whose decisions wait [`DELAY`] frames.
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

    /// Takes in the next frame, in which not being voiced has a strength of `unvoiced`; whether the frame [`DELAY`]
    /// before it can be [decided](Self::decision) now.
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

    /// The least cost of coming to a state, and the state of the frame before from which that is.
    fn cheapest(&self, before: &Candidates, to: Option<&Candidate>) -> (f64, usize) {
        let cost = |state: usize| (self.costs[state] + change(pitch(before, state), to), state);
        let all = (0..=before.as_slice().len()).map(cost);
        all.fold((f64::INFINITY, 0), |best, each| if each.0 < best.0 { each } else { best })
    }

    /// The decision on the frame [`DELAY`] before the newest: the candidate taken, if it is voiced.
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

/// The candidate of a state; `None` for that of not being voiced, the first.
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
