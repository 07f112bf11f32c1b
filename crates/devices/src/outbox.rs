use std::collections::VecDeque;

use crate::{Error, Event, Output, Reading, Stream};

/// The output of a session to its caller, in order.
#[derive(Debug)]
pub(crate) struct Outbox<R> {
    queue: VecDeque<Output<R>>,
    done: bool,
}

impl<R> Default for Outbox<R> {
    fn default() -> Self {
        Self { queue: VecDeque::new(), done: false }
    }
}

impl<R> Outbox<R> {
    pub fn request(&mut self, request: R) {
        self.push(Output::Request(request));
    }

    pub fn stream(&mut self, stream: Stream) {
        self.push(Output::Stream(stream));
    }

    pub fn reading(&mut self, reading: Reading) {
        self.push(Output::Reading(reading));
    }

    pub fn event(&mut self, event: Event) {
        self.push(Output::Event(event));
    }

    pub fn discarded(&mut self, source: &'static str, bytes: usize) {
        self.event(Event::Discarded { source, bytes });
    }

    pub fn done(&mut self, result: Result<(), Error>) {
        self.push(Output::Done(result));
        self.done = true;
    }

    pub fn is_done(&self) -> bool {
        self.done
    }

    /// Starts a new connection: requests of the previous one are discarded.
    pub fn reopen(&mut self) {
        self.queue.retain(|output| !matches!(output, Output::Request(_) | Output::Done(_)));
        self.done = false;
    }

    pub fn next(&mut self) -> Option<Output<R>> {
        self.queue.pop_front()
    }

    fn push(&mut self, output: Output<R>) {
        if !self.done {
            self.queue.push_back(output);
        }
    }
}
