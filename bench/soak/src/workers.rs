//! The effect on a session of a worker that is slow or dies.

use std::error::Error;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use async_trait::async_trait;
use teampulse_bag::Bag;
use teampulse_core::clock::{Clock, Stopwatch};
use teampulse_core::data::Data;
use teampulse_core::outlet::Outlet;
use teampulse_core::session::{Pace, Session};
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError, Wants};
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{Shape, Stream, Subject};
use teampulse_core::worker::{Fed, Feed, Worker, WorkerError};

use crate::session;

const TOPICS: usize = 8;
/// The time from one reading of each topic to the next.
const PERIOD: Duration = Duration::from_millis(2);
/// How long a slow worker takes for a sample.
const AN_ITEM: Duration = Duration::from_secs(2);
const NUMBERS: &str = "/bench/numbers";

/// Runs a live session with a worker of a kind (`none`, `slow`, `failing`, `panicking`) for this many seconds; prints
/// how long a reading took from its source to a sink, and how many were received and recorded.
pub async fn run(kind: &str, secs: f64) -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let bag = folder.path().join("bag");
    let (began, late_us) = (Stopwatch::start(), Arc::default());
    let readings = (secs / PERIOD.as_secs_f64()) as usize;
    let mut session = session(Box::new(Numbers { began, readings }), &bag)?;
    let worker: Option<Box<dyn Worker>> = match kind {
        "none" => None,
        "slow" => Some(Box::new(Bad::Slow)),
        "failing" => Some(Box::new(Bad::Failing)),
        "panicking" => Some(Box::new(Bad::Panicking)),
        _ => return Err("expected a worker of kind none, slow, failing or panicking".into()),
    };
    session.workers.extend(worker.map(|worker| (kind.to_owned(), worker)));
    session.sinks.push(Box::new(Lateness { began, late_us: Arc::clone(&late_us) }));
    let session = Session { clock: Clock::host(), pace: Pace::Live, ..session };
    let outcome = session.run(std::future::pending()).await;
    if let Some((sink, error)) =
        outcome.sources.is_empty().then(|| outcome.sinks.into_iter().next()).flatten()
    {
        return Err(format!("{sink}: failed to {error}").into());
    }
    let bag = Bag::open(&bag)?;
    let recorded = bag.messages(None).filter(|message| {
        let of = message.as_ref().ok().map(|message| &bag.streams()[message.stream].stream);
        of.is_some_and(|stream| is_ours(stream))
    });
    let recorded = recorded.count();
    let mut late_us = late_us.lock().unwrap_or_else(PoisonError::into_inner).clone();
    late_us.sort_unstable();
    let at = |share: f64| late_us.get((late_us.len() as f64 * share) as usize).unwrap_or(&0);
    println!(
        "{{\"offered\": {}, \"received\": {}, \"recorded\": {recorded}, \"p50_us\": {}, \"p99_us\": {}}}",
        readings * TOPICS,
        late_us.len(),
        at(0.5),
        at(0.99)
    );
    Ok(())
}

fn is_ours(stream: &Stream) -> bool {
    stream.name.strip_prefix(NUMBERS).is_some_and(|rest| !rest.contains('/'))
}

/// Topics whose values are the times when they were offered [µs].
struct Numbers {
    began: Stopwatch,
    readings: usize,
}

#[async_trait]
impl Source for Numbers {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let declare = |k: usize| {
            let name = format!("{NUMBERS}{k}");
            let stream = Stream::raw(name, Subject::robot("bench"), Shape::Sample);
            outlet.declare(stream.with_channels(&[("offered", "1")]))
        };
        let streams: Vec<_> = (0..TOPICS).map(declare).collect();
        let mut ticks = tokio::time::interval(PERIOD);
        for _ in 0..self.readings {
            ticks.tick().await;
            for stream in &streams {
                let data = Data::Sample(Arc::new([self.began.elapsed().as_micros() as f64]));
                let source_time = Some(outlet.clock().now());
                outlet.offer(Reading {
                    index: None,
                    stream: *stream,
                    device_time: None,
                    source_time,
                    data,
                });
            }
        }
        Ok(())
    }
}

/// Records how old each reading is when it arrives.
struct Lateness {
    began: Stopwatch,
    late_us: Arc<Mutex<Vec<u64>>>,
}

impl Sink for Lateness {
    fn name(&self) -> &'static str {
        "lateness"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn wants(&self) -> Wants {
        Wants::Only(Box::new(is_ours))
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        loop {
            let batch = match inbox.receive(Duration::from_secs(1)) {
                Received::Batch(batch) => batch,
                Received::Silence => continue,
                Received::Closed => return Ok(()),
            };
            let now_us = self.began.elapsed().as_micros() as u64;
            let mut late_us = self.late_us.lock().unwrap_or_else(PoisonError::into_inner);
            for record in batch.iter() {
                if let Data::Sample(offered_us) = &record.sample.data {
                    late_us.push(now_us.saturating_sub(offered_us[0] as u64));
                }
            }
        }
    }
}

/// A worker that misbehaves.
enum Bad {
    Slow,
    Failing,
    Panicking,
}

impl Worker for Bad {
    fn wants(&self) -> Wants {
        Wants::Only(Box::new(is_ours))
    }

    fn run(&mut self, feed: &Feed, _: &Outlet) -> Result<(), WorkerError> {
        loop {
            match (feed.next(Duration::from_millis(100)), &self) {
                (Fed::Closed, _) => return Ok(()),
                (Fed::Silence | Fed::Command(_), _) => {}
                (Fed::Records(_), Bad::Slow) => {
                    let began = Stopwatch::start();
                    while began.elapsed() < AN_ITEM && !feed.is_closed() {
                        std::thread::sleep(Duration::from_millis(10));
                    }
                }
                (Fed::Records(_), Bad::Failing) => {
                    return Err(WorkerError { message: "work".into(), hint: String::new() });
                }
                (Fed::Records(_), Bad::Panicking) => panic!("on purpose"),
            }
        }
    }
}
