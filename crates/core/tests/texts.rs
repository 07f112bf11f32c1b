//! Text from outside is cut and cleaned before anything else sees it, however long and odd it is.

mod session;

use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use proptest::prelude::*;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs, Scope};
use teampulse_core::outlet::Outlet;
use teampulse_core::sample::{Record, Sample};
use teampulse_core::session::{Pace, Session};
use teampulse_core::session_streams::session_events;
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{Channel, Origin, Schema, Shape, Stream, StreamId, Subject};
use teampulse_core::streams::Streams;
use teampulse_core::text::{LONGEST_LABEL, LONGEST_NAME, LONGEST_PROSE, is_clean, longest_method};
use teampulse_core::time::Time;

use session::{Keeper, Recording, derived, encode};

/// A robot that uses the same text everywhere.
struct Odd(String);

impl Odd {
    fn stream(&self) -> Stream {
        let text = || self.0.clone();
        let schema = Schema { name: text(), encoding: text(), text: text(), hash: text() };
        let shape = Shape::Message(Arc::new(schema));
        Stream {
            device: text(),
            channels: vec![Channel::new(text(), text()), Channel::new(text() + "2", text())],
            inputs: vec![text()],
            method: text(),
            doc: text(),
            ..Stream::raw(text(), Subject::robot(self.0.clone()), shape)
        }
    }
}

#[async_trait]
impl Source for Odd {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let message = outlet.declare_at(self.stream(), Time::from_nanos(1));
        let events = outlet.declare_at(session_events(), Time::from_nanos(1));
        let event = Event {
            kind: EventKind::Marker,
            label: self.0.clone(),
            value: f64::NAN,
            duration_secs: 0.0,
        };
        let cdr = Data::Message(self.0.clone().into_bytes().into());
        let event = Data::Event(Arc::new(event));
        for (secs, stream, data) in
            [(2, events, event.clone()), (3, message, cdr), (9, events, event)]
        {
            let reading =
                Reading { index: None, stream, device_time: None, source_time: None, data };
            outlet.send(reading, Time::from_stamp(secs, 0)).await.expect("the session goes on");
        }
        Ok(())
    }
}

/// Publishes the texts of messages as events.
#[derive(Clone, Default)]
struct ReadOut(Option<OutputId>);

impl Feature for ReadOut {
    fn accepts(&self, stream: &Stream) -> bool {
        matches!(stream.shape, Shape::Message(_))
    }

    fn scope(&self) -> Scope {
        Scope::Stream
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        Box::new(self.clone())
    }
}

impl Extractor for ReadOut {
    fn join(&mut self, _: StreamId, stream: &Stream, out: &mut Outputs) {
        self.0 = Some(out.declare(Stream::derived(stream, "events", Shape::Event)));
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        let (Some(output), Data::Message(bytes)) = (self.0, &sample.data) else { return };
        let label = String::from_utf8_lossy(bytes).into_owned();
        let event = Event { kind: EventKind::Fault, label, value: 0.0, duration_secs: 0.0 };
        out.emit(output, sample.measured, Data::Event(Arc::new(event)));
    }
}

async fn records(source: Box<dyn Source>) -> Vec<Record> {
    let kept = Arc::default();
    let session = Session {
        clock: Clock::settable(),
        pace: Pace::Recorded,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("test".to_owned(), source)],
        features: vec![("read_out", Arc::new(ReadOut::default()))],
        sinks: vec![Box::new(Keeper { kept: Arc::clone(&kept), pause: Duration::ZERO })],
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    session.run(std::future::pending()).await;
    std::mem::take(&mut *kept.lock().expect("nobody panicked"))
}

/// Every text of a stream, with its longest length.
fn texts_of(stream: &Stream) -> Vec<(&str, usize)> {
    let longest = if stream.origin == Origin::Raw { LONGEST_NAME } else { 4 * LONGEST_NAME };
    let names = [&stream.name, &stream.id, &stream.device].into_iter();
    let names = names
        .chain(stream.channels.iter().flat_map(|each| [&each.name, &each.unit]))
        .chain(&stream.inputs);
    let mut texts: Vec<(&str, usize)> = names.map(|text| (text.as_str(), longest)).collect();
    texts.push((stream.method.as_str(), longest_method(stream.channels.len())));
    texts.push((stream.doc.as_str(), LONGEST_PROSE));
    if let Shape::Message(schema) = &stream.shape {
        texts.extend([(schema.name.as_str(), LONGEST_NAME), (schema.hash.as_str(), LONGEST_NAME)]);
    }
    texts
}

fn texts(record: &Record) -> Vec<(&str, usize)> {
    let mut texts = texts_of(&record.stream);
    match &record.sample.data {
        Data::Event(event) => texts.push((&event.label, LONGEST_LABEL)),
        Data::Status(status) => {
            texts.extend([(status.name.as_str(), 2 * LONGEST_NAME)]);
            texts.push((&status.reason, LONGEST_LABEL));
        }
        Data::Description(stream) => texts.extend(texts_of(stream)),
        _ => {}
    }
    texts
}

/// A hundred thousand characters, many of them control characters.
fn long_texts() -> impl Strategy<Value = String> {
    let odd = prop::sample::select(vec![
        '\u{1b}', '\r', '\n', '\0', '\u{9b}', '\u{202e}', '\u{2069}', '\u{61c}', '/', '=', '|', 'ä',
    ]);
    let piece = prop::collection::vec(prop_oneof![any::<char>(), odd], 1..50);
    piece.prop_map(|piece| piece.iter().cycle().take(100_000).collect())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn no_long_or_odd_text_gets_in_and_a_replay_is_the_same(text in long_texts()) {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let run = records(Box::new(Odd(text.clone()))).await;
            let kinds = |record: &&Record| record.stream.shape == Shape::Status;
            prop_assert!(run.iter().filter(kinds).count() > 5, "its health is reported");
            for (found, longest) in run.iter().flat_map(texts) {
                prop_assert!(is_clean(found, longest), "{found:?}");
            }
            let messages = run.iter().filter_map(|record| match &record.sample.data {
                Data::Message(bytes) => Some(bytes),
                _ => None,
            });
            // Messages from elsewhere stay unchanged.
            prop_assert_eq!(messages.collect::<Vec<_>>(), vec![text.as_bytes()]);
            let replay = records(Box::new(Recording(run.clone()))).await;
            prop_assert!(derived(&replay) == derived(&run));
            Ok(())
        })?;
    }
}
