//! Measures what long and large recordings cost at full speed:
//!
//! - `bench-soak hours BAG HOURS` repeats a recording until this many hours are recorded, through all features into a
//!   bag that is flushed as often as live, with its tidy files; prints the memory of the process after each hour;
//! - `bench-soak watched BAG HOURS SPEED` shows this on a dashboard, this many times as fast as it was recorded;
//! - `bench-soak endpoints ROBOTS` makes this many robots come, leave and come again, and prints the processor time for
//!   each of their endpoints;
//! - `bench-soak topics COUNT` records a bag of this many topics and replays it, and prints the processor time of both;
//! - `bench-soak worker KIND SECS` runs a live session with a worker that is slow, fails or panics, and prints how long
//!   readings took to a sink, and how many were received and recorded.
#![expect(clippy::print_stdout, reason = "the figures are its output")]

mod continued;
mod endpoints;
mod hours;
mod topics;
mod workers;

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use rustix::time::{ClockId, clock_gettime};
use teampulse_bag::{BagSink, Options};
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::feature::Feature;
use teampulse_core::registry::Settings;
use teampulse_core::session::{Pace, Session};
use teampulse_core::sink::Sink;
use teampulse_core::source::Source;
use teampulse_core::streams::Streams;
use teampulse_features::FEATURES;
use teampulse_features::context::FeatureContext;
use teampulse_messages::convert::encode;
use teampulse_sinks::{SINKS, SinkContext};

/// The allocator of the program itself.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words.as_slice() {
        ["hours", bag, hours] => hours::run(Path::new(bag), hours.parse()?).await,
        ["watched", bag, hours, speed] => {
            hours::watched(Path::new(bag), hours.parse()?, speed.parse()?).await
        }
        ["endpoints", robots] => endpoints::run(robots.parse()?).await,
        ["topics", count] => topics::run(count.parse()?).await,
        ["worker", kind, secs] => workers::run(kind, secs.parse()?).await,
        _ => {
            Err("usage: bench-soak hours BAG HOURS | watched BAG HOURS SPEED | endpoints ROBOTS | topics COUNT | worker KIND SECS".into())
        }
    }
}

/// Creates a session from a recording, with all features, into a bag with its tidy files.
fn session(source: Box<dyn Source>, folder: &Path) -> Result<Session, Box<dyn Error>> {
    let clock = Clock::settable();
    let context = SinkContext::new(folder, "soak", clock.clone());
    let options = Options { session: "soak".into(), clock: clock.clone(), ..Options::default() };
    let bag = BagSink { folder: folder.to_owned(), study: String::new(), options };
    let mut sinks: Vec<Box<dyn Sink>> = vec![Box::new(bag)];
    for entry in SINKS.iter().filter(|entry| entry.kind == "tidy") {
        sinks.push((entry.build)(Settings::empty(), &context)?);
    }
    Ok(Session {
        clock,
        pace: Pace::Recorded,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("recording".into(), source)],
        features: features()?,
        sinks,
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    })
}

/// Features by kind.
type Features = Vec<(&'static str, Arc<dyn Feature>)>;

/// Builds all features with their default settings.
fn features() -> Result<Features, Box<dyn Error>> {
    let built = FEATURES.iter().map(|entry| {
        let feature = (entry.build)(Settings::empty(), &FeatureContext::default())?;
        Ok((entry.kind, Arc::from(feature)))
    });
    built.collect()
}

/// Returns the processor time that this process has used so far, in user and kernel mode [s].
fn cpu_secs() -> f64 {
    let used = clock_gettime(ClockId::ProcessCPUTime);
    used.tv_sec as f64 + used.tv_nsec as f64 / 1e9
}
