//! The streams of a session, shared by its components.

use std::collections::HashMap;
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard};

use crate::stream::{Shape, Stream, StreamId};

/// The streams of a session. Ids are given in the order of declaration and never reused, so a robot that comes back
/// keeps its streams.
#[derive(Clone, Debug, Default)]
pub struct Streams(Arc<RwLock<Known>>);

/// The streams declared so far.
#[derive(Debug, Default)]
struct Known {
    streams: Vec<Arc<Stream>>,
    /// The indices of the streams with each name.
    named: HashMap<String, Vec<usize>>,
}

impl Streams {
    /// Declares a stream. A stream with the same name, origin and type as a known one keeps its id, and the new
    /// declaration replaces the old one; another type on the same topic is another stream.
    ///
    /// The stream's texts are [cut and cleaned](Stream::cleaned).
    pub fn declare(&self, stream: Stream) -> Declared {
        let stream = stream.cleaned();
        let mut declared = self.0.write().unwrap_or_else(PoisonError::into_inner);
        let Known { streams, named } = &mut *declared;
        let mut of_name = named.get(&stream.name).into_iter().flatten();
        let known = of_name.find(|index| is_same(&streams[**index], &stream)).copied();
        let index = known.unwrap_or(streams.len());
        let is_new = known.is_none_or(|index| is_described_anew(&streams[index], &stream));
        if known.is_none() {
            named.entry(stream.name.clone()).or_default().push(index);
            streams.push(Arc::new(stream));
        } else if *streams[index] != stream {
            streams[index] = Arc::new(stream);
        }
        let id = u32::try_from(index).expect("a session has fewer than four billion streams");
        Declared { id: StreamId(id), is_new }
    }

    /// The stream with this id, which must have been issued by this session.
    pub fn get(&self, id: StreamId) -> Arc<Stream> {
        Arc::clone(&self.known().streams[id.0 as usize])
    }

    /// The first declared stream with this name.
    pub fn find(&self, name: &str) -> Option<(StreamId, Arc<Stream>)> {
        let known = self.known();
        let index = *known.named.get(name)?.first()?;
        Some((StreamId(index as u32), Arc::clone(&known.streams[index])))
    }

    /// The streams with this name, in the order in which they were declared.
    pub(crate) fn named(&self, name: &str) -> Vec<StreamId> {
        let known = self.known();
        let places = known.named.get(name).into_iter().flatten();
        places.map(|index| StreamId(*index as u32)).collect()
    }

    /// The streams that were declared after the first `count`.
    pub fn after(&self, count: usize) -> Vec<(StreamId, Arc<Stream>)> {
        let known = self.known();
        let numbered = known.streams.iter().enumerate().skip(count);
        numbered.map(|(k, each)| (StreamId(k as u32), Arc::clone(each))).collect()
    }

    /// All streams, in the order in which they were declared.
    pub fn all(&self) -> Vec<(StreamId, Arc<Stream>)> {
        self.after(0)
    }

    fn known(&self) -> RwLockReadGuard<'_, Known> {
        self.0.read().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The result of a declaration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Declared {
    /// The stream's id.
    pub id: StreamId,
    /// Whether the stream is new, or has changed.
    pub is_new: bool,
}

/// Whether a changed stream must be described again. Changes of its publisher or its quality of service do not count: a
/// replay knows these from the start, and must have the same descriptions.
fn is_described_anew(known: &Stream, stream: &Stream) -> bool {
    let (qos, publisher) = (known.qos.clone(), known.publisher.clone());
    known != stream && *known != Stream { publisher, qos, ..stream.clone() }
}

fn is_same(known: &Stream, stream: &Stream) -> bool {
    let same_shape = match (&known.shape, &stream.shape) {
        (Shape::Message(known), Shape::Message(new)) => known.name == new.name,
        (known, new) => known == new,
    };
    known.name == stream.name && known.origin == stream.origin && same_shape
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::qos::Qos;
    use crate::stream::{Schema, Subject};

    fn message(name: &str, ty: &str, text: &str) -> Stream {
        let schema = Schema {
            name: ty.into(),
            encoding: "ros2msg".into(),
            text: text.into(),
            hash: String::new(),
        };
        Stream::raw(name, Subject::robot("r1"), Shape::Message(Arc::new(schema)))
    }

    #[test]
    fn a_stream_that_comes_back_is_the_same_and_may_know_more() {
        let streams = Streams::default();
        let first = streams.declare(message("/r1/x", "a/msg/X", "")).id;
        let again = streams.declare(message("/r1/x", "a/msg/X", "uint8 x"));
        assert_eq!(again, Declared { id: first, is_new: true });
        assert!(!streams.declare(message("/r1/x", "a/msg/X", "uint8 x")).is_new);
        assert_eq!(streams.get(first).shape, message("", "a/msg/X", "uint8 x").shape);
    }

    #[test]
    fn quality_of_service_is_kept_and_is_no_change() {
        let streams = Streams::default();
        let first = message("/r1/x", "a/msg/X", "");
        let id = streams.declare(first.clone()).id;
        let offered = Stream { qos: vec![Qos::reliable(1)], publisher: "r1".into(), ..first };
        assert_eq!(streams.declare(offered.clone()), Declared { id, is_new: false });
        assert_eq!(*streams.get(id), offered);
    }

    #[test]
    fn two_types_on_one_topic_are_two_streams() {
        let streams = Streams::default();
        let first = streams.declare(message("/r1/x", "a/msg/X", "")).id;
        assert_ne!(first, streams.declare(message("/r1/x", "a/msg/Y", "")).id);
    }
}
