use std::collections::VecDeque;

use super::frame::Frame;
use super::framer::FRAMES_HZ;
use crate::analysis::Span;

/// The frames of a voice, in order of time.
#[derive(Debug, Default)]
pub(super) struct Store {
    frames: VecDeque<Frame>,
}

impl Store {
    pub(super) fn push(&mut self, frame: Frame) {
        self.frames.push_back(frame);
    }

    /// The known frames of a span.
    pub(super) fn known(&self, span: Span) -> impl Iterator<Item = &Frame> + Clone {
        let first = self.frames.partition_point(|frame| frame.at_ns < span.begin_ns);
        let frames = self.frames.iter().skip(first);
        frames.take_while(move |frame| frame.at_ns < span.end_ns).filter(|frame| frame.is_known())
    }

    /// The share of a span that is known [0..1].
    pub(super) fn coverage(&self, span: Span) -> f64 {
        let expected = (span.secs() * FRAMES_HZ).round().max(1.0);
        (self.known(span).count() as f64 / expected).min(1.0)
    }

    pub(super) fn forget(&mut self, before_ns: i64) {
        while self.frames.front().is_some_and(|frame| frame.at_ns < before_ns) {
            self.frames.pop_front();
        }
    }
}
