//! Streams with an audience of their own reach the sinks that may show them, and no others.

mod session;

use std::future::pending;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use async_trait::async_trait;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::data::Data;
use teampulse_core::outlet::Outlet;
use teampulse_core::sample::Record;
use teampulse_core::session::{Pace, Session};
use teampulse_core::sink::{Delivery, Inbox, Sink, SinkError};
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{Audience, Shape, Stream, Subject};
use teampulse_core::streams::Streams;

use session::{Keeper, Recording, derived, encode};

const SECRET: &str = "/cameras/door/image_raw/compressed";
const HIDDEN: &str = "/cameras/yard/image_raw/compressed";
const OPEN: &str = "/r1/number";

type Kept = Arc<Mutex<Vec<Record>>>;

/// Numbers of three streams in turn, one of which is live only and one for workers only.
struct Three;

#[async_trait]
impl Source for Three {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let open = Stream::raw(OPEN, Subject::robot("r1"), Shape::Sample);
        let secret = Stream::raw(SECRET, Subject::team(), Shape::Sample);
        let hidden = Stream::raw(HIDDEN, Subject::team(), Shape::Sample);
        let secret = Stream { audience: Audience::Live, ..secret };
        let streams = [open, secret, Stream { audience: Audience::Workers, ..hidden }];
        let streams = streams.map(|stream| outlet.declare(stream));
        for number in 0..100 {
            for stream in streams {
                let data = Data::Sample(Arc::new([f64::from(number)]));
                outlet.offer(Reading {
                    index: None,
                    stream,
                    device_time: None,
                    source_time: None,
                    data,
                });
            }
            tokio::task::yield_now().await;
        }
        Ok(())
    }
}

/// A screen.
struct Screen(Keeper);

impl Sink for Screen {
    fn name(&self) -> &'static str {
        "screen"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn shows_live(&self) -> bool {
        true
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        Box::new(self.0).run(inbox)
    }
}

fn count(kept: &Kept, name: &str) -> usize {
    let kept = kept.lock().expect("nobody panicked");
    let is_number = |record: &&Record| matches!(record.sample.data, Data::Sample(_));
    kept.iter().filter(is_number).filter(|record| record.stream.name == name).count()
}

#[tokio::test]
async fn what_is_not_for_everybody_is_shown_at_most_and_not_kept() {
    let (kept, shown) = (Kept::default(), Kept::default());
    let keeper = |kept: &Kept| Keeper { kept: Arc::clone(kept), pause: Duration::ZERO };
    let session = |source: Box<dyn Source>, sinks: Vec<Box<dyn Sink>>| Session {
        clock: Clock::host(),
        pace: Pace::Recorded,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("three".to_owned(), source)],
        features: Vec::new(),
        sinks,
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    let sinks: Vec<Box<dyn Sink>> = vec![Box::new(keeper(&kept)), Box::new(Screen(keeper(&shown)))];
    let outcome = session(Box::new(Three), sinks).run(pending()).await;
    assert!(outcome.sources.is_empty() && outcome.sinks.is_empty(), "{outcome:?}");
    let counts = |kept| [OPEN, SECRET, HIDDEN].map(|name| count(kept, name));
    assert_eq!(counts(&shown), [100, 100, 0]);
    assert_eq!(counts(&kept), [100, 0, 0]);

    // What was recorded is shown again.
    let (recorded, again) = (std::mem::take(&mut *kept.lock().unwrap()), Kept::default());
    let sinks: Vec<Box<dyn Sink>> = vec![Box::new(keeper(&again))];
    session(Box::new(Recording(recorded.clone())), sinks).run(pending()).await;
    let again = again.lock().unwrap();
    assert_eq!(derived(&again), derived(&recorded));
}
