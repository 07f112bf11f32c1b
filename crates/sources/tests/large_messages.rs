//! A large message, such as an image, reaches sinks and workers without being copied.

mod keeper;

use std::sync::{Arc, Mutex};
use std::time::Duration;

use async_trait::async_trait;
use bytes::Bytes;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::data::Data;
use teampulse_core::outlet::Outlet;
use teampulse_core::sample::Record;
use teampulse_core::session::{Pace, Session};
use teampulse_core::sink::Wants;
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{Schema, Shape, Signal, Stream, Subject};
use teampulse_core::streams::Streams;
use teampulse_core::worker::{Fed, Feed, Worker, WorkerError};
use teampulse_messages::catalogue;
use teampulse_messages::convert::encode;

use keeper::Keeper;

const CAMERA: &str = "/humans/persons/p001/webcam/image";

/// Offers one frame as the `sensor_msgs/CompressedImage` that it was encoded as, and waits until the worker has
/// processed it.
struct Camera {
    frame: Bytes,
    looked: Arc<Mutex<Vec<Record>>>,
}

#[async_trait]
impl Source for Camera {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let schema = catalogue::shipped("sensor_msgs/msg/CompressedImage");
        let schema = schema.map_or_else(unknown, |schema| Schema::clone(&schema));
        let stream = Stream::raw(CAMERA, Subject::session(), Shape::Message(Arc::new(schema)));
        let stream = outlet.declare(Stream { signal: Signal::Image, ..stream });
        let (source_time, data) = (Some(outlet.clock().now()), Data::Message(self.frame.clone()));
        outlet.offer(Reading { index: None, stream, device_time: None, source_time, data });
        while self.looked.lock().expect("nobody panicked").is_empty() {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
        Ok(())
    }
}

fn unknown() -> Schema {
    Schema {
        name: "sensor_msgs/msg/CompressedImage".into(),
        encoding: "ros2msg".into(),
        text: String::new(),
        hash: String::new(),
    }
}

/// Keeps the records that it receives.
struct Looking(Arc<Mutex<Vec<Record>>>);

impl Worker for Looking {
    fn wants(&self) -> Wants {
        Wants::Only(Box::new(|stream| stream.signal == Signal::Image))
    }

    fn run(&mut self, feed: &Feed, _outlet: &Outlet) -> Result<(), WorkerError> {
        loop {
            match feed.next(Duration::from_secs(1)) {
                Fed::Records(records) => self.0.lock().expect("nobody panicked").extend(records),
                Fed::Silence | Fed::Command(_) => {}
                Fed::Closed => return Ok(()),
            }
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_bytes_that_a_source_offers_are_those_that_sinks_and_workers_are_given() {
    let frame = Bytes::from([&[0, 1, 0, 0][..], &vec![7; 1 << 20]].concat());
    let (kept, looked) =
        (Arc::<Mutex<Vec<Record>>>::default(), Arc::<Mutex<Vec<Record>>>::default());
    let camera = Camera { frame: frame.clone(), looked: Arc::clone(&looked) };
    let session = Session {
        clock: Clock::host(),
        pace: Pace::Live,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("camera".into(), Box::new(camera))],
        features: Vec::new(),
        sinks: vec![Box::new(Keeper(Arc::clone(&kept)))],
        workers: vec![("looking".into(), Box::new(Looking(Arc::clone(&looked))))],
        encode,
        commands: Commands::default(),
    };
    session.run(std::future::pending()).await;
    for records in [kept, looked] {
        let records = records.lock().expect("nobody panicked");
        let mut of_camera = records.iter().filter(|record| record.stream.name == CAMERA);
        let record = of_camera.next().expect("the frame came");
        let Data::Message(data) = &record.sample.data else { panic!("{:?}", record.stream.shape) };
        assert_eq!([data.as_ptr(), record.cdr.as_ptr()], [frame.as_ptr(); 2]);
        assert_eq!(record.cdr.len(), frame.len());
    }
}
