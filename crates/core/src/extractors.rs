//! Features at work: which extractor hears which stream.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use crate::data::Data;
use crate::feature::{Emitted, Extractor, Feature, OutputId, Outputs, Scope};
use crate::sample::{Sample, Turn};
use crate::stream::{Stream, StreamId, Subject};
use crate::time::Time;

/// All features of a session at work.
pub(crate) struct Extractors {
    features: Vec<Arc<dyn Feature>>,
    at_work: Vec<AtWork>,
    /// By feature and what shares an extractor.
    shared: BTreeMap<(usize, Sharing), usize>,
    /// Who listens to a stream, by its id.
    listeners: BTreeMap<StreamId, Vec<usize>>,
}

struct AtWork {
    extractor: Box<dyn Extractor>,
    outputs: Outputs,
    /// The ids of its outputs, in the order of their declaration.
    ids: Vec<StreamId>,
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Sharing {
    Stream(StreamId),
    Subject(Subject),
    Session,
}

/// What extractors gave, in order.
pub(crate) enum Given {
    /// An output was declared or is better known.
    Declared { output: Output, stream: Box<Stream> },
    /// A sample of an output that was declared before.
    Sample { output: Output, measured: Time, data: Data },
}

/// An output of one extractor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Output {
    by: usize,
    id: OutputId,
}

impl Extractors {
    pub(crate) fn new(features: Vec<Arc<dyn Feature>>) -> Extractors {
        let (shared, listeners) = (BTreeMap::new(), BTreeMap::new());
        Extractors { features, at_work: Vec::new(), shared, listeners }
    }

    /// A stream was declared: every feature that accepts it joins.
    pub(crate) fn join(&mut self, id: StreamId, stream: &Stream, given: &mut VecDeque<Given>) {
        for feature in 0..self.features.len() {
            if !self.features[feature].accepts(stream) {
                continue;
            }
            let index = self.at_work_on(feature, id, stream);
            let listeners = self.listeners.entry(id).or_default();
            if !listeners.contains(&index) {
                listeners.push(index);
            }
            let at_work = &mut self.at_work[index];
            at_work.extractor.join(id, stream, &mut at_work.outputs);
            at_work.hand_on(index, given);
        }
    }

    /// The extractor of a feature for a stream, begun if there is none yet.
    fn at_work_on(&mut self, feature: usize, id: StreamId, stream: &Stream) -> usize {
        let sharing = match self.features[feature].scope() {
            Scope::Stream => Sharing::Stream(id),
            Scope::Subject => Sharing::Subject(stream.subject()),
            Scope::Session => Sharing::Session,
        };
        *self.shared.entry((feature, sharing)).or_insert_with(|| {
            let extractor = self.features[feature].start(stream);
            self.at_work.push(AtWork { extractor, outputs: Outputs::new(), ids: Vec::new() });
            self.at_work.len() - 1
        })
    }

    /// An output that was declared has this id in the session.
    pub(crate) fn name(&mut self, output: Output, id: StreamId) {
        let ids = &mut self.at_work[output.by].ids;
        match ids.get_mut(output.id.0) {
            Some(known) => *known = id,
            None => ids.push(id),
        }
    }

    /// The id of an output in the session.
    pub(crate) fn id(&self, output: Output) -> StreamId {
        self.at_work[output.by].ids[output.id.0]
    }

    /// A sample was taken: all who listen to its stream get it.
    pub(crate) fn push(&mut self, sample: &Sample, given: &mut VecDeque<Given>) {
        let Some(listeners) = self.listeners.get(&sample.stream) else { return };
        for &index in listeners {
            let at_work = &mut self.at_work[index];
            match sample.turn {
                Turn::OnTime => at_work.extractor.push(sample, &mut at_work.outputs),
                Turn::Late => at_work.extractor.push_late(sample, &mut at_work.outputs),
                Turn::Duplicate => {}
            }
            at_work.hand_on(index, given);
        }
    }

    /// Time passes for all.
    pub(crate) fn tick(&mut self, now: Time, given: &mut VecDeque<Given>) {
        for (index, at_work) in self.at_work.iter_mut().enumerate() {
            at_work.extractor.tick(now, &mut at_work.outputs);
            at_work.hand_on(index, given);
        }
    }
}

impl AtWork {
    fn hand_on(&mut self, by: usize, given: &mut VecDeque<Given>) {
        for id in self.outputs.news.drain(..) {
            let stream = Box::new(self.outputs.declared[id.0].clone());
            given.push_back(Given::Declared { output: Output { by, id }, stream });
        }
        for Emitted { stream: id, measured, data } in self.outputs.emitted.drain(..) {
            given.push_back(Given::Sample { output: Output { by, id }, measured, data });
        }
    }
}
