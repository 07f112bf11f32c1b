//! The sink's thread, which stores records and passes them to each client.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use axum::body::Bytes;
use serde::Serialize;
use teampulse_core::clock::Stopwatch;
use teampulse_core::computers::{ClockReport, UNTOLD};
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::sample::{Record, Turn};
use teampulse_core::session_streams::session_events;
use teampulse_core::status::StreamStatus;
use teampulse_core::stream::{Origin, Shape, Signal, Stream};
use teampulse_core::streams::Streams;
use teampulse_messages::readout::Readout;

use crate::cameras::Due;
use crate::client::{Client, Want};
use crate::convert;
use crate::echo::Echoes;
use crate::hub::{Hub, Known, json, message};
use crate::machine::{Usage, memory_bytes};
use crate::network::Network;
use crate::outbox::{Fragment, Slot, StateKind};
use crate::pictures::{Picture, has_pictures};
use crate::recording::Observed;
use crate::replay::timeline::MOST_EVENTS;
use crate::wire::waves::Wave;
use crate::wire::{Ended, FromServer, Machine, known as known_number};

/// The intervals at which readings are sent: to clients that draw them, and to other clients [s].
const PACES: [f64; 2] = [1.0 / 30.0, 1.0];

/// The time after which a stream that was not received counts as missing [s]: as long as `teampulse check` listens.
const AWAITED_SECS: f64 = 6.0;

/// Takes records and passes them on; never waits for a client.
pub struct Relay {
    hub: Arc<Hub>,
    streams: Streams,
    /// Whether streams may be new or have changed.
    is_described: bool,
    readouts: BTreeMap<u32, Option<Readout>>,
    /// The camera in whose pictures the points of each stream were found.
    looks: BTreeMap<u32, Option<u32>>,
    /// The newest status of each raw stream.
    statuses: BTreeMap<u32, Arc<StreamStatus>>,
    /// When a reading was last sent, at each pace [s].
    sent: BTreeMap<u32, [f64; 2]>,
    events: u64,
    usage: Usage,
    ticked: Option<Stopwatch>,
    network: Network,
    recording: Observed,
    echoes: Echoes,
    next_phase: Option<String>,
    skipped: u64,
}

/// The new data of a batch.
struct Fresh {
    /// Whether any client is connected; otherwise nothing needs to be encoded.
    is_watched: bool,
    events: Vec<(u32, bool, Fragment)>,
    states: Vec<(StateKind, u32, f64, Fragment)>,
    readings: Vec<Reading>,
    waves: Vec<Wave>,
    pictures: Vec<(Arc<Picture>, Due)>,
}

impl Fresh {
    fn of(is_watched: bool) -> Fresh {
        let (events, states) = (Vec::new(), Vec::new());
        let (waves, pictures) = (Vec::new(), Vec::new());
        Fresh { is_watched, events, states, readings: Vec::new(), waves, pictures }
    }

    fn state(&mut self, kind: StateKind, stream: u32, t: f64, state: &impl Serialize) {
        if self.is_watched {
            self.states.push((kind, stream, t, json(state).into()));
        }
    }
}

/// A reading, and which clients it is due for.
struct Reading {
    stream: u32,
    t: f64,
    fragment: Fragment,
    is_drawn: bool,
    is_shown: bool,
}

impl Relay {
    /// A relay of a session.
    pub fn new(hub: Arc<Hub>, streams: Streams) -> Relay {
        Relay {
            hub,
            streams,
            is_described: true,
            readouts: BTreeMap::new(),
            looks: BTreeMap::new(),
            statuses: BTreeMap::new(),
            sent: BTreeMap::new(),
            events: 0,
            usage: Usage::start(),
            ticked: None,
            network: Network::default(),
            recording: Observed::default(),
            echoes: Echoes::default(),
            next_phase: None,
            skipped: 0,
        }
    }

    /// Takes a batch of records.
    pub fn take(&mut self, batch: &[Record]) {
        let hub = Arc::clone(&self.hub);
        let is_described = |record: &Record| matches!(record.sample.data, Data::Description(_));
        self.is_described |= batch.iter().any(is_described);
        self.describe();
        let mut known = hub.known();
        // A client that joins, or starts to draw, after this point waits for the lock and then finds this batch in
        // `known`.
        let clients = self.hub.clients();
        let mut fresh = Fresh::of(!clients.is_empty());
        for record in batch.iter().filter(|record| record.sample.turn != Turn::Duplicate) {
            self.take_record(record, &mut known, &mut fresh);
        }
        let wanted: Vec<_> = clients.iter().map(|client| client.wanted()).collect();
        let hidden = known.hidden.clone();
        drop(known);
        for (client, wanted) in clients.iter().zip(&wanted) {
            offer(client, &fresh, wanted, &hidden);
        }
        for record in batch {
            self.echo(record, &clients);
        }
    }

    /// Shows another time of a recording. The state at that time follows from earlier events and records, which are not
    /// sent as if they happened now.
    pub fn restart<'a>(
        &mut self,
        before: impl Iterator<Item = &'a crate::wire::Event>,
        records: impl Iterator<Item = Record>,
    ) {
        let hub = Arc::clone(&self.hub);
        self.is_described = true;
        self.describe();
        let mut known = hub.known();
        known.forget();
        self.sent.clear();
        self.events = self.events.max(MOST_EVENTS as u64);
        for event in before {
            known.keep(false, event.stream, json(event).into());
        }
        let mut unsent = Fresh::of(false);
        for record in records {
            self.take_record(&record, &mut known, &mut unsent);
            (unsent.events, unsent.waves, unsent.pictures) = (Vec::new(), Vec::new(), Vec::new());
        }
        if let Some(playback) = hub.playback() {
            hub.clients().iter().for_each(|client| client.move_to(playback, &known));
        }
    }

    /// Does everything that is due once a second.
    pub fn tick(&mut self, skipped: u64) {
        self.skipped += skipped;
        let clients = self.hub.clients();
        self.echoes.look(&(self.hub.context.disk)(), &clients);
        if self.ticked.is_some_and(|ticked| ticked.elapsed().as_secs_f64() < 1.0) {
            return;
        }
        self.ticked = Some(Stopwatch::start());
        self.is_described = true;
        self.describe();
        let recording = self.recording.look(&self.hub);
        {
            let mut known = self.hub.known();
            known.recording = Some(recording.clone());
            known.skipped = self.skipped;
        }
        self.require(&clients);
        let recording = message(&FromServer::Recording(recording));
        let (cpu_cores, memory_bytes) = (self.usage.take(), memory_bytes());
        let next = (self.hub.context.next_phase)();
        let network = message(&self.network());
        for client in &clients {
            client.outbox.replace(Slot::Recording, recording.clone());
            client.outbox.replace(Slot::Network, network.clone());
            let machine = Machine {
                cpu_cores,
                memory_bytes,
                skipped: self.skipped,
                viewers: clients.len() as u32,
                waiting_bytes: client.outbox.waiting_bytes(),
            };
            client.outbox.replace(Slot::Machine, message(&FromServer::Machine(machine)));
            if self.next_phase != next {
                let name = next.clone();
                client.outbox.replace(Slot::NextPhase, message(&FromServer::NextPhase { name }));
            }
            if let Some(missed) = client.outbox.missed() {
                client.outbox.urgent(message(&FromServer::Missed(missed)));
            }
        }
        self.next_phase = next;
    }

    /// The current state of other computers and the buses.
    fn network(&mut self) -> FromServer {
        let now = self.hub.now();
        let statuses = || self.statuses.values().map(|status| &**status);
        let computers = self.network.computers(now, statuses());
        let buses = self.network.buses(&(self.hub.context.buses)(), statuses());
        FromServer::Network { computers, buses }
    }

    /// Checks the requirements of the study, once there has been time to meet them.
    fn require(&mut self, clients: &[Arc<Client>]) {
        let Some(required) = &self.hub.context.required else { return };
        if self.hub.now() < AWAITED_SECS {
            return;
        }
        let mut known = self.hub.known();
        let received: Vec<(Arc<Stream>, StreamStatus)> = self
            .statuses
            .iter()
            .filter_map(|(id, status)| Some((known.streams.get(id)?, status)))
            .filter(|(stream, _)| stream.origin == Origin::Raw)
            .map(|(stream, status)| (Arc::clone(stream), StreamStatus::clone(status)))
            .collect();
        let unmet = required(&received);
        if known.unmet.as_ref() == Some(&unmet) {
            return;
        }
        known.unmet = Some(unmet.clone());
        drop(known);
        let text = message(&FromServer::Required { unmet });
        for client in clients {
            client.outbox.replace(Slot::Required, text.clone());
        }
    }

    /// Ends the connections of all clients.
    pub fn end(&mut self, reason: &str) {
        for client in self.hub.clients() {
            let reason = reason.to_owned();
            client.outbox.urgent(message(&FromServer::Recording(self.recording.look(&self.hub))));
            client.outbox.urgent(message(&FromServer::Ended(Ended { reason: reason.clone() })));
            client.outbox.end(&reason);
        }
    }

    /// Takes streams that are new or have changed, and declares them to all clients.
    fn describe(&mut self) {
        if !std::mem::take(&mut self.is_described) {
            return;
        }
        let mut known = self.hub.known();
        let mut changed = Vec::new();
        for (id, stream) in self.streams.all() {
            if known.streams.get(&id.0).is_some_and(|it| Arc::ptr_eq(it, &stream)) {
                continue;
            }
            if let Shape::Message(schema) = &stream.shape {
                known.named.insert(format!("{} ({})", stream.name, schema.name), id.0);
            }
            known.named.entry(stream.name.clone()).or_insert(id.0);
            if self.hub.context.is_blinding && (self.hub.context.hides)(&stream) {
                known.hidden.insert(id.0);
            }
            known.streams.insert(id.0, stream);
            self.readouts.remove(&id.0);
            changed.push(id.0);
        }
        if changed.is_empty() {
            return;
        }
        self.looks.clear();
        let texts = [false, true]
            .map(|is_blind| message(&known.declared(changed.iter().copied(), is_blind)));
        drop(known);
        for client in self.hub.clients() {
            client.outbox.urgent(texts[usize::from(client.is_blind())].clone());
        }
    }

    fn take_record(&mut self, record: &Record, known: &mut Known, fresh: &mut Fresh) {
        let (id, sample) = (record.sample.stream.0, &record.sample);
        let t = self.hub.secs(sample.measured);
        match &sample.data {
            Data::Status(status) => {
                let Some(&about) = known.named.get(&status.name) else { return };
                let health = convert::health(about, status);
                self.statuses.insert(about, Arc::clone(status));
                fresh.state(StateKind::Status, about, t, &health);
                known.health.insert(about, health);
                known.health_t = t;
            }
            Data::Event(event) => self.take_event(record, event, known, fresh),
            Data::Feature(values) => {
                let feature = Arc::new(convert::feature(id, t, values));
                if let Some(track) = known.track(id, false, values.values.len()) {
                    track.add(t, values.values.iter().copied());
                }
                fresh.state(StateKind::Feature, id, t, &*feature);
                known.features.insert(id, feature);
            }
            Data::Wave(wave) => {
                let width = wave.channels as usize;
                let period = sample.period_ns * 1e-9;
                if let Some(track) = known.track(id, true, width) {
                    for (place, numbers) in wave.samples.chunks_exact(width.max(1)).enumerate() {
                        track.add(t + place as f64 * period, numbers.iter().copied());
                    }
                }
                let samples = wave.samples.iter().map(|number| *number as f32).collect();
                let (start, channels) = (t, wave.channels);
                let wave = Wave { stream: id, channels, start, period, samples };
                known.recent.keep(wave.clone());
                fresh.waves.push(wave);
            }
            Data::Message(message) if has_pictures(&record.stream) => {
                self.take_picture(record, message, t, (known, fresh));
            }
            Data::Sample(_) => {
                self.take_reading(record, t, known, fresh);
                self.take_look(record, t, known, fresh);
            }
            Data::Message(_) => self.take_reading(record, t, known, fresh),
            Data::Description(_) => {}
        }
    }

    fn take_picture(
        &self,
        record: &Record,
        message: &Bytes,
        t: f64,
        (known, fresh): (&mut Known, &mut Fresh),
    ) {
        let id = record.sample.stream.0;
        let picture = Picture::read(&record.stream, id, t, message).map(Arc::new);
        match &picture {
            Err(unshown) if known.cameras.unshown(id) != Some(unshown) => {
                self.hub.clients().iter().for_each(|client| client.unshown(id, unshown));
            }
            Ok(_) | Err(_) => {}
        }
        let due = known.cameras.take(id, picture.clone());
        fresh.pictures.extend(picture.ok().zip(due));
    }

    /// Takes points found in a camera's picture: the picture is now due for clients that draw points.
    fn take_look(&mut self, record: &Record, t: f64, known: &mut Known, fresh: &mut Fresh) {
        let id = record.sample.stream.0;
        let camera = self.looks.entry(id).or_insert_with(|| camera_of(&record.stream, known));
        let found = camera.and_then(|camera| known.cameras.look(camera, t));
        fresh.pictures.extend(found.map(|picture| (picture, Due::Found)));
    }

    fn take_event(&mut self, record: &Record, event: &Event, known: &mut Known, fresh: &mut Fresh) {
        let (id, t) = (record.sample.stream.0, self.hub.secs(record.sample.measured));
        if UNTOLD.contains(&record.stream.name.as_str()) {
            if let Some(report) = ClockReport::read(&record.stream, &record.sample.data) {
                self.network.take(t, report);
            }
            return;
        }
        self.events += 1;
        let is_minor = convert::is_minor(event);
        let event = convert::event(self.events, id, t, &record.stream, event);
        let text: Fragment = json(&event).into();
        known.keep(is_minor, id, Arc::clone(&text));
        fresh.events.push((id, is_minor, text));
    }

    fn take_reading(&mut self, record: &Record, t: f64, known: &mut Known, fresh: &mut Fresh) {
        let (id, stream) = (record.sample.stream.0, &record.stream);
        let readout = self.readouts.entry(id).or_insert_with(|| {
            (!stream.channels.is_empty()).then(|| Readout::of(stream)).flatten()
        });
        let Some(readout) = readout else { return };
        let Some(numbers) = readout.read(&record.sample.data) else { return };
        if let Some(track) = known.track(id, false, numbers.len()) {
            track.add(t, numbers.iter().copied());
        }
        let is_own = matches!(record.sample.data, Data::Sample(_));
        let sent = self.sent.entry(id).or_insert([f64::NEG_INFINITY; 2]);
        let mut due = PACES.iter().zip(sent).map(|(pace, sent)| {
            let is_due = t - *sent >= *pace || t < *sent - 60.0;
            if is_due {
                *sent = t;
            }
            is_due
        });
        let (is_drawn, is_shown) = (due.next() == Some(true) || is_own, due.next() == Some(true));
        let values = numbers.iter().copied().map(known_number).collect();
        let sample = Arc::new(crate::wire::Sample { stream: id, t, values });
        if fresh.is_watched && (is_drawn || is_shown) {
            let fragment = json(&*sample).into();
            fresh.readings.push(Reading { stream: id, t, fragment, is_drawn, is_shown });
        }
        known.samples.insert(id, sample);
    }

    /// Reports to a client that its action is among the records.
    fn echo(&mut self, record: &Record, clients: &[Arc<Client>]) {
        let Data::Event(event) = &record.sample.data else { return };
        let acts = [EventKind::Marker, EventKind::Command, EventKind::Report];
        if !acts.contains(&event.kind) || record.stream.name != session_events().name {
            return;
        }
        let at = record.sample.source_time;
        let Some(act) = at.and_then(|at| self.hub.take_awaited(event.kind, at)) else { return };
        let t = self.hub.secs(record.sample.measured);
        let off_secs = act.is_timed.then(|| record.sample.measured.secs_since(act.at));
        let stage = (self.hub.context.disk)().stage;
        self.echoes.add(act, event.label.clone(), (t, off_secs), (stage, clients));
    }
}

/// Returns the camera in whose pictures the points of a stream were found: the stream has positions in pixels, and the
/// camera's stream is its only input.
fn camera_of(stream: &Stream, known: &Known) -> Option<u32> {
    let [input] = stream.inputs.as_slice() else { return None };
    let is_of_points = stream.channels.iter().filter(|channel| channel.unit == "px").count() >= 2;
    let camera = known.named.get(input).filter(|_| is_of_points)?;
    known.streams.get(camera).is_some_and(|it| has_pictures(it)).then_some(*camera)
}

/// Whether the dashboard uses a stream. Messages from which neither a number nor a picture can be read are ignored.
pub fn is_wanted(stream: &Stream) -> bool {
    has_pictures(stream) || has_numbers(stream)
}

/// Whether anything other than pictures is read from a stream.
pub fn has_numbers(stream: &Stream) -> bool {
    let is_opaque = matches!(stream.shape, Shape::Message(_)) && stream.channels.is_empty();
    // Images and sound can't be drawn as lines, but values computed from them can.
    let is_raw = stream.origin == Origin::Raw;
    let is_scene = is_raw && matches!(stream.signal, Signal::Image | Signal::Audio);
    !is_opaque && !has_pictures(stream) && !is_scene
}

/// Hands a client the new data that it may see.
fn offer(client: &Client, fresh: &Fresh, wanted: &BTreeMap<u32, Want>, hidden: &BTreeSet<u32>) {
    let is_blind = client.is_blind();
    let shows = |stream: &u32| !(is_blind && hidden.contains(stream));
    for is_minor in [false, true] {
        let of_kind =
            fresh.events.iter().filter(|(stream, minor, _)| *minor == is_minor && shows(stream));
        let events: Vec<&str> = of_kind.map(|(_, _, text)| &**text).collect();
        if events.is_empty() {
            continue;
        }
        let text = format!(r#"{{"type":"events","events":[{}]}}"#, events.join(","));
        if is_minor {
            client.outbox.minor(text, events.len() as u64);
        } else {
            client.outbox.urgent(text);
        }
    }
    for (kind, stream, t, fragment) in fresh.states.iter().filter(|(_, stream, _, _)| shows(stream))
    {
        client.outbox.state(*kind, *stream, *t, Arc::clone(fragment));
    }
    for reading in fresh.readings.iter().filter(|reading| shows(&reading.stream)) {
        let is_wanted = wanted.contains_key(&reading.stream);
        if is_wanted && reading.is_drawn {
            client.outbox.sample(Arc::clone(&reading.fragment));
        } else if !is_wanted && reading.is_shown {
            let (stream, t) = (reading.stream, reading.t);
            client.outbox.state(StateKind::Sample, stream, t, Arc::clone(&reading.fragment));
        }
    }
    for wave in fresh.waves.iter().filter(|wave| shows(&wave.stream)) {
        if let Some(want) = wanted.get(&wave.stream) {
            client.outbox.wave(Bytes::from(wave.thinned(want.per_sec).encode()));
        }
    }
    for (picture, due) in fresh.pictures.iter().filter(|(picture, _)| shows(&picture.stream)) {
        let Some(want) = wanted.get(&picture.stream) else { continue };
        if *due == Due::Now || (*due == Due::Found) == want.with_points {
            client.outbox.picture(Arc::clone(picture), want.per_sec);
        }
    }
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::Subject;

    use super::*;

    #[test]
    fn what_is_computed_of_a_sound_is_shown_and_the_sound_is_not() {
        let name = "/humans/persons/p1/headset/audio";
        let sound = Stream::raw(name, Subject::person("p1"), Shape::Wave);
        let sound = Stream { signal: Signal::Audio, ..sound.with_channels(&[("audio", "1")]) };
        let voice = Stream::derived(&sound, "voice", Shape::Feature);
        let voice = voice.with_channels(&[("VOICE_Level", "dB")]);
        assert!(!is_wanted(&sound) && is_wanted(&Stream { signal: Signal::Audio, ..voice }));
    }
}
