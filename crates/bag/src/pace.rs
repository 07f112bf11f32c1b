//! The pace of a playback: original speed, slower, faster, or paused.

use std::time::Duration;

use teampulse_core::clock::Clock;
use teampulse_core::time::Time;
use tokio::sync::watch;

/// Controls the pace of a playback; clones control the same playback.
#[derive(Clone, Debug)]
pub struct Pace(watch::Sender<Speed>);

#[derive(Clone, Copy, Debug, PartialEq)]
struct Speed {
    rate: f64,
    paused: bool,
}

/// The slowest rate; below it a playback would effectively be paused.
const SLOWEST: f64 = 1e-3;

impl Pace {
    /// Creates a control that plays at `rate` times the recorded speed.
    pub fn new(rate: f64) -> Pace {
        Pace(watch::Sender::new(Speed { rate: rate.max(SLOWEST), paused: false }))
    }

    /// Changes the rate to `rate` times the recorded speed.
    pub fn set_rate(&self, rate: f64) {
        self.0.send_modify(|speed| speed.rate = rate.max(SLOWEST));
    }

    /// Pauses or resumes the playback.
    pub fn set_paused(&self, paused: bool) {
        self.0.send_modify(|speed| speed.paused = paused);
    }

    /// Whether the playback is paused.
    pub fn is_paused(&self) -> bool {
        self.0.borrow().paused
    }

    /// Starts pacing at a position in the recording, which corresponds to the current time of `clock`.
    pub(crate) fn keep(&self, clock: Clock, position: Time) -> Pacer {
        let mut speeds = self.0.subscribe();
        let speed = *speeds.borrow_and_update();
        let since = clock.now();
        Pacer { _pace: self.clone(), speeds, speed, clock, since, position }
    }
}

/// Paces one playback.
#[derive(Debug)]
pub(crate) struct Pacer {
    /// Held so that the channel of speeds stays open.
    _pace: Pace,
    speeds: watch::Receiver<Speed>,
    speed: Speed,
    clock: Clock,
    /// When the current speed was set, by the clock.
    since: Time,
    /// The position in the recording at that time.
    position: Time,
}

impl Pacer {
    /// Waits until the playback reaches `due` in the recording.
    pub(crate) async fn reach(&mut self, due: Time) {
        loop {
            self.follow();
            match self.left(due) {
                Some(Duration::ZERO) => return,
                left => self.wait(left).await,
            }
        }
    }

    /// The time until `due` is reached; `None` while the playback is paused.
    fn left(&self, due: Time) -> Option<Duration> {
        let left_secs = due.secs_since(self.position) / self.speed.rate
            - self.clock.now().secs_since(self.since);
        (!self.speed.paused).then(|| Duration::try_from_secs_f64(left_secs).unwrap_or_default())
    }

    /// Waits for this long, or until the speed changes.
    async fn wait(&mut self, left: Option<Duration>) {
        let changed = self.speeds.changed();
        match left {
            Some(left) => drop(tokio::time::timeout(left, changed).await),
            None => drop(changed.await),
        }
    }

    /// Applies the requested speed from the current position on.
    fn follow(&mut self) {
        let wanted = *self.speeds.borrow_and_update();
        if wanted == self.speed {
            return;
        }
        let now = self.clock.now();
        if !self.speed.paused {
            let played_secs = now.secs_since(self.since) * self.speed.rate;
            let played = Duration::try_from_secs_f64(played_secs).unwrap_or_default();
            self.position = self.position + played;
        }
        self.since = now;
        self.speed = wanted;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: Time = Time::from_stamp(100, 0);

    fn pacer(pace: &Pace) -> (Clock, Pacer) {
        let clock = Clock::settable();
        (clock.clone(), pace.keep(clock, START))
    }

    fn after(secs: u64) -> Time {
        START + Duration::from_secs(secs)
    }

    #[test]
    fn at_rate_two_it_takes_half_the_time() {
        let (clock, pacer) = pacer(&Pace::new(2.0));
        assert_eq!(pacer.left(after(10)), Some(Duration::from_secs(5)));
        clock.set(Time::from_stamp(6, 0));
        assert_eq!(pacer.left(after(10)), Some(Duration::ZERO));
    }

    #[test]
    fn a_pause_holds_the_position_and_a_new_rate_goes_on_from_it() {
        let pace = Pace::new(1.0);
        let (clock, mut pacer) = pacer(&pace);
        clock.set(Time::from_stamp(4, 0));
        pace.set_paused(true);
        pacer.follow();
        assert_eq!(pacer.left(after(10)), None);
        clock.set(Time::from_stamp(50, 0));
        pace.set_rate(3.0);
        pace.set_paused(false);
        pacer.follow();
        assert_eq!(pacer.left(after(10)), Some(Duration::from_secs(2)));
    }

    #[tokio::test]
    async fn what_is_due_is_reached_at_once() {
        let (_, mut pacer) = pacer(&Pace::new(1.0));
        pacer.reach(START).await;
    }
}
