//! The sink: publishes the session's streams on ROS.

use std::collections::btree_map::{BTreeMap, Entry};
use std::sync::Arc;
use std::time::Duration;

use teampulse_core::clock;
use teampulse_core::counted::counted;
use teampulse_core::fault::FAULTS;
use teampulse_core::pattern::Pattern;
use teampulse_core::qos::Qos;
use teampulse_core::sample::Record;
use teampulse_core::sink::{Batch, Delivery, Inbox, Received, Sink, SinkError, Wants};
use teampulse_core::stream::{About, Origin, Shape, Stream, StreamId};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_messages::catalogue;
use teampulse_messages::convert::schema_of;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::rosgraph_msgs::Clock;

use crate::bus::{Bus, BusError, Publisher};
use crate::privacy::PrivacyFilter;

/// The longest wait for samples at a time, as streams may be declared while there are none.
const PATIENCE: Duration = Duration::from_millis(200);

/// Which streams are published.
#[derive(Clone, Debug)]
pub enum Publish {
    /// All streams except those about people.
    Everything,
    /// Raw streams, from outside or simulated, unless they are about people; without the session's own events.
    Raw,
    /// Derived streams, unless they are about people, and streams that are named as in [`Publish::Named`].
    Conclusions(Vec<Pattern>),
    /// Streams whose name matches one of these [`Pattern`]s. For a stream about a person, the first token of the
    /// pattern must not contain a star: `/humans/persons/p001/*/hrv`.
    Named(Vec<Pattern>),
}

/// Publishes streams on their topics, in the form in which they are recorded.
pub struct RosSink {
    bus: Arc<dyn Bus>,
    publish: Publish,
    delivery: Delivery,
    clock: bool,
    stamps: Option<clock::Clock>,
}

impl RosSink {
    /// Creates a sink that skips samples when it cannot keep up: for monitoring.
    pub fn fresh(bus: Arc<dyn Bus>, publish: Publish) -> RosSink {
        RosSink { bus, publish, delivery: Delivery::Fresh, clock: false, stamps: None }
    }

    /// Creates a sink that publishes every sample: for simulated robots, and for playing recordings.
    pub fn lossless(bus: Arc<dyn Bus>, publish: Publish) -> RosSink {
        RosSink { bus, publish, delivery: Delivery::Lossless, clock: false, stamps: None }
    }

    /// Also publishes the session's time on `/clock` before each run of samples.
    #[must_use]
    pub fn with_clock(mut self) -> RosSink {
        self.clock = true;
        self
    }

    /// Stamps messages by this clock instead of the machine's.
    #[must_use]
    pub fn stamped_by(mut self, clock: clock::Clock) -> RosSink {
        self.stamps = Some(clock);
        self
    }
}

impl Sink for RosSink {
    fn name(&self) -> &'static str {
        "ros"
    }

    fn delivery(&self) -> Delivery {
        self.delivery
    }

    fn wants(&self) -> Wants {
        let publish = self.publish.clone();
        Wants::Only(Box::new(move |stream| publish.includes(stream)))
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let mut publishers = Publishers::new(&self)?;
        loop {
            let received = inbox.receive(PATIENCE);
            publishers.open_declared(inbox.streams())?;
            match received {
                Received::Batch(batch) => publishers.publish(&batch)?,
                Received::Silence => {}
                Received::Closed => break,
            }
        }
        publishers.finish(self.delivery)
    }
}

/// The publishers of a running sink.
struct Publishers<'a> {
    bus: &'a dyn Bus,
    publish: &'a Publish,
    stamps: Option<&'a clock::Clock>,
    clock: Option<Box<dyn Publisher>>,
    /// The publisher of each stream; `None` for a stream that is not published.
    by_stream: BTreeMap<StreamId, Option<Box<dyn Publisher>>>,
    /// The number of streams processed.
    seen: usize,
    privacy: PrivacyFilter,
    refused: BTreeMap<String, u64>,
}

impl<'a> Publishers<'a> {
    fn new(sink: &'a RosSink) -> Result<Publishers<'a>, BusError> {
        let clock = || {
            let schema = catalogue::shipped(Clock::NAME).expect("the clock's type is shipped");
            sink.bus.publish("/clock", &schema, &Qos::reliable(10))
        };
        Ok(Publishers {
            bus: &*sink.bus,
            publish: &sink.publish,
            stamps: sink.stamps.as_ref(),
            clock: sink.clock.then(clock).transpose()?,
            by_stream: BTreeMap::new(),
            seen: 0,
            privacy: PrivacyFilter::new(sink.publish.clone()),
            refused: BTreeMap::new(),
        })
    }

    /// Creates the publishers of newly declared streams, so that subscribers of infrequent topics are
    /// matched before the first message.
    fn open_declared(&mut self, streams: &Streams) -> Result<(), BusError> {
        self.privacy.learn(streams);
        for (id, stream) in streams.after(self.seen) {
            self.seen += 1;
            if is_known(&stream.shape) && !self.by_stream.contains_key(&id) {
                self.by_stream.insert(id, open(self.bus, self.publish, &stream)?);
            }
        }
        Ok(())
    }

    fn publish(&mut self, batch: &Batch) -> Result<(), BusError> {
        if let Some(first) = batch.first() {
            self.publish_time(first.sample.log_time);
        }
        batch.iter().try_for_each(|record| self.publish_record(record))
    }

    fn publish_time(&mut self, now: Time) {
        let Some(publisher) = &self.clock else { return };
        if let Err(refused) = publisher.publish(&Clock { clock: now }.encode()) {
            self.refuse("/clock", &refused);
        }
    }

    fn publish_record(&mut self, record: &Record) -> Result<(), BusError> {
        let Some(cdr) = self.privacy.censor(record) else { return Ok(()) };
        let cdr = cdr.into_owned();
        let stamps = self.stamps;
        let Some(publisher) = self.publisher(record)? else { return Ok(()) };
        let published = match stamps {
            Some(clock) => publisher.publish_at(&cdr, clock.now()),
            None => publisher.publish(&cdr),
        };
        if let Err(refused) = published {
            self.refuse(&record.stream.name, &refused);
        }
        Ok(())
    }

    /// The publisher for a record, created with the first record of its stream; `None` if the stream is not published.
    fn publisher(&mut self, record: &Record) -> Result<Option<&dyn Publisher>, BusError> {
        let publisher = match self.by_stream.entry(record.sample.stream) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => new.insert(open(self.bus, self.publish, &record.stream)?),
        };
        Ok(publisher.as_deref())
    }

    /// Counts a message that the bus rejected; logs it once for each topic.
    fn refuse(&mut self, topic: &str, refused: &BusError) {
        let count = self.refused.entry(topic.to_owned()).or_default();
        *count += 1;
        if *count == 1 {
            tracing::error!("failed to {refused}; further rejected messages are only counted");
        }
    }

    fn finish(self, delivery: Delivery) -> Result<(), SinkError> {
        let lost: u64 = self.refused.values().sum();
        if lost == 0 || delivery == Delivery::Fresh {
            return Ok(());
        }
        let topics: Vec<_> = self.refused.keys().map(String::as_str).collect();
        Err(SinkError::Lost {
            message: format!(
                "publish {} on {}",
                counted(lost, "message", "messages"),
                topics.join(", ")
            ),
            hint: "a subscriber is too slow for the retransmissions that it requests".into(),
        })
    }
}

/// Whether the type is fully known: the definition of a foreign type may be found later.
fn is_known(shape: &Shape) -> bool {
    !matches!(shape, Shape::Message(schema) if schema.text.is_empty())
}

fn open(
    bus: &dyn Bus,
    publish: &Publish,
    stream: &Stream,
) -> Result<Option<Box<dyn Publisher>>, BusError> {
    let qos = stream.qos.first().cloned().unwrap_or(Qos::reliable(10));
    let open = || bus.publish(&stream.name, &schema_of(&stream.shape), &qos);
    publish.includes(stream).then(open).transpose()
}

impl Publish {
    /// Whether a stream is published.
    pub fn includes(&self, stream: &Stream) -> bool {
        let about_person = stream.about == About::Person;
        let concluded = stream.origin == Origin::Derived && !about_person;
        match self {
            Publish::Everything => !about_person,
            Publish::Raw => {
                let own_words = stream.about == About::Session && stream.shape == Shape::Event;
                stream.origin == Origin::Raw && !about_person && !own_words
            }
            // The message of a feature that panicked may be about people.
            Publish::Conclusions(_) if stream.name == FAULTS => false,
            Publish::Conclusions(_) if concluded => true,
            Publish::Conclusions(patterns) | Publish::Named(patterns) => {
                let mut may_name = patterns.iter().filter(|each| each.is_rooted() || !about_person);
                may_name.any(|pattern| pattern.matches(&stream.name))
            }
        }
    }
}

impl From<BusError> for SinkError {
    fn from(error: BusError) -> SinkError {
        SinkError::Failed { message: error.to_string(), hint: String::new() }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use bytes::Bytes;
    use teampulse_core::data::Data;
    use teampulse_core::sample::{Sample, Turn};
    use teampulse_core::sink;
    use teampulse_core::stream::{Shape, Subject};

    use super::*;
    use crate::bus::{Arrival, Asked, Subscription};
    use crate::memory::MemoryBus;

    fn person() -> Stream {
        let subject = Subject { about: About::Person, id: "p001".into() };
        Stream::raw("/humans/persons/p001/ecg", subject, Shape::Sample)
    }

    fn robot() -> Stream {
        Stream::raw("/r1/load", Subject::robot("r1"), Shape::Sample)
    }

    fn record(streams: &Streams, stream: Stream) -> Record {
        let id = streams.declare(stream).id;
        let at = Time::from_stamp(7, 0);
        let sample = Sample {
            stream: id,
            measured: at,
            log_time: at,
            device_time: None,
            source_time: None,
            period_ns: 0.0,
            index: 0,
            turn: Turn::OnTime,
            data: Data::Sample([1.0].into()),
        };
        Record { stream: streams.get(id), sample, cdr: Bytes::from_static(&[0, 1, 0, 0, 9]) }
    }

    /// The description of a stream on `/teampulse/streams`.
    fn described(streams: &Streams, of: Stream) -> Record {
        let topic = Stream::raw("/teampulse/streams", Subject::session(), Shape::Description);
        let topic = Stream { origin: Origin::Derived, ..topic };
        let record = record(streams, topic);
        let data = Data::Description(Arc::new(of));
        Record { sample: Sample { data, ..record.sample.clone() }, ..record }
    }

    type Heard = Arc<Mutex<Vec<Bytes>>>;

    fn listen(bus: &MemoryBus, topic: &str, type_name: &str) -> (Subscription, Heard) {
        let heard = Heard::default();
        let kept = Arc::clone(&heard);
        let deliver = Arc::new(move |arrival: Arrival| kept.lock().unwrap().push(arrival.bytes));
        let asked = Asked::Adaptive { depth: 10 };
        (bus.subscribe(topic, type_name, asked, deliver).unwrap(), heard)
    }

    /// Runs a sink on one record of each of these streams.
    fn run(sink: RosSink, streams_of: impl IntoIterator<Item = Stream>) {
        run_on(sink, record, streams_of);
    }

    /// Runs a sink on the given records of the streams.
    fn run_on(
        sink: RosSink,
        record: fn(&Streams, Stream) -> Record,
        streams_of: impl IntoIterator<Item = Stream>,
    ) {
        let streams = Streams::default();
        let (post, inbox) = sink::queue(sink.delivery(), streams.clone());
        let batch: Batch = streams_of.into_iter().map(|each| record(&streams, each)).collect();
        post.deliver(&batch);
        drop(post);
        Box::new(sink).run(inbox).unwrap();
    }

    #[test]
    fn records_are_published_byte_for_byte_and_the_clock_before_them() {
        let ours = MemoryBus::new("/teampulse");
        let theirs = ours.join("/r1/driver");
        let (_load, load) = listen(&theirs, "/r1/load", "teampulse_msgs/msg/Sample");
        let (_clock, clock) = listen(&theirs, "/clock", Clock::NAME);
        run(RosSink::lossless(ours, Publish::Everything).with_clock(), [robot()]);
        assert_eq!(*load.lock().unwrap(), [Bytes::from_static(&[0, 1, 0, 0, 9])]);
        let published = Clock::decode(&clock.lock().unwrap()[0]).unwrap();
        assert_eq!(published.clock, Time::from_stamp(7, 0));
    }

    #[test]
    fn a_topic_is_there_before_its_first_message() {
        let ours = MemoryBus::new("/teampulse");
        let theirs = ours.join("/r1/driver");
        let sink = RosSink::lossless(ours, Publish::Everything);
        let mut publishers = Publishers::new(&sink).unwrap();
        let streams = Streams::default();
        streams.declare(robot());
        streams.declare(person());
        publishers.open_declared(&streams).unwrap();
        let graph = theirs.graph();
        let published = |stream: Stream| graph.borrow().publishers(&stream.name).count();
        assert_eq!([published(robot()), published(person())], [1, 0]);
    }

    fn parsed(pattern: &str) -> Pattern {
        Pattern::parse(pattern).unwrap()
    }

    #[test]
    fn a_stream_about_a_person_is_not_published_unless_it_is_named() {
        let ours = MemoryBus::new("/teampulse");
        let theirs = ours.join("/other");
        let (_ecg, ecg) = listen(&theirs, &person().name, "teampulse_msgs/msg/Sample");
        run(RosSink::fresh(ours.clone(), Publish::Everything), [person(), robot()]);
        assert!(ecg.lock().unwrap().is_empty());
        for pattern in ["/**", "/*/persons/*/ecg", "/h*/**"] {
            let named = Publish::Named(vec![parsed(pattern)]);
            run(RosSink::fresh(ours.clone(), named), [person(), robot()]);
            assert!(ecg.lock().unwrap().is_empty(), "{pattern}");
        }
        let named = Publish::Named(vec![parsed("/humans/persons/*/ecg")]);
        run(RosSink::fresh(ours, named), [person(), robot()]);
        assert_eq!(ecg.lock().unwrap().len(), 1);
    }

    #[test]
    fn what_a_stream_about_a_person_is_is_reported_only_where_it_is_published() {
        let ours = MemoryBus::new("/teampulse");
        let theirs = ours.join("/other");
        let described_type = "teampulse_msgs/msg/StreamDescription";
        let (_streams, streams) = listen(&theirs, "/teampulse/streams", described_type);
        let sink = |named: &[&str]| {
            let named = named.iter().map(|name| parsed(name)).collect();
            RosSink::fresh(ours.clone(), Publish::Conclusions(named))
        };
        run_on(sink(&[]), described, [person(), robot()]);
        assert_eq!(streams.lock().unwrap().len(), 1);
        run_on(sink(&["/humans/persons/p001/ecg"]), described, [person()]);
        assert_eq!(streams.lock().unwrap().len(), 2);
    }

    #[test]
    fn what_is_concluded_of_robots_and_the_team_is_published_and_of_people_nothing() {
        let concluded = |stream: Stream| {
            Publish::Conclusions(Vec::new()).includes(&Stream { origin: Origin::Derived, ..stream })
        };
        assert!(concluded(Stream::raw("/team/state", Subject::team(), Shape::Feature)));
        assert!(concluded(robot()) && !concluded(person()));
        assert!(!concluded(Stream::raw(FAULTS, Subject::session(), Shape::Event)));
        assert!(!Publish::Conclusions(Vec::new()).includes(&robot()), "what it said is known");
    }

    #[test]
    fn a_wild_pattern_names_nobody() {
        for pattern in ["/**", "/*/persons/p001/ecg"] {
            assert!(!Publish::Named(vec![parsed(pattern)]).includes(&person()), "{pattern}");
        }
    }
}
