//! Running features: which extractor receives which stream.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::sync::Arc;

use crate::data::Data;
use crate::feature::{Emitted, Extractor, Feature, OutputId, Outputs, Scope, pushed};
use crate::panics::{Panic, caught};
use crate::phases::Phases;
use crate::sample::{Sample, Turn};
use crate::stream::{Stream, StreamId, Subject};
use crate::time::Time;

/// All running features of a session.
///
/// An extractor that panics is disabled from then on, and so is a feature that panics in `accepts`; all others go on.
pub(crate) struct Extractors {
    /// The features with their names; `None` for one that has panicked.
    features: Vec<(&'static str, Option<Arc<dyn Feature>>)>,
    at_work: Vec<AtWork>,
    /// The index of each extractor, by feature and scope.
    shared: BTreeMap<(usize, Sharing), usize>,
    /// The extractors that receive a stream, by its id.
    listeners: BTreeMap<StreamId, Vec<usize>>,
    /// The phases of all subjects, for all extractors.
    phases: Arc<Phases>,
    broken: Vec<Broken>,
}

/// A feature with the name that it has in a study.
pub type NamedFeature = (&'static str, Arc<dyn Feature>);

/// A feature that panicked and was disabled.
#[derive(Clone, Debug)]
pub struct Broken {
    /// The feature.
    pub feature: &'static str,
    /// The stream or subject for which the feature was disabled; empty for the whole session.
    pub about: String,
    /// The panic.
    pub panic: Panic,
}

impl fmt::Display for Broken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Broken { feature, about, panic } = self;
        let of = if about.is_empty() { "" } else { " of " };
        write!(f, "feature {feature}{of}{about} panicked and is disabled from now on: {panic}")
    }
}

struct AtWork {
    feature: &'static str,
    about: String,
    /// `None` once it has panicked.
    extractor: Option<Box<dyn Extractor>>,
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

/// A declaration or a sample from an extractor.
pub(crate) enum Given {
    /// An output was declared, or declared again with more details.
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
    pub(crate) fn new(features: Vec<NamedFeature>) -> Extractors {
        let features = features.into_iter().map(|(name, feature)| (name, Some(feature)));
        Extractors {
            features: features.collect(),
            at_work: Vec::new(),
            shared: BTreeMap::new(),
            listeners: BTreeMap::new(),
            phases: Arc::default(),
            broken: Vec::new(),
        }
    }

    /// Joins a declared stream to every feature that accepts it. No feature receives the stream of a second publisher
    /// of a person's topic.
    pub(crate) fn join(&mut self, id: StreamId, stream: &Stream, given: &mut VecDeque<Given>) {
        if !stream.beside.is_empty() {
            return;
        }
        Arc::make_mut(&mut self.phases).join(id, stream);
        for feature in 0..self.features.len() {
            match self.at_work_on(feature, id, stream) {
                Ok(None) => {}
                Ok(Some(index)) => {
                    let listeners = self.listeners.entry(id).or_default();
                    if !listeners.contains(&index) {
                        listeners.push(index);
                    }
                    let at_work = &mut self.at_work[index];
                    let joins = |extractor: &mut dyn Extractor, outputs: &mut Outputs| {
                        extractor.join(id, stream, outputs);
                    };
                    self.broken.extend(at_work.call(index, &self.phases, given, joins));
                }
                Err(panic) => {
                    let (name, begins) = &mut self.features[feature];
                    *begins = None;
                    self.broken.push(Broken { feature: name, about: stream.name.clone(), panic });
                }
            }
        }
    }

    /// The index of a feature's extractor for a stream, which is started if needed; `None` if the feature does not
    /// accept the stream.
    fn at_work_on(
        &mut self,
        feature: usize,
        id: StreamId,
        stream: &Stream,
    ) -> Result<Option<usize>, Panic> {
        let (name, Some(begins)) = &self.features[feature] else { return Ok(None) };
        if !caught(|| begins.accepts(stream))? {
            return Ok(None);
        }
        let (sharing, about) = match caught(|| begins.scope())? {
            Scope::Stream => (Sharing::Stream(id), stream.name.clone()),
            Scope::Subject => (Sharing::Subject(stream.subject()), stream.id.clone()),
            Scope::Session => (Sharing::Session, String::new()),
        };
        if let Some(index) = self.shared.get(&(feature, sharing.clone())) {
            return Ok(Some(*index));
        }
        let extractor = Some(caught(|| begins.start(stream))?);
        let (outputs, ids) = (Outputs::new(), Vec::new());
        self.at_work.push(AtWork { feature: name, about, extractor, outputs, ids });
        let index = self.at_work.len() - 1;
        self.shared.insert((feature, sharing), index);
        Ok(Some(index))
    }

    /// Stores the session's id for a declared output.
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

    /// Passes a sample to all extractors that receive its stream.
    pub(crate) fn push(&mut self, sample: &Sample, given: &mut VecDeque<Given>) {
        let is_taken = matches!(sample.turn, Turn::OnTime | Turn::Late);
        let is_changed = is_taken && Arc::make_mut(&mut self.phases).push(sample);
        let Some(listeners) = self.listeners.get(&sample.stream) else { return };
        for &index in listeners {
            let takes = |extractor: &mut dyn Extractor, outputs: &mut Outputs| {
                pushed(extractor, (sample, sample.turn), is_changed, outputs);
            };
            self.broken.extend(self.at_work[index].call(index, &self.phases, given, takes));
        }
    }

    /// Advances the time of all extractors.
    pub(crate) fn tick(&mut self, now: Time, given: &mut VecDeque<Given>) {
        for (index, at_work) in self.at_work.iter_mut().enumerate() {
            let ticks = |extractor: &mut dyn Extractor, outputs: &mut Outputs| {
                extractor.tick(now, outputs);
            };
            self.broken.extend(at_work.call(index, &self.phases, given, ticks));
        }
    }

    /// Notifies all extractors that nothing could be received until `until`.
    pub(crate) fn stood_still(&mut self, until: Time, given: &mut VecDeque<Given>) {
        for (index, at_work) in self.at_work.iter_mut().enumerate() {
            let waits = |extractor: &mut dyn Extractor, _: &mut Outputs| {
                extractor.stood_still(until);
            };
            self.broken.extend(at_work.call(index, &self.phases, given, waits));
        }
    }

    /// The features that have panicked since the last call.
    pub(crate) fn take_broken(&mut self) -> Vec<Broken> {
        std::mem::take(&mut self.broken)
    }

    /// Drops all features; their earlier output stays.
    pub(crate) fn leave_out_all(&mut self) {
        self.features.clear();
        self.listeners.clear();
        self.at_work.iter_mut().for_each(AtWork::leave_out);
    }
}

impl AtWork {
    /// Calls the extractor and passes on its output. After a panic both the output of this call and the extractor are
    /// dropped.
    fn call(
        &mut self,
        by: usize,
        phases: &Arc<Phases>,
        given: &mut VecDeque<Given>,
        work: impl FnOnce(&mut dyn Extractor, &mut Outputs),
    ) -> Option<Broken> {
        let extractor = self.extractor.as_deref_mut()?;
        self.outputs.phases = Some(Arc::clone(phases));
        let worked = caught(|| work(extractor, &mut self.outputs));
        self.outputs.phases = None;
        match worked {
            Ok(()) => {
                self.hand_on(by, given);
                None
            }
            Err(panic) => {
                self.leave_out();
                Some(Broken { feature: self.feature, about: self.about.clone(), panic })
            }
        }
    }

    fn leave_out(&mut self) {
        let extractor = self.extractor.take();
        // A half-updated extractor may panic again when it is dropped.
        drop(caught(|| drop(extractor)));
        self.outputs.changed.clear();
        self.outputs.emitted.clear();
    }

    fn hand_on(&mut self, by: usize, given: &mut VecDeque<Given>) {
        for id in self.outputs.changed.drain(..) {
            let stream = Box::new(self.outputs.declared[id.0].clone());
            given.push_back(Given::Declared { output: Output { by, id }, stream });
        }
        for Emitted { stream: id, measured, data } in self.outputs.emitted.drain(..) {
            given.push_back(Given::Sample { output: Output { by, id }, measured, data });
        }
    }
}
