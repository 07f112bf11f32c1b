use std::collections::VecDeque;

use super::Frame;
use super::spectra::Spectrum;
use crate::analysis::Span;

/// The frames and spectra of a camera, in order of time.
#[derive(Debug, Default)]
pub(super) struct Store {
    frames: VecDeque<Frame>,
    spectra: VecDeque<Spectrum>,
}

impl Store {
    pub fn push(&mut self, frame: Frame) {
        self.frames.push_back(frame);
    }

    pub fn add(&mut self, spectrum: Spectrum) {
        self.spectra.push_back(spectrum);
    }

    /// The frames of a span.
    pub fn frames(&self, span: Span) -> impl Iterator<Item = &Frame> + Clone {
        let first = self.frames.partition_point(|frame| frame.at_ns < span.begin_ns);
        self.frames.iter().skip(first).take_while(move |frame| frame.at_ns < span.end_ns)
    }

    /// The spectra within a span.
    pub fn spectra(&self, span: Span) -> impl Iterator<Item = &Spectrum> + Clone {
        let first = self.spectra.partition_point(|spectrum| spectrum.first_ns < span.begin_ns);
        self.spectra.iter().skip(first).take_while(move |spectrum| spectrum.last_ns < span.end_ns)
    }

    pub fn forget(&mut self, before_ns: i64) {
        while self.frames.front().is_some_and(|frame| frame.at_ns < before_ns) {
            self.frames.pop_front();
        }
        while self.spectra.front().is_some_and(|spectrum| spectrum.first_ns < before_ns) {
            self.spectra.pop_front();
        }
    }
}
