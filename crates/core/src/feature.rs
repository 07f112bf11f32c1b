//! Features: pure functions from streams to streams.

use std::sync::Arc;

use crate::data::Data;
use crate::phases::Phases;
use crate::sample::{Sample, Turn};
use crate::stream::{Stream, StreamId};
use crate::time::Time;
use crate::units::spelt;

/// A family of features as a study configures it: which streams it accepts, and how its extractors
/// start.
///
/// Configuration is separate from state: one `Feature` starts an [`Extractor`] for each stream (or
/// each subject) that it accepts.
pub trait Feature: Send + Sync {
    /// Whether the feature runs on this stream. A feature that uses phases also accepts [their streams](Phases::hears).
    fn accepts(&self, stream: &Stream) -> bool;

    /// Which streams share an extractor; by default each stream has its own.
    fn scope(&self) -> Scope {
        Scope::Stream
    }

    /// Starts an extractor on the first accepted stream of its scope.
    fn start(&self, stream: &Stream) -> Box<dyn Extractor>;
}

/// Which streams share an extractor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// Each stream has its own extractor.
    Stream,
    /// All accepted streams about one subject share an extractor.
    Subject,
    /// All accepted streams of the session share an extractor.
    Session,
}

/// A running feature: a pure state machine that receives the time as ticks of 100 ms.
///
/// No I/O, no clock, no blocking. The same input gives the same output, bit for bit.
pub trait Extractor: Send {
    /// Called when a stream joins, before its first sample, and when it is declared again with more details. Declare
    /// outputs here.
    fn join(&mut self, id: StreamId, stream: &Stream, out: &mut Outputs);

    /// Called before a sample that changes the phases is pushed: [`Outputs::phases`] already includes the change.
    fn phases_changed(&mut self, _by: &Sample, _out: &mut Outputs) {}

    /// Takes in a sample that arrived in order.
    fn push(&mut self, sample: &Sample, out: &mut Outputs);

    /// Takes in a sample that arrived late; `measured` is its true time.
    fn push_late(&mut self, _sample: &Sample, _out: &mut Outputs) {}

    /// Advances the time. Called every 100 ms of session time, after all earlier samples.
    fn tick(&mut self, _now: Time, _out: &mut Outputs) {}

    /// Called after teampulse itself was suspended: silence until this time, which is still to come, means nothing.
    fn stood_still(&mut self, _until: Time) {}
}

/// The outputs of an extractor, and the phases that are available to it.
#[derive(Debug, Default)]
pub struct Outputs {
    /// `Some` only during a call.
    pub(crate) phases: Option<Arc<Phases>>,
    pub(crate) declared: Vec<Stream>,
    /// Which declarations are new or changed.
    pub(crate) changed: Vec<OutputId>,
    pub(crate) emitted: Vec<Emitted>,
}

/// A derived sample that has no number yet.
#[derive(Debug)]
pub(crate) struct Emitted {
    pub(crate) stream: OutputId,
    pub(crate) measured: Time,
    pub(crate) data: Data,
}

/// Identifies an output of an extractor, numbered in the order of declaration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutputId(pub(crate) usize);

impl Outputs {
    /// An empty set, for tests of an extractor.
    pub fn new() -> Outputs {
        Outputs::default()
    }

    /// The phases of all subjects, as published so far.
    pub fn phases(&self) -> Arc<Phases> {
        self.phases.clone().unwrap_or_default()
    }

    /// Declares an output stream of this extractor; a repeated name keeps its id and replaces the declaration. Its
    /// units are converted to their machine-readable spelling.
    pub fn declare(&mut self, mut stream: Stream) -> OutputId {
        stream.channels.iter_mut().for_each(|channel| channel.unit = spelt(&channel.unit));
        let known = self.declared.iter().position(|known| known.name == stream.name);
        let id = OutputId(known.unwrap_or(self.declared.len()));
        match known {
            Some(index) if self.declared[index] == stream => return id,
            Some(index) => self.declared[index] = stream,
            None => self.declared.push(stream),
        }
        self.changed.push(id);
        id
    }

    /// Emits a sample of a declared output, measured at `measured`.
    pub fn emit(&mut self, stream: OutputId, measured: Time, data: Data) {
        self.emitted.push(Emitted { stream, measured, data });
    }

    /// The samples emitted so far, in order; for tests.
    pub fn samples(&self) -> impl Iterator<Item = (OutputId, Time, &Data)> {
        self.emitted.iter().map(|each| (each.stream, each.measured, &each.data))
    }

    /// The streams that were declared so far, in order; for tests.
    pub fn streams(&self) -> &[Stream] {
        &self.declared
    }
}

/// An extractor that runs outside a session, with the phases from the streams that join it.
pub struct StandaloneExtractor {
    extractor: Box<dyn Extractor>,
    phases: Arc<Phases>,
}

impl StandaloneExtractor {
    /// Wraps an extractor.
    pub fn new(extractor: Box<dyn Extractor>) -> StandaloneExtractor {
        StandaloneExtractor { extractor, phases: Arc::default() }
    }

    fn call(&mut self, out: &mut Outputs, work: impl FnOnce(&mut dyn Extractor, &mut Outputs)) {
        out.phases = Some(Arc::clone(&self.phases));
        work(&mut *self.extractor, out);
        out.phases = None;
    }

    fn take(&mut self, sample: &Sample, out: &mut Outputs, turn: Turn) {
        let is_changed = Arc::make_mut(&mut self.phases).push(sample);
        self.call(out, |extractor, out| pushed(extractor, (sample, turn), is_changed, out));
    }
}

impl Extractor for StandaloneExtractor {
    fn join(&mut self, id: StreamId, stream: &Stream, out: &mut Outputs) {
        Arc::make_mut(&mut self.phases).join(id, stream);
        self.call(out, |extractor, out| extractor.join(id, stream, out));
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        self.take(sample, out, Turn::OnTime);
    }

    fn push_late(&mut self, sample: &Sample, out: &mut Outputs) {
        self.take(sample, out, Turn::Late);
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        self.call(out, |extractor, out| extractor.tick(now, out));
    }

    fn stood_still(&mut self, until: Time) {
        self.extractor.stood_still(until);
    }
}

/// Passes a sample to an extractor, after a notice if the sample changed the phases.
pub(crate) fn pushed(
    extractor: &mut dyn Extractor,
    (sample, turn): (&Sample, Turn),
    phases_changed: bool,
    out: &mut Outputs,
) {
    if phases_changed {
        extractor.phases_changed(sample, out);
    }
    match turn {
        Turn::OnTime => extractor.push(sample, out),
        Turn::Late => extractor.push_late(sample, out),
        Turn::Duplicate | Turn::Excess => {}
    }
}
