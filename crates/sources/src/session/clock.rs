//! The simulated clock of a session that follows `/clock`.

mod tracker;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use async_trait::async_trait;
use teampulse_core::clock::Clock;
use teampulse_core::outlet::Outlet;
use teampulse_core::simulated_time::{Break, SIMULATED_CLOCK};
use teampulse_core::source::{Source, SourceError};
use teampulse_core::time::Time;
use teampulse_messages::standard::{Message, rosgraph_msgs};
use teampulse_ros::bus::{Arrival, Asked, Bus, BusError, Subscription};

use tracker::ClockTracker;

/// The interval at which the clock is checked.
const LOOK: Duration = Duration::from_millis(20);
/// The largest number of breaks that wait to be reported.
const MOST_BREAKS: usize = 1000;

/// A session's clock that follows `/clock` on a bus, until this is dropped.
///
/// When `/clock` jumps or stops, the session's time continues evenly; while nothing publishes `/clock`, it runs by the
/// host's clock. As a source, this reports each such break as an event of the session.
pub struct SimulatedClock {
    following: Arc<Mutex<Following>>,
    _subscription: Subscription,
}

/// The followed time, with the breaks not yet reported.
struct Following {
    tracker: ClockTracker,
    clock: Clock,
    breaks: Vec<Break>,
}

impl Following {
    fn take(&mut self, (session, news): (Time, Option<Break>)) {
        self.clock.run_ahead(self.tracker.ahead_nanos());
        self.clock.set(session);
        if self.breaks.len() < MOST_BREAKS {
            self.breaks.extend(news);
        }
    }
}

/// Makes a clock follow `/clock` on a bus, and waits until it runs. Returns `None` if nothing publishes `/clock` within
/// `patience`.
pub async fn follow_clock(
    bus: &dyn Bus,
    clock: &Clock,
    patience: Duration,
) -> Result<Option<SimulatedClock>, BusError> {
    let (tracker, breaks) = (ClockTracker::default(), Vec::new());
    let following = Following { tracker, clock: clock.clone(), breaks };
    let following = Arc::new(Mutex::new(following));
    let (followed, host) = (Arc::clone(&following), Clock::host());
    let deliver = Arc::new(move |arrival: Arrival| {
        if let Ok(message) = rosgraph_msgs::Clock::decode(&arrival.bytes) {
            let mut following = lock(&followed);
            let heard = following.tracker.hear(arrival.publisher, message.clock, host.now());
            following.take(heard);
        }
    });
    let asked = Asked::Adaptive { depth: 1 };
    let subscription =
        bus.subscribe(SIMULATED_CLOCK, rosgraph_msgs::Clock::NAME, asked, deliver)?;
    let running = async {
        while clock.now() == Time::EPOCH {
            tokio::time::sleep(LOOK).await;
        }
    };
    let is_running = tokio::time::timeout(patience, running).await.is_ok();
    Ok(is_running.then_some(SimulatedClock { following, _subscription: subscription }))
}

#[async_trait]
impl Source for SimulatedClock {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let host = Clock::host();
        loop {
            let breaks = {
                let mut following = lock(&self.following);
                let looked = following.tracker.look(host.now());
                following.take(looked);
                std::mem::take(&mut following.breaks)
            };
            for each in &breaks {
                report(outlet, *each);
            }
            tokio::select! {
                () = tokio::time::sleep(LOOK) => {}
                () = outlet.closed() => return Ok(()),
            }
        }
    }
}

fn report(outlet: &Outlet, what: Break) {
    let event = what.event();
    tracing::warn!("{}", event.label);
    outlet.happen(event);
}

fn lock(following: &Mutex<Following>) -> MutexGuard<'_, Following> {
    following.lock().unwrap_or_else(PoisonError::into_inner)
}
