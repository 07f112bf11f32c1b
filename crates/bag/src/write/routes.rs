//! The routes of streams: the topic in the bag, and the channel in the current file.

use std::collections::HashMap;
use std::fs::File;
use std::sync::Arc;

use teampulse_core::sample::Record;
use teampulse_core::stream::{Origin, Stream, StreamId};
use teampulse_messages::convert::schema_of;

use crate::channel::Channel;
use crate::error::BagError;
use crate::metadata::{Topic, Version, qos};
use crate::write::part::Part;

/// The routes of all streams.
pub(super) struct Routes {
    version: Version,
    /// The route of each stream of the session into the current file.
    slots: Vec<Option<Slot>>,
    topics: Vec<(Topic, Origin)>,
    /// The indices of the topics with each name.
    named: HashMap<String, Vec<usize>>,
}

/// The route of one stream, as declared when its channel was opened.
struct Slot {
    stream: Arc<Stream>,
    route: Route,
}

/// A channel of the current file and its topic in the bag.
#[derive(Clone, Copy, Debug)]
pub(super) struct Route {
    pub channel: u16,
    topic: usize,
}

impl Routes {
    pub(super) fn new(version: Version) -> Routes {
        Routes { version, slots: Vec::new(), topics: Vec::new(), named: HashMap::new() }
    }

    /// The route of a record; `None` if its stream is new in this file, or was declared again.
    pub(super) fn find(&self, record: &Record) -> Option<Route> {
        let slot = self.slots.get(record.sample.stream.0 as usize)?.as_ref()?;
        Arc::ptr_eq(&slot.stream, &record.stream).then_some(slot.route)
    }

    /// Opens a channel for a record's stream; an identical declaration keeps the channel.
    pub(super) fn register(
        &mut self,
        record: &Record,
        part: &mut Part<File>,
    ) -> Result<Route, BagError> {
        let stream = Arc::clone(&record.stream);
        let schema = schema_of(&stream.shape);
        let topic = self.topic(&stream, &schema.name);
        let known = &mut self.topics[topic].0;
        if known.type_hash.is_empty() {
            schema.hash.clone_into(&mut known.type_hash);
        }
        let profiles = qos::write(&known.qos, self.version);
        let channel = part.channel(&Channel::of(&stream, &schema, profiles))?;
        let route = Route { channel, topic };
        *self.slot(record.sample.stream) = Some(Slot { stream, route });
        Ok(route)
    }

    /// Counts a message.
    pub(super) fn count(&mut self, route: Route) {
        self.topics[route.topic].0.messages += 1;
    }

    /// Clears the routes into the previous file.
    pub(super) fn begin_file(&mut self) {
        self.slots.clear();
    }

    /// The topics so far, with their message counts.
    pub(super) fn topics(&self) -> Vec<Topic> {
        self.topics.iter().map(|(topic, _)| topic.clone()).collect()
    }

    fn slot(&mut self, StreamId(index): StreamId) -> &mut Option<Slot> {
        let index = index as usize;
        if self.slots.len() <= index {
            self.slots.resize_with(index + 1, || None);
        }
        &mut self.slots[index]
    }

    /// The index of a stream's topic. The topic keeps its first quality of service, by which readers distinguish
    /// channels of one topic.
    fn topic(&mut self, stream: &Stream, type_name: &str) -> usize {
        let named = self.named.entry(stream.name.clone()).or_default();
        let is_known = |place: &&usize| {
            let (topic, origin) = &self.topics[**place];
            topic.type_name == type_name && *origin == stream.origin
        };
        named.iter().find(is_known).copied().unwrap_or_else(|| {
            let topic = Topic {
                name: stream.name.clone(),
                type_name: type_name.to_owned(),
                type_hash: String::new(),
                qos: stream.qos.clone(),
                messages: 0,
            };
            named.push(self.topics.len());
            self.topics.push((topic, stream.origin));
            self.topics.len() - 1
        })
    }
}
