//! The pump: takes readings in hand-over order, corrects their time, runs features, encodes.
//!
//! ARCHITECTURE.md states the pump's contract. All results depend only on the readings and their order, so a replay of
//! the recorded readings gives the same samples, byte for byte.

mod in_band;

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use teampulse_timefilter::Ticks;
use teampulse_timefilter::clock::ClockEvent;

use crate::clocks::{Clocks, Reported};
use crate::data::{Data, Event, EventKind};
use crate::extractors::{Broken, Extractors, Given, NamedFeature};
use crate::fault::{faults, lasting};
use crate::intake::Shared;
use crate::life::Life;
use crate::loss::Loss;
use crate::outlet::Item;
use crate::sample::{Record, Sample, Turn};
use crate::session_streams::{
    SESSION_EVENTS, clock_events, descriptions, end_event, health, is_end, session_events,
};
use crate::source::Reading;
use crate::status::StreamStatus;
use crate::stream::{Origin, Shape, Stream, StreamId};
use crate::streams::{Declared, Streams};
use crate::time::Time;
use crate::track::Track;

/// The time from one tick to the next.
pub const TICK: Duration = Duration::from_millis(100);
const TICKS_PER_SECOND: i64 = 10;

/// The most records of a batch.
pub(crate) const BATCH: usize = 1024;

/// Converts a sample to a ROS message: CDR with its four-byte header.
pub type Encode = fn(&Sample) -> Bytes;

/// The pump of a session, without its thread.
pub struct Pump {
    streams: Streams,
    encode: Encode,
    clocks: Clocks,
    extractors: Extractors,
    intake: Shared,
    tracks: Vec<Option<Track>>,
    ticks: Ticks,
    last: Time,
    /// The shortest time from one reading to the next [ns].
    step_nanos: i64,
    given: VecDeque<Given>,
    records: Vec<Record>,
    dropped: u64,
    /// The number of samples that were skipped for lack of time, by stream.
    left_out: BTreeMap<StreamId, u64>,
    broken: Vec<Broken>,
    /// Whether the event that ends the session was taken.
    has_ended: bool,
}

impl Pump {
    /// A pump that has taken nothing yet.
    pub fn new(
        streams: Streams,
        clocks: Clocks,
        features: Vec<NamedFeature>,
        encode: Encode,
    ) -> Pump {
        Pump {
            streams,
            encode,
            clocks,
            extractors: Extractors::new(features),
            intake: Shared::default(),
            tracks: Vec::new(),
            ticks: Ticks::every(TICK.as_nanos() as i64),
            last: Time::EPOCH,
            step_nanos: 1,
            given: VecDeque::new(),
            records: Vec::new(),
            dropped: 0,
            left_out: BTreeMap::new(),
            broken: Vec::new(),
            has_ended: false,
        }
    }

    /// Makes this a pump over a recording, whose readings keep their log times: equal log times, which other recorders
    /// write, stay equal.
    #[must_use]
    pub fn over_recording(self) -> Pump {
        Pump { step_nanos: 0, ..self }
    }

    /// Takes the next item of the queue.
    pub(crate) fn take(&mut self, item: Item) {
        match item {
            Item::Declared { id, stream, at, .. } => self.take_declaration(id, &stream, at),
            Item::Arrived { reading, arrival, .. } => self.take_reading(reading, arrival),
            Item::Passed { until } => self.tick_until(until),
            Item::Paused { until } => self.pause_until(until),
            Item::Dropped { stream, samples } => {
                self.dropped += samples;
                let event = Loss::InOurQueue.event(&self.streams.get(stream).name, Some(samples));
                self.take_own(Loss::InOurQueue.stream(), event, self.last);
            }
        }
    }

    /// Discards the next item of the queue for lack of time: readings are counted as lost.
    pub(crate) fn leave_out(&mut self, item: Item) {
        match item {
            Item::Arrived { reading, .. } => {
                *self.left_out.entry(reading.stream).or_default() +=
                    u64::from(reading.data.samples());
            }
            other => self.take(other),
        }
    }

    /// Advances the time to `now`, after all earlier readings were taken.
    pub(crate) fn tick_until(&mut self, now: Time) {
        while let Some(tick) = self.ticks.next_until(now.nanos()) {
            self.tick(Time::from_nanos(tick));
        }
    }

    /// Advances the time towards `now` until a batch is full; returns whether there is more.
    pub(crate) fn tick_towards(&mut self, now: Time) -> bool {
        while self.records.len() < BATCH {
            let Some(tick) = self.ticks.next_until(now.nanos()) else { return false };
            self.tick(Time::from_nanos(tick));
        }
        true
    }

    /// The time to which the pump advances before it takes an item.
    pub(crate) fn time_of(&self, item: &Item) -> Time {
        let is_raw = |track: &Track| track.stream.origin == Origin::Raw;
        match item {
            Item::Declared { at, .. } => *at,
            Item::Passed { until } => *until,
            Item::Arrived { reading, arrival, .. } => {
                let track = self.tracks.get(reading.stream.0 as usize).and_then(Option::as_ref);
                if track.is_some_and(is_raw) { *arrival } else { self.last }
            }
            Item::Paused { .. } | Item::Dropped { .. } => self.last,
        }
    }

    /// Resumes ticks at `until`, and skips those before it.
    fn pause_until(&mut self, until: Time) {
        let mut ticks = Ticks::every(TICK.as_nanos() as i64);
        // The first call returns no tick; it only sets the start.
        if until > self.last && ticks.next_until(until.nanos()).is_none() {
            self.ticks = ticks;
        }
    }

    fn tick(&mut self, tick: Time) {
        self.last = self.last.max(tick);
        self.report_clocks(tick);
        self.extractors.tick(tick, &mut self.given);
        self.settle(tick);
        if tick.nanos() / TICK.as_nanos() as i64 % TICKS_PER_SECOND == 0 {
            self.publish_health(tick, Life::is_due);
        }
    }

    /// Ends a live session; the event that ends it is recorded.
    pub(crate) fn close(&mut self, now: Time) {
        for (stream, samples) in std::mem::take(&mut self.left_out) {
            self.take(Item::Dropped { stream, samples });
        }
        self.happen(end_event(), now);
    }

    /// Ends a recording. If it lacks the event that ends a session, because it was cut off or imported, windows and
    /// phases end with its last record. Features receive that end, but it is not recorded.
    pub(crate) fn close_recording(&mut self) {
        if self.has_ended {
            return;
        }
        let stream = self.session_events();
        let end = Sample {
            stream,
            measured: self.last,
            log_time: self.last,
            device_time: None,
            source_time: None,
            period_ns: 0.0,
            index: 0,
            turn: Turn::OnTime,
            data: Data::Event(Arc::new(end_event())),
        };
        self.extractors.push(&end, &mut self.given);
        self.settle(self.last);
    }

    /// The stream of the session's events, which is not recorded where the recording has none.
    fn session_events(&mut self) -> StreamId {
        let known = self.streams.find(SESSION_EVENTS).map(|(id, _)| id);
        if let Some(id) = known.filter(|id| self.track(*id).is_some()) {
            return id;
        }
        let Declared { id, .. } = self.streams.declare(session_events());
        let stream = self.streams.get(id);
        self.add_track(Track::new(id, Arc::clone(&stream)));
        self.extractors.join(id, &stream, &mut self.given);
        id
    }

    /// Takes in an event of the session itself.
    pub(crate) fn happen(&mut self, event: Event, now: Time) {
        self.take_own(session_events(), Data::Event(Arc::new(event)), now);
    }

    /// Stops all features from now on; raw readings are still taken.
    pub(crate) fn leave_out_features(&mut self) {
        self.extractors.leave_out_all();
    }

    /// The records so far, in order.
    pub(crate) fn records(&mut self) -> &mut Vec<Record> {
        &mut self.records
    }

    /// How many samples were dropped in front of this pump.
    pub(crate) fn dropped(&self) -> u64 {
        self.dropped
    }

    /// The features that have panicked.
    pub(crate) fn take_broken(&mut self) -> Vec<Broken> {
        std::mem::take(&mut self.broken)
    }

    fn take_declaration(&mut self, id: StreamId, stream: &Arc<Stream>, at: Time) {
        let at = self.next_log_time(at);
        if let Some(track) = self.track(id) {
            let is_new = track.redeclare(stream);
            let known = Arc::clone(&track.stream);
            if !Arc::ptr_eq(&known, stream) {
                self.streams.declare(Stream::clone(&known));
            }
            if !is_new {
                return;
            }
        } else {
            self.add_track(Track::new(id, Arc::clone(stream)));
        }
        self.joined(id, at);
        self.settle(at);
    }

    /// Describes a stream that is new, or has changed, and hands it to the extractors.
    fn joined(&mut self, id: StreamId, at: Time) {
        let track = self.track(id).expect("a stream is declared before it is described");
        let stream = Arc::clone(&track.stream);
        self.describe(&stream, at);
        self.extractors.join(id, &stream, &mut self.given);
    }

    /// Takes a reading; a derived reading from a recording keeps the log time of its cause.
    fn take_reading(&mut self, mut reading: Reading, arrival: Time) {
        reading.data = reading.data.cleaned();
        let track = self.track(reading.stream).expect("a stream is declared before its readings");
        let log_time = match track.stream.origin {
            Origin::Raw => self.next_log_time(arrival),
            Origin::Derived => self.last.max(arrival),
        };
        self.count_losses(&reading);
        self.take_word(&reading, log_time);
        let index = reading.stream.0 as usize;
        let track = self.tracks[index].as_mut().expect("a stream is declared before its readings");
        let mut sample = track.sample(reading, log_time, &mut self.clocks);
        track.bound(&mut sample, &mut self.intake);
        let is_end = is_end(&track.stream, &sample.data);
        self.extractors.push(&sample, &mut self.given);
        self.record(sample);
        self.settle(log_time);
        if is_end {
            self.has_ended = true;
            self.publish_health(log_time, |_| true);
        }
    }

    /// Takes a reading that originates here.
    fn take_own(&mut self, stream: Stream, data: Data, at: Time) {
        let Declared { id, is_new } = self.streams.declare(stream);
        if is_new || self.track(id).is_none() {
            self.take_declaration(id, &self.streams.get(id), at);
        }
        let reading =
            Reading { index: None, stream: id, device_time: None, source_time: None, data };
        self.take_reading(reading, at);
    }

    /// The log time of a reading that arrived at `arrival`, after all ticks before it.
    fn next_log_time(&mut self, arrival: Time) -> Time {
        let next = self.last.nanos().saturating_add(self.step_nanos);
        let log_time = arrival.max(Time::from_nanos(next));
        self.tick_until(log_time);
        self.last = self.last.max(log_time);
        self.last
    }

    /// Reports the events of clocks.
    fn report_clocks(&mut self, tick: Time) {
        for Reported { clock, label, event } in self.clocks.tick(tick.nanos()) {
            let stream = self.declare_derived(clock_events(), tick);
            let (kind, value) = (EventKind::Clock, event.value());
            let reported = Event { kind, label, value, duration_secs: 0.0 };
            self.take_derived(stream, tick, tick, Data::Event(Arc::new(reported)));
            if let ClockEvent::WrongRate { declared_hz, hz } = event {
                self.correct_rate(clock, declared_hz, hz, tick);
            }
        }
    }

    /// Declares the streams of a clock again with a corrected rate [Hz], as features depend on it.
    fn correct_rate(&mut self, clock: usize, declared_hz: f64, hz: f64, tick: Time) {
        for id in self.clocks.streams_of(clock) {
            if self.track(id).is_some_and(|track| track.correct_rate(declared_hz, hz)) {
                let track = self.track(id).expect("its rate has just been corrected");
                let stream = Stream::clone(&track.stream);
                self.streams.declare(stream);
                self.joined(id, tick);
            }
        }
    }

    /// Declares and records the output of extractors, and passes it to the extractors that accept it.
    fn settle(&mut self, log_time: Time) {
        self.settle_given(log_time);
        loop {
            let broken = self.extractors.take_broken();
            if broken.is_empty() {
                break;
            }
            for each in &broken {
                self.report_broken(each, log_time);
            }
            self.broken.extend(broken);
            self.settle_given(log_time);
        }
    }

    /// Reports a feature that panicked. A replay does the same.
    fn report_broken(&mut self, broken: &Broken, log_time: Time) {
        let stream = self.declare_derived(faults(), log_time);
        let event = Data::Event(Arc::new(lasting(broken.to_string())));
        self.take_derived(stream, log_time, log_time, event);
    }

    fn settle_given(&mut self, log_time: Time) {
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
        let Declared { id, is_new } = self.streams.declare(stream);
        let stream = self.streams.get(id);
        if self.track(id).is_none() {
            self.add_track(Track::new(id, Arc::clone(&stream)));
        }
        if is_new {
            self.describe(&stream, log_time);
            self.extractors.join(id, &stream, &mut self.given);
        }
        id
    }

    fn take_derived(&mut self, stream: StreamId, measured: Time, log_time: Time, data: Data) {
        // Texts may come from messages of other programs.
        let data = data.cleaned();
        let track = self.track(stream).expect("an extractor declares before it emits");
        let index = track.number(None);
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

    /// Advances the health of all raw streams by a second, and publishes it where it is due.
    fn publish_health(&mut self, tick: Time, is_due: fn(&Life) -> bool) {
        let mut statuses = Vec::new();
        for track in self.tracks.iter_mut().flatten() {
            if track.stream.has_health() {
                track.life.second(tick);
                if is_due(&track.life) {
                    statuses.push(track.status(tick, &self.clocks));
                }
            }
        }
        if statuses.is_empty() {
            return;
        }
        let stream = self.declare_derived(health(), tick);
        for status in statuses {
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

    /// Adds a stream. A second type on the same topic is reported under its own name.
    fn add_track(&mut self, mut track: Track) {
        let named = self.streams.named(&track.stream.name);
        let is_reported = |pump: &mut Pump, id| {
            pump.track(id).is_some_and(|known| known.reported_as == track.reported_as)
        };
        if let Shape::Message(schema) = &track.stream.shape
            && named.into_iter().any(|id| is_reported(self, id))
        {
            track.reported_as = StreamStatus::name_of_type(&track.stream.name, &schema.name);
        }
        let index = track.id.0 as usize;
        if self.tracks.len() <= index {
            self.tracks.resize_with(index + 1, || None);
        }
        self.tracks[index] = Some(track);
    }
}
