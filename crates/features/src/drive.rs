//! Drives an extractor through time, for the tests.

use teampulse_core::data::{Data, Event, FeatureValues};
use teampulse_core::feature::{Extractor, Feature, Outputs, StandaloneExtractor};
use teampulse_core::registry::Component;
use teampulse_core::sample::{Sample, Turn};
use teampulse_core::stream::{Shape, Signal, Stream, StreamId, Subject};
use teampulse_core::time::Time;
use teampulse_messages::catalogue::shipped;
use teampulse_messages::standard::Message;

use crate::context::FeatureContext;

const TICK_NS: i64 = 100_000_000;

/// An extractor with one input, in a session that begins at 0 s.
pub(crate) struct Drive {
    extractor: Box<dyn Extractor>,
    out: Outputs,
    next_tick_ns: i64,
}

/// The feature with these settings, in a study with windows of 30 s.
pub(crate) fn built<S: Component<dyn Feature, FeatureContext>>(settings: &str) -> Box<dyn Feature> {
    let settings: S = toml::from_str(settings).expect("settings that read");
    settings
        .build(&FeatureContext { windows_secs: vec![30.0], ..FeatureContext::default() })
        .expect("settings that build")
}

/// The extractor of a feature, outside of a session.
pub(crate) fn alone(feature: &dyn Feature, stream: &Stream) -> Box<dyn Extractor> {
    Box::new(StandaloneExtractor::new(feature.start(stream)))
}

/// A stream of the robot `r1` whose samples are plain numbers.
pub(crate) fn plain(name: &str, signal: Signal, channels: &[(&str, &str)]) -> Stream {
    let stream = Stream::raw(name, Subject::robot("r1"), Shape::Sample).with_channels(channels);
    Stream { signal, ..stream }
}

/// A stream of the robot `r1` whose samples are messages of type `M`.
pub(crate) fn messages<M: Message>(
    name: &str,
    signal: Signal,
    channels: &[(&str, &str)],
) -> Stream {
    let schema = shipped(M::NAME).expect("a type whose definition is shipped");
    let stream = Stream::raw(name, Subject::robot("r1"), Shape::Message(schema));
    Stream { signal, ..stream.with_channels(channels) }
}

pub(crate) fn time(secs: f64) -> Time {
    Time::from_nanos((secs * 1e9).round() as i64)
}

impl Drive {
    pub(crate) fn new(feature: &dyn Feature, stream: &Stream) -> Drive {
        assert!(feature.accepts(stream));
        let mut out = Outputs::new();
        let mut extractor = alone(feature, stream);
        extractor.join(StreamId(0), stream, &mut out);
        Drive { extractor, out, next_tick_ns: 0 }
    }

    /// Adds another input of the same extractor.
    pub(crate) fn join(&mut self, id: StreamId, stream: &Stream) {
        self.extractor.join(id, stream, &mut self.out);
    }

    /// Pushes data of an input, measured and taken at `secs`.
    pub(crate) fn take_on(&mut self, id: StreamId, secs: f64, data: Data) {
        self.until(secs);
        let sample = Sample { stream: id, ..sample(secs, secs, data) };
        self.extractor.push(&sample, &mut self.out);
    }

    /// The outputs that were declared.
    pub(crate) fn outputs(&self) -> &[Stream] {
        self.out.streams()
    }

    /// Pushes numbers measured and taken at `secs`.
    pub(crate) fn at(&mut self, secs: f64, numbers: &[f64]) {
        self.take(secs, Data::Sample(numbers.into()));
    }

    /// Pushes data measured and taken at `secs`.
    pub(crate) fn take(&mut self, secs: f64, data: Data) {
        self.until(secs);
        self.extractor.push(&sample(secs, secs, data), &mut self.out);
    }

    /// Pushes numbers measured at `secs` and taken now.
    pub(crate) fn late(&mut self, secs: f64, numbers: &[f64]) {
        let now_secs = self.next_tick_ns as f64 / 1e9;
        let late = sample(secs, now_secs, Data::Sample(numbers.into()));
        self.extractor.push_late(&late, &mut self.out);
    }

    /// Lets time pass until `secs` while teampulse itself is suspended.
    pub(crate) fn stood_still(&mut self, secs: f64) {
        self.extractor.stood_still(time(secs));
    }

    /// Runs all ticks up to `secs`.
    pub(crate) fn until(&mut self, secs: f64) {
        while self.next_tick_ns <= time(secs).nanos() {
            self.extractor.tick(Time::from_nanos(self.next_tick_ns), &mut self.out);
            self.next_tick_ns += TICK_NS;
        }
    }

    /// All samples of the stream with this name, with their times [s].
    pub(crate) fn data(&mut self, name: &str) -> Vec<(f64, Data)> {
        let known = self.out.streams().iter().find(|stream| stream.name == name).cloned();
        let id = self.out.declare(known.expect("a declared output"));
        let of_stream = self.out.samples().filter(|(stream, ..)| *stream == id);
        of_stream.map(|(_, measured, data)| (measured.secs(), data.clone())).collect()
    }

    /// The outputs that were declared.
    pub(crate) fn streams(&self) -> &[Stream] {
        self.out.streams()
    }

    pub(crate) fn features(&mut self, name: &str) -> Vec<(f64, FeatureValues)> {
        let values =
            |data| if let Data::Feature(values) = data { (*values).clone() } else { panic!() };
        self.data(name).into_iter().map(|(secs, data)| (secs, values(data))).collect()
    }

    pub(crate) fn last(&mut self, name: &str) -> FeatureValues {
        self.features(name).pop().expect("at least one window").1
    }

    pub(crate) fn events(&mut self, name: &str) -> Vec<(f64, Event)> {
        let event = |data| if let Data::Event(event) = data { (*event).clone() } else { panic!() };
        self.data(name).into_iter().map(|(secs, data)| (secs, event(data))).collect()
    }

    pub(crate) fn labels(&mut self, name: &str) -> Vec<String> {
        self.events(name).into_iter().map(|(_, event)| event.label).collect()
    }
}

fn sample(measured_secs: f64, log_secs: f64, data: Data) -> Sample {
    Sample {
        stream: StreamId(0),
        measured: time(measured_secs),
        log_time: time(log_secs),
        device_time: None,
        source_time: None,
        period_ns: 0.0,
        index: 0,
        turn: Turn::OnTime,
        data,
    }
}
