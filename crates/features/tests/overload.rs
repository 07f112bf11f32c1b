//! One publisher can't hold up a session: its excess samples are recorded, but not used for features.
#![expect(clippy::unwrap_used, reason = "a test")]

use std::sync::{Arc, Mutex};
use std::time::Duration;

use async_trait::async_trait;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::data::{Data, Wave};
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::Settings;
use teampulse_core::session::{Pace, Session};
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::status::State;
use teampulse_core::stream::{About, Shape, Signal, Stream, Subject};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_features::FEATURES;
use teampulse_features::context::FeatureContext;
use teampulse_messages::convert::encode;

const WAVES: i64 = 1500;
const BEGIN: Time = Time::from_stamp(1_700_000_000, 0);

/// A sensor whose waves overlap: 62,500 or 2000 samples a second, declared as 1000.
struct Overlapping {
    /// The rate in its description [Hz].
    declared_hz: f64,
    /// The period of its waves [ns].
    period_ns: f64,
    /// The samples of each wave; there are a hundred waves a second.
    samples: i32,
}

#[async_trait]
impl Source for Overlapping {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let subject = Subject { about: About::Person, id: "p1".into() };
        let name = "/humans/persons/p1/strap/ecg";
        let stream = Stream::raw(name, subject, Shape::Wave).with_channels(&[("ecg", "mV")]);
        let stream = Stream { signal: Signal::Ecg, rate_hz: self.declared_hz, ..stream };
        let stream = outlet.declare_at(stream, BEGIN);
        for number in 0..WAVES {
            let samples: Arc<[f64]> = (0..self.samples).map(|k| f64::from(k % 97)).collect();
            let wave = Wave { period_ns: self.period_ns, channels: 1, samples };
            let data = Data::Wave(wave);
            let reading =
                Reading { stream, device_time: None, source_time: None, index: None, data };
            let arrival = BEGIN + Duration::from_millis(10) * number as u32;
            outlet.send(reading, arrival).await.expect("the session goes on");
        }
        Ok(())
    }
}

/// Counts the waves, and keeps the last reason for which the stream is degraded.
#[derive(Clone, Default)]
struct Seen(Arc<Mutex<(i64, String)>>);

impl Sink for Seen {
    fn name(&self) -> &'static str {
        "seen"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        loop {
            match inbox.receive(Duration::from_secs(1)) {
                Received::Batch(batch) => {
                    let mut seen = self.0.lock().unwrap();
                    for record in batch.iter() {
                        match &record.sample.data {
                            Data::Wave(_) => seen.0 += 1,
                            Data::Status(status) if status.state == State::Degraded => {
                                seen.1.clone_from(&status.reason);
                            }
                            _ => {}
                        }
                    }
                }
                Received::Silence => {}
                Received::Closed => return Ok(()),
            }
        }
    }
}

async fn seen(source: Overlapping) -> (i64, String) {
    let built = FEATURES.iter().map(|entry| {
        let feature = (entry.build)(Settings::empty(), &FeatureContext::default());
        (entry.kind, Arc::from(feature.unwrap()))
    });
    let seen = Seen::default();
    let session = Session {
        clock: Clock::settable(),
        pace: Pace::Recorded,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("test".into(), Box::new(source))],
        features: built.collect(),
        sinks: vec![Box::new(seen.clone())],
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    session.run(std::future::pending()).await;
    let seen = seen.0.lock().unwrap();
    seen.clone()
}

/// All features together would take hours.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn overlapping_waves_are_recorded_and_counted_but_not_all_analysed() {
    let source = Overlapping { declared_hz: 1000.0, period_ns: 1e6, samples: 625 };
    let (waves, reason) = seen(source).await;
    assert_eq!(waves, WAVES);
    assert!(reason.contains("samples were not used for features"), "{reason}");
}

/// Would take all memory, or forever, if it were trusted.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_absurd_rate_is_not_believed() {
    for (declared_hz, period_ns) in [(1e12, 1e6), (f64::NAN, 1e6), (1e5, 4.7e8), (1000.0, 0.0)] {
        assert_eq!(seen(Overlapping { declared_hz, period_ns, samples: 625 }).await.0, WAVES);
    }
}

/// Neither refused nor cut back: two thousand samples a second are cheap to process.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn waves_that_overlap_a_little_are_marked_with_both_rates() {
    let source = Overlapping { declared_hz: 1000.0, period_ns: 1e6, samples: 20 };
    let (waves, reason) = seen(source).await;
    assert_eq!(waves, WAVES);
    assert_eq!(reason, "its waves overlap: 2000 samples/s arrive instead of the stated 1000/s");
}
