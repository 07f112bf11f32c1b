//! A person who performs a task.

use super::course::Task;
use super::happening::{Happening, What};
use crate::body::{Body, Record};

/// How strongly the skin responds to a command and to the start of a phase, as a multiple of the usual response.
const COMMAND_STARTLE: f64 = 1.0;
const PHASE_STARTLE: f64 = 1.5;

/// A body that performs a task: the demand of the task becomes the body's state, and each press a contraction.
#[derive(Clone, Debug)]
pub struct Operator {
    body: Body,
    task: Task,
    happened: Vec<Happening>,
}

/// The actions of a person since the previous call, and the recording of that time.
#[derive(Clone, Copy, Debug)]
pub struct OperatorOutput<'a> {
    /// What happened, in order of time.
    pub happened: &'a [Happening],
    /// The recording of the body.
    pub record: &'a Record,
}

impl Operator {
    /// Creates a body at the start of its task.
    pub fn new(body: Body, task: Task) -> Operator {
        Operator { body, task, happened: Vec::new() }
    }

    /// The simulated time so far [s].
    pub fn secs(&self) -> f64 {
        self.body.secs()
    }

    /// Simulates up to a time [s], at most an hour per call, and returns what happened since the previous call. The
    /// result does not depend on how the time is divided, as with [`Body::until`].
    pub fn until(&mut self, secs: f64) -> OperatorOutput<'_> {
        self.happened.clear();
        self.body.turn_over();
        let until_secs = self.body.most_until(secs);
        while let Some(happening) = self.task.next_until(until_secs) {
            self.body.live(happening.at_secs);
            self.undergo(happening);
            self.happened.push(happening);
        }
        self.body.live(until_secs);
        OperatorOutput { happened: &self.happened, record: self.body.record() }
    }

    fn undergo(&mut self, Happening { at_secs, what }: Happening) {
        let body = &mut self.body;
        match what {
            What::Begins { .. } => body.startle(at_secs, PHASE_STARTLE),
            What::Demands { workload, arousal, valence, .. } => {
                body.state(workload, arousal, valence);
            }
            What::Command { .. } => body.startle(at_secs, COMMAND_STARTLE),
            What::Reaches { press_secs } => body.press(press_secs),
            What::Ends { .. }
            | What::Stimulus { .. }
            | What::Press { .. }
            | What::Report { .. } => {}
        }
    }
}
