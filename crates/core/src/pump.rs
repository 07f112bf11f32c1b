//! The pump: takes readings in hand-over order, corrects their time, runs features, encodes.
//!
//! Its contract stands in ARCHITECTURE.md. Everything here is a function of what was taken and in
//! which order, so that a replay of the recorded readings gives the same samples, byte for byte.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use teampulse_timefilter::Ticks;

use crate::clocks::Clocks;
use crate::computers::Told;
use crate::data::{Data, Event, EventKind};
use crate::extractors::{Extractors, Given};
use crate::feature::Feature;
use crate::loss::Loss;
use crate::outlet::Item;
use crate::qos::Qos;
use crate::sample::{Record, Sample, Turn};
use crate::source::Reading;
use crate::stream::{Origin, Shape, Signal, Stream, StreamId, Subject};
use crate::streams::{Declared, Streams};
use crate::time::Time;
use crate::track::Track;

/// The time from one tick to the next.
pub const TICK: Duration = Duration::from_millis(100);
const TICKS_PER_SECOND: i64 = 10;

/// The label of the event with which a session ends.
pub const END: &str = "end";

/// More lost samples than this in one report are not believed; NaN (unknown) passes.
const MOST_LOST: f64 = u32::MAX as f64;

/// How a sample becomes a ROS message: CDR with its four-byte header.
pub type Encode = fn(&Sample) -> Bytes;

/// The pump of a session, without its thread.
pub struct Pump {
    streams: Streams,
    encode: Encode,
    clocks: Clocks,
    extractors: Extractors,
    tracks: Vec<Option<Track>>,
    ticks: Ticks,
    last: Time,
    given: VecDeque<Given>,
    records: Vec<Record>,
    dropped: u64,
}

impl Pump {
    /// A pump that has taken nothing yet.
    pub fn new(
        streams: Streams,
        clocks: Clocks,
        features: Vec<Arc<dyn Feature>>,
        encode: Encode,
    ) -> Pump {
        Pump {
            streams,
            encode,
            clocks,
            extractors: Extractors::new(features),
            tracks: Vec::new(),
            ticks: Ticks::every(TICK.as_nanos() as i64),
            last: Time::EPOCH,
            given: VecDeque::new(),
            records: Vec::new(),
            dropped: 0,
        }
    }

    /// Takes what comes next out of the queue.
    pub(crate) fn take(&mut self, item: Item) {
        match item {
            Item::Declared { id, stream, at } => self.take_declaration(id, &stream, at),
            Item::Arrived { reading, arrival, .. } => self.take_reading(reading, arrival),
            Item::Passed { until } => self.tick_until(until),
            Item::Dropped { stream, count } => {
                self.dropped += count;
                let event = Loss::InOurQueue.event(&self.streams.get(stream).name, count as f64);
                self.take_own(Loss::InOurQueue.stream(), event, self.last);
            }
        }
    }

    /// Time has passed up to `now`, and nothing came that was not taken.
    pub(crate) fn tick_until(&mut self, now: Time) {
        for tick in self.ticks.until(now.nanos()) {
            let tick = Time::from_nanos(tick);
            self.last = self.last.max(tick);
            self.tell_clocks(tick);
            self.extractors.tick(tick, &mut self.given);
            self.settle(tick);
            if tick.nanos() / TICK.as_nanos() as i64 % TICKS_PER_SECOND == 0 {
                self.tell_health(tick);
            }
        }
    }

    /// Ends a live session: the closing tick is recorded.
    pub(crate) fn close(&mut self, now: Time) {
        let label = END.to_owned();
        let event = Event { kind: EventKind::Clock, label, value: f64::NAN, duration_secs: 0.0 };
        self.take_own(session_events(), Data::Event(Arc::new(event)), now);
    }

    /// What came of what was taken, in order.
    pub(crate) fn records(&mut self) -> &mut Vec<Record> {
        &mut self.records
    }

    /// How many readings were dropped in front of this pump.
    pub(crate) fn dropped(&self) -> u64 {
        self.dropped
    }

    fn take_declaration(&mut self, id: StreamId, stream: &Arc<Stream>, at: Time) {
        let at = self.next_log_time(at);
        if let Some(track) = self.track(id) {
            track.life.declare_rate(stream.rate_hz);
            track.stream = Arc::clone(stream);
        } else {
            self.add_track(Track::new(id, Arc::clone(stream)));
        }
        self.describe(stream, at);
        self.extractors.join(id, stream, &mut self.given);
        self.settle(at);
    }

    /// Takes a reading; what a recording hands over as derived keeps the log time of its cause.
    fn take_reading(&mut self, reading: Reading, arrival: Time) {
        let track = self.track(reading.stream).expect("a stream is declared before its readings");
        let log_time = match track.stream.origin {
            Origin::Raw => self.next_log_time(arrival),
            Origin::Derived => self.last.max(arrival),
        };
        self.count_losses(&reading);
        self.take_told(&reading, log_time);
        let index = reading.stream.0 as usize;
        let track = self.tracks[index].as_mut().expect("a stream is declared before its readings");
        let sample = track.sample(reading, log_time, &mut self.clocks);
        let is_end = is_end(&sample.data);
        self.extractors.push(&sample, &mut self.given);
        self.record(sample);
        self.settle(log_time);
        if is_end {
            self.tell_health(log_time);
        }
    }

    /// Takes a reading that originates here.
    fn take_own(&mut self, stream: Stream, data: Data, at: Time) {
        let Declared { id, news } = self.streams.declare(stream);
        if news || self.track(id).is_none() {
            self.take_declaration(id, &self.streams.get(id), at);
        }
        let reading = Reading { stream: id, device_time: None, source_time: None, data };
        self.take_reading(reading, at);
    }

    /// The log time of what arrived at `arrival`; everything gets its ticks first.
    fn next_log_time(&mut self, arrival: Time) -> Time {
        let log_time = arrival.max(Time::from_nanos(self.last.nanos().saturating_add(1)));
        self.tick_until(log_time);
        self.last = self.last.max(log_time);
        self.last
    }

    /// Losses that a reading tells of are counted on the stream that lost.
    fn count_losses(&mut self, reading: &Reading) {
        let Some(loss) = self.track(reading.stream).and_then(|track| track.tells) else { return };
        let Data::Event(event) = &reading.data else { return };
        let lost_on = |track: &&mut Track| {
            track.stream.name == event.label && track.stream.origin == Origin::Raw
        };
        if let Some(track) = self.tracks.iter_mut().flatten().find(lost_on) {
            track.lost(loss, event.value.clamp(0.0, MOST_LOST));
        }
    }

    /// What a reading tells of other computers' clocks is taken to heart.
    fn take_told(&mut self, reading: &Reading, log_time: Time) {
        let Some(track) = self.track(reading.stream) else { return };
        match Told::read(&track.stream, &reading.data) {
            Some(Told::StampedBy { stream, computer }) => self.clocks.stamped_by(stream, computer),
            Some(Told::Probed { computer, offset_secs, round_trip_secs }) => {
                let probe = Told::probe(offset_secs, round_trip_secs, log_time);
                self.clocks.probed(computer, &probe);
            }
            None => {}
        }
    }

    /// Tells what happened to clocks.
    fn tell_clocks(&mut self, tick: Time) {
        for (owner, news) in self.clocks.tick(tick.nanos()) {
            let stream = self.declare_derived(clock_events(), tick);
            let (kind, label) = (EventKind::Clock, format!("{owner} {news}"));
            let event = Event { kind, label, value: news.value(), duration_secs: 0.0 };
            self.take_derived(stream, tick, tick, Data::Event(Arc::new(event)));
        }
    }

    /// Declares and records all that extractors gave, and feeds it to those who listen to it.
    fn settle(&mut self, log_time: Time) {
        while let Some(given) = self.given.pop_front() {
            match given {
                Given::Declared { output, stream } => {
                    let id = self.declare_derived(*stream, log_time);
                    self.extractors.name(output, id);
                }
                Given::Sample { output, measured, data } => {
                    let stream = self.extractors.id(output);
                    self.take_derived(stream, measured, log_time, data);
                }
            }
        }
    }

    fn declare_derived(&mut self, stream: Stream, log_time: Time) -> StreamId {
        let Declared { id, news } = self.streams.declare(stream);
        let stream = self.streams.get(id);
        if self.track(id).is_none() {
            self.add_track(Track::new(id, Arc::clone(&stream)));
        }
        if news {
            self.describe(&stream, log_time);
            self.extractors.join(id, &stream, &mut self.given);
        }
        id
    }

    fn take_derived(&mut self, stream: StreamId, measured: Time, log_time: Time, data: Data) {
        let track = self.track(stream).expect("an extractor declares before it emits");
        let index = track.number();
        let sample = Sample {
            stream,
            measured,
            log_time,
            device_time: None,
            source_time: None,
            period_ns: 0.0,
            index,
            turn: Turn::OnTime,
            data,
        };
        self.extractors.push(&sample, &mut self.given);
        self.record(sample);
    }

    /// Tells the health of every raw stream, once a second.
    fn tell_health(&mut self, tick: Time) {
        let mut told = Vec::new();
        for track in self.tracks.iter_mut().flatten() {
            if track.has_health() {
                track.life.second(tick);
                told.push(track.status(tick, &self.clocks));
            }
        }
        if told.is_empty() {
            return;
        }
        let stream = self.declare_derived(health(), tick);
        for status in told {
            self.take_derived(stream, tick, tick, Data::Status(Arc::new(status)));
        }
        self.settle(tick);
    }

    /// Records the description of a stream.
    fn describe(&mut self, stream: &Arc<Stream>, log_time: Time) {
        let Declared { id, .. } = self.streams.declare(descriptions());
        if self.track(id).is_none() {
            self.add_track(Track::new(id, self.streams.get(id)));
        }
        self.take_derived(id, log_time, log_time, Data::Description(Arc::clone(stream)));
    }

    fn record(&mut self, sample: Sample) {
        let track = self.track(sample.stream).expect("a stream is declared before its samples");
        let stream = Arc::clone(&track.stream);
        let cdr = (self.encode)(&sample);
        self.records.push(Record { stream, sample, cdr });
    }

    fn track(&mut self, id: StreamId) -> Option<&mut Track> {
        self.tracks.get_mut(id.0 as usize)?.as_mut()
    }

    /// Adds a stream. The second type on a topic is told apart by its name.
    fn add_track(&mut self, mut track: Track) {
        let mut known = self.tracks.iter().flatten();
        if let Shape::Message(schema) = &track.stream.shape
            && known.any(|known| known.told_as == track.told_as)
        {
            track.told_as = format!("{} ({})", track.stream.name, schema.name);
        }
        let index = track.id.0 as usize;
        if self.tracks.len() <= index {
            self.tracks.resize_with(index + 1, || None);
        }
        self.tracks[index] = Some(track);
    }
}

/// Whether this is the end of a session: the last losses are then told.
fn is_end(data: &Data) -> bool {
    matches!(data, Data::Event(event) if event.kind == EventKind::Clock && event.label == END)
}

/// The stream of what happens in a session: phases, markers, its end.
pub fn session_events() -> Stream {
    let mut stream = Stream::raw("/session/events", Subject::session(), Shape::Event);
    stream.signal = Signal::Event;
    stream.qos = vec![Qos::latched(1000)];
    stream.doc = "phases, markers and faults of the session".into();
    stream
}

/// The topic of what happens to clocks; a replay makes it anew.
pub const CLOCKS: &str = "/teampulse/clocks";

/// The stream of what happens to the clocks of devices and computers.
fn clock_events() -> Stream {
    let mut stream = Stream::raw(CLOCKS, Subject::session(), Shape::Event);
    stream.origin = Origin::Derived;
    stream.signal = Signal::Event;
    stream.qos = vec![Qos::latched(1000)];
    stream.doc = "clocks that restart, jump, wrap, run fast or are off".into();
    stream
}

/// The stream on which every stream is described.
fn descriptions() -> Stream {
    let mut stream = Stream::raw("/teampulse/streams", Subject::session(), Shape::Description);
    stream.origin = Origin::Derived;
    stream.qos = vec![Qos::latched(1000)];
    stream.doc = "the streams of the session".into();
    stream
}

/// The stream on which the health of every raw stream is told.
fn health() -> Stream {
    let mut stream = Stream::raw("/teampulse/status", Subject::session(), Shape::Status);
    stream.origin = Origin::Derived;
    stream.rate_hz = 1.0;
    stream.qos = vec![Qos::reliable(1000)];
    stream.doc = "state, rate, age and losses of each raw stream, once a second".into();
    stream.method = "on ticks, from the stream's declared or learned rate".into();
    stream
}
