use std::time::Duration;

use super::{HeartRateReceiver, MEASUREMENT};
use crate::gatt::{Request, Uuid};
use crate::outbox::Outbox;
use crate::standard::StandardServices;
use crate::watchdog::Watchdog;
use crate::{Error, Event, GattSession, Output, Session};

const PATIENCE: Duration = Duration::from_secs(5);
const MOST_RESTARTS: u32 = 3;

/// A session with any strap that has the Heart Rate service.
#[derive(Debug, Default)]
pub struct HeartRateSession {
    out: Outbox<Request>,
    standard: StandardServices,
    heart_rate: HeartRateReceiver,
    watchdog: Option<Watchdog>,
    restarts: u32,
}

impl HeartRateSession {
    /// Creates a session that has not started.
    pub fn new() -> Self {
        Self::default()
    }

    fn end(&mut self, result: Result<(), Error>) {
        self.watchdog = None;
        self.out.done(result);
    }
}

impl Session for HeartRateSession {
    type Request = Request;

    fn start(&mut self, now: Duration) {
        self.out.reopen();
        self.watchdog = Some(Watchdog::new(now, PATIENCE));
        self.restarts = 0;
        self.heart_rate.start(&mut self.out);
        self.heart_rate.expect_intervals(&mut self.out);
        self.standard.start(&mut self.out);
    }

    fn tick(&mut self, now: Duration) {
        let Some(watchdog) = self.watchdog.as_mut().filter(|dog| dog.has_expired(now)) else {
            return;
        };
        self.out.event(Event::Stalled { stream: "heart_rate", quiet: watchdog.quiet(now) });
        if self.restarts == MOST_RESTARTS {
            return self.end(Err(Error::Silent("heart_rate")));
        }
        self.restarts += 1;
        *watchdog = Watchdog::new(now, PATIENCE);
        self.out.request(Request::Subscribe(MEASUREMENT));
    }

    fn next_tick(&self) -> Option<Duration> {
        self.watchdog.map(|watchdog| watchdog.deadline())
    }

    fn stop(&mut self, _now: Duration) {
        self.end(Ok(()));
    }

    fn poll(&mut self) -> Option<Output<Request>> {
        self.out.next()
    }
}

impl GattSession for HeartRateSession {
    fn receive(&mut self, characteristic: Uuid, value: &[u8], now: Duration) {
        if self.out.is_done() || self.standard.receive(characteristic, value, &mut self.out) {
            return;
        }
        if characteristic == MEASUREMENT && self.heart_rate.receive(value, now, &mut self.out) {
            self.restarts = 0;
            if let Some(watchdog) = &mut self.watchdog {
                watchdog.feed(now);
            }
        }
    }

    fn fail(&mut self, characteristic: Uuid, _now: Duration) {
        if characteristic == MEASUREMENT {
            self.end(Err(Error::Missing("heart rate measurement (0x2A37)")));
        }
    }
}
