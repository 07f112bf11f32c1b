//! Hours of a recording, processed as fast as possible.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use teampulse_bag::Bag;
use teampulse_core::data::Data;
use teampulse_core::session::Session;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError, Wants};
use teampulse_core::stream::Shape;
use teampulse_core::time::Time;
use teampulse_dashboard::{Addresses, Context, Dashboard, Settings};

use crate::continued::Continued;
use crate::session;

const HOUR_SECS: f64 = 3600.0;

/// Repeats a recording until this many hours have passed in it; prints a line for each.
pub async fn run(bag: &Path, hours: f64) -> Result<(), Box<dyn Error>> {
    let bag = Arc::new(Bag::open(bag)?);
    let (began, _) = bag.bounds().ok_or("the bag is empty")?;
    let folder = tempfile::tempdir()?;
    let source = Continued { bag, secs: hours * HOUR_SECS, speed: None };
    let mut session = session(Box::new(source), &folder.path().join("bag"))?;
    session.sinks.push(Box::new(HourlyMemory { began }));
    end(session).await
}

/// Repeats a recording, this many times as fast as it was recorded, on a dashboard alone; prints its address, and a
/// line for each hour.
pub async fn watched(bag: &Path, hours: f64, speed: f64) -> Result<(), Box<dyn Error>> {
    let bag = Arc::new(Bag::open(bag)?);
    let (began, _) = bag.bounds().ok_or("the bag is empty")?;
    let folder = tempfile::tempdir()?;
    let source = Continued { bag, secs: hours * HOUR_SECS, speed: Some(speed) };
    let mut session = session(Box::new(source), folder.path())?;
    session.clock.set(began);
    let announce = |at: &Addresses| println!("{{\"address\": \"{}\"}}", at.here);
    let context =
        Context { announce: Arc::new(announce), ..Context::new("soak", session.clock.clone()) };
    let dashboard = Dashboard::new(context, Settings::default());
    session.sinks = vec![Box::new(dashboard), Box::new(HourlyMemory { began })];
    end(session).await
}

/// Runs a session to its end.
async fn end(session: Session) -> Result<(), Box<dyn Error>> {
    let outcome = session.run(std::future::pending()).await;
    if let Some((source, error)) = outcome.sources.into_iter().next() {
        return Err(format!("{source}: failed to {error}").into());
    }
    match outcome.sinks.into_iter().next() {
        Some((sink, error)) => Err(format!("{sink}: failed to {error}").into()),
        None => Ok(()),
    }
}

/// Prints the smallest and the largest memory of the process within each hour of the recording, checked every minute.
struct HourlyMemory {
    began: Time,
}

impl Sink for HourlyMemory {
    fn name(&self) -> &'static str {
        "watch"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn wants(&self) -> Wants {
        Wants::Only(Box::new(|stream| stream.shape == Shape::Status))
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let (mut hours, mut minutes, mut held_kib) = (0, 0, Vec::new());
        loop {
            let batch = match inbox.receive(std::time::Duration::from_secs(1)) {
                Received::Batch(batch) => batch,
                Received::Silence => continue,
                Received::Closed => return Ok(()),
            };
            let Some(record) = batch.last() else { continue };
            debug_assert!(matches!(record.sample.data, Data::Status(_)), "it wants nothing else");
            let passed = (record.sample.log_time.secs_since(self.began) / 60.0) as u32;
            if passed == minutes {
                continue;
            }
            minutes = passed;
            held_kib.push(resident_kib());
            if minutes / 60 > hours {
                hours = minutes / 60;
                let (least, most) = (held_kib.iter().min(), held_kib.iter().max());
                let (least, most) = (least.unwrap_or(&0), most.unwrap_or(&0));
                println!("{{\"hour\": {hours}, \"least_kib\": {least}, \"most_kib\": {most}}}");
                held_kib.clear();
            }
        }
    }
}

/// Returns the memory of this process, without the files that it has mapped [KiB]; 0 if the system does not report it.
fn resident_kib() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("RssAnon:"));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}
