//! Parts shared by the tests of a session: a recording as a source, and a sink that keeps records.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use async_trait::async_trait;
use bytes::Bytes;
use teampulse_core::data::Data;
use teampulse_core::outlet::Outlet;
use teampulse_core::sample::{Record, Sample};
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{Origin, Shape, Stream};
use teampulse_core::time::Time;

/// Hands over raw readings again, as a bag would.
pub struct Recording(pub Vec<Record>);

#[async_trait]
impl Source for Recording {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        for record in self.0.drain(..) {
            let sample = record.sample;
            if let Data::Description(stream) = &sample.data {
                if stream.origin == Origin::Raw {
                    outlet.declare_at((**stream).clone(), sample.log_time);
                }
                continue;
            }
            if record.stream.origin == Origin::Derived {
                continue;
            }
            let stream = outlet.declare_at((*record.stream).clone(), sample.log_time);
            let reading = Reading {
                index: None,
                stream,
                device_time: sample.device_time,
                source_time: stamp(&record.stream, &sample),
                data: sample.data,
            };
            if outlet.send(reading, sample.log_time).await.is_err() {
                break;
            }
        }
        Ok(())
    }
}

/// Keeps everything, with occasional pauses.
pub struct Keeper {
    pub kept: Arc<Mutex<Vec<Record>>>,
    pub pause: Duration,
}

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
                    self.kept.lock().expect("nobody panicked").extend(batch.iter().cloned());
                    std::thread::sleep(self.pause);
                }
                Received::Silence => {}
                Received::Closed => return Ok(()),
            }
        }
    }
}

/// Encodes a sample.
pub fn encode(sample: &Sample) -> Bytes {
    let Sample { measured, log_time, index, data, .. } = sample;
    Bytes::from(format!("{measured:?} {log_time:?} {index} {data:?}"))
}

/// The stamp of a sample in a bag: the source's own for a message, else when it was measured.
fn stamp(stream: &Stream, sample: &Sample) -> Option<Time> {
    match &stream.shape {
        Shape::Message(_) => sample.source_time,
        _ => Some(sample.measured),
    }
}

/// All derived samples, byte by byte, in order.
pub fn derived(records: &[Record]) -> Vec<(&str, &Bytes)> {
    let computed = records.iter().filter(|record| {
        record.stream.origin == Origin::Derived && record.stream.name != "/teampulse/streams"
    });
    computed.map(|record| (record.stream.name.as_str(), &record.cdr)).collect()
}
