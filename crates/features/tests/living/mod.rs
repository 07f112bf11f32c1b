//! A simulated body in a session: its sensors are a source, and all results are kept.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use async_trait::async_trait;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::data::{Data, Event, EventKind, Wave};
use teampulse_core::feature::Feature;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::Settings as Own;
use teampulse_core::sample::Record;
use teampulse_core::session::{NamedFeature, Pace, Session};
use teampulse_core::session_streams::{END, session_events};
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{About, Shape, Signal, Stream, StreamId, Subject};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_emulators::body::{Body, Sensor, Settings, Traits, Wave as Recorded};
use teampulse_features::FEATURES;
use teampulse_features::context::FeatureContext;
use teampulse_messages::convert::encode;

/// When the session begins [s].
const START_SECS: i32 = 1_700_000_000;
/// How much of each signal is handed over at once [s].
const CHUNK_SECS: f64 = 0.25;

/// The samples that one sensor hands over at once.
pub struct Chunk {
    sensor: Sensor,
    at: Time,
    first: Time,
    data: Data,
}

/// Where the sensors of the person are.
pub const WORN: &str = "/humans/persons/p1/worn/";

/// The name of a sensor's stream.
pub fn name(sensor: Sensor) -> String {
    format!("{WORN}{}", format!("{sensor:?}").to_lowercase())
}

/// The samples of a body's sensors for this many seconds, at a workload that rises after the first
/// phase.
pub fn lived(settings: &Settings, phases: &[(&str, f64)], secs: f64) -> Vec<Chunk> {
    let mut body = Body::wearing(&Traits::of_seed(3), 3, settings).expect("settings that can be");
    let mut chunks = Vec::new();
    for number in 1..=(secs / CHUNK_SECS) as u32 {
        let now_secs = f64::from(number) * CHUNK_SECS;
        if phases.get(1).is_some_and(|(_, from_secs)| now_secs > *from_secs) {
            body.state(1.0, 1.0, 0.5);
        }
        let record = body.until(now_secs);
        // A dead sensor gives no samples.
        let comes = |wave: &&Recorded| wave.samples.iter().any(|sample| sample.is_finite());
        for wave in record.waves().filter(comes) {
            let data = Data::Wave(Wave {
                period_ns: 1e9 / wave.rate_hz,
                channels: wave.sensor.channels().len() as u32,
                samples: wave.samples.as_slice().into(),
            });
            let (at, first) = (after(now_secs), after(wave.first_secs()));
            chunks.push(Chunk { sensor: wave.sensor, at, first, data });
        }
    }
    chunks
}

/// This long after the session's start.
pub fn after(secs: f64) -> Time {
    Time::from_stamp(START_SECS, 0) + Duration::from_secs_f64(secs)
}

/// All results of these samples, with all features in windows of 30 s.
pub fn kept(chunks: Vec<Chunk>, phases: &[(&str, f64)]) -> Vec<Record> {
    let phases = phases.iter().map(|(name, secs)| ((*name).to_owned(), *secs)).collect();
    heard(Box::new(Worn { chunks, phases }), |_| true)
}

/// All results of a source, with the features of these kinds in windows of 30 s.
pub fn heard(source: Box<dyn Source>, is_wanted: fn(&str) -> bool) -> Vec<Record> {
    let kept = Arc::new(Mutex::new(Vec::new()));
    let session = Session {
        clock: Clock::settable(),
        pace: Pace::Recorded,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("body".into(), source)],
        features: features(is_wanted),
        sinks: vec![Box::new(Keeper(Arc::clone(&kept)))],
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build();
    let outcome = runtime.expect("a runtime").block_on(session.run(std::future::pending()));
    assert!(outcome.sinks.is_empty() && outcome.dropped == 0);
    std::mem::take(&mut kept.lock().expect("nobody panicked"))
}

fn features(is_wanted: fn(&str) -> bool) -> Vec<NamedFeature> {
    let context = FeatureContext { windows_secs: vec![30.0], ..FeatureContext::default() };
    let build = |entry: &teampulse_core::registry::Entry<dyn Feature, FeatureContext>| {
        let built = (entry.build)(Own::empty(), &context);
        (entry.kind, Arc::from(built.expect("a feature without settings")))
    };
    FEATURES.iter().filter(|entry| is_wanted(entry.kind)).map(build).collect()
}

struct Worn {
    chunks: Vec<Chunk>,
    phases: Vec<(String, f64)>,
}

#[async_trait]
impl Source for Worn {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let worn = |sensor| outlet.declare_at(stream(sensor), after(0.0));
        let streams = Sensor::ALL.map(worn);
        let events = outlet.declare_at(session_events(), after(0.0));
        let mut phases = self.phases.drain(..).peekable();
        let mut last = after(0.0);
        for Chunk { sensor, at, first, data } in self.chunks.drain(..) {
            while let Some((label, secs)) = phases.next_if(|(_, secs)| after(*secs) <= at) {
                hand_over(happens(events, EventKind::Phase, label, after(secs)), at, outlet).await;
            }
            last = at;
            let place = Sensor::ALL.iter().position(|each| *each == sensor).expect("a sensor");
            let stream = streams[place];
            let reading =
                Reading { index: None, stream, device_time: None, source_time: Some(first), data };
            hand_over(reading, at, outlet).await;
        }
        hand_over(happens(events, EventKind::Clock, END.to_owned(), last), last, outlet).await;
        Ok(())
    }
}

/// Hands over a reading at a time.
pub async fn hand_over(reading: Reading, at: Time, outlet: &Outlet) {
    assert!(outlet.send(reading, at).await.is_ok(), "the session has ended");
}

fn happens(stream: StreamId, kind: EventKind, label: String, at: Time) -> Reading {
    let event = Event { kind, label, value: f64::NAN, duration_secs: f64::NAN };
    let data = Data::Event(Arc::new(event));
    Reading { index: None, stream, device_time: None, source_time: Some(at), data }
}

/// The stream of a sensor of the person.
pub fn stream(sensor: Sensor) -> Stream {
    let signal = match sensor {
        Sensor::Ecg => Signal::Ecg,
        Sensor::Ppg => Signal::Ppg,
        Sensor::EdaWrist | Sensor::EdaFingers => Signal::Eda,
        Sensor::Emg => Signal::Emg,
        Sensor::Eeg => Signal::Eeg,
        Sensor::Respiration => Signal::Respiration,
        Sensor::Temperature => Signal::Temperature,
        Sensor::Acceleration => Signal::Acceleration,
    };
    let person = Subject { about: About::Person, id: "p1".into() };
    let channels: Vec<_> = sensor.channels().iter().map(|name| (*name, sensor.unit())).collect();
    let stream = Stream::raw(name(sensor), person, Shape::Wave).with_channels(&channels);
    Stream { signal, rate_hz: sensor.usual_rate_hz(), ..stream }
}

struct Keeper(Arc<Mutex<Vec<Record>>>);

impl Sink for Keeper {
    fn name(&self) -> &'static str {
        "keeper"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        loop {
            match inbox.receive(Duration::from_secs(1)) {
                Received::Batch(batch) => {
                    self.0.lock().expect("nobody panicked").extend(batch.iter().cloned());
                }
                Received::Silence => {}
                Received::Closed => return Ok(()),
            }
        }
    }
}
