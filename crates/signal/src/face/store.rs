use std::collections::VecDeque;

use super::Frame;
use super::blinks::Closure;
use crate::analysis::Span;

/// The number of recent blinks from which the opening of closed eyes is estimated.
const LAST_BLINKS: usize = 20;
/// The opening of closed eyes before the first blink, and its upper limit, relative to open eyes.
const CLOSED: f64 = 0.3;
const MOST_CLOSED: f64 = 0.5;

/// The frames of a face and the times in which its eyes were closed, in order of time.
#[derive(Debug, Default)]
pub(super) struct Store {
    /// Frames, each with the opening at which four fifths of the eye are covered.
    frames: VecDeque<(Frame, f64)>,
    closures: VecDeque<Closure>,
    last_depths: VecDeque<f64>,
}

impl Store {
    pub fn push(&mut self, frame: Frame) {
        let closed = self.closed();
        self.frames.push_back((frame, closed + 0.2 * (1.0 - closed)));
    }

    pub fn add(&mut self, closure: Closure) {
        self.closures.push_back(closure);
        self.last_depths.push_back(closure.depth);
        if self.last_depths.len() > LAST_BLINKS {
            self.last_depths.pop_front();
        }
    }

    /// The opening of closed eyes: the lid landmarks are then still apart.
    fn closed(&self) -> f64 {
        let mut depths: Vec<f64> = self.last_depths.iter().copied().collect();
        if depths.is_empty() {
            return CLOSED;
        }
        let middle = depths.len() / 2;
        let depth = *depths.select_nth_unstable_by(middle, f64::total_cmp).1;
        (1.0 - depth).clamp(0.0, MOST_CLOSED)
    }

    pub fn frames(&self, span: Span) -> impl Iterator<Item = &(Frame, f64)> + Clone {
        let first = self.frames.partition_point(|(frame, _)| frame.at_ns < span.begin_ns);
        self.frames.iter().skip(first).take_while(move |(frame, _)| frame.at_ns < span.end_ns)
    }

    pub fn closures(&self, span: Span) -> impl Iterator<Item = &Closure> + Clone {
        let is_within =
            move |closure: &&Closure| (span.begin_ns..span.end_ns).contains(&closure.at_ns);
        self.closures.iter().filter(is_within)
    }

    pub fn forget(&mut self, before_ns: i64) {
        while self.frames.front().is_some_and(|(frame, _)| frame.at_ns < before_ns) {
            self.frames.pop_front();
        }
        while self.closures.front().is_some_and(|closure| closure.at_ns < before_ns) {
            self.closures.pop_front();
        }
    }
}
