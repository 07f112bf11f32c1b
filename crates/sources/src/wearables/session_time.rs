//! The time within a session with a device.

use std::time::Duration;

use teampulse_core::clock::Stopwatch;

/// A wait that exceeds its intended length by this much means that teampulse itself stood still.
const STANDSTILL: Duration = Duration::from_secs(1);
/// Data that the device sent during a standstill are received within this time.
const CATCHING_UP: Duration = Duration::from_secs(1);

/// The time since the start of a session, without periods in which teampulse itself stood still: the device was not
/// silent then.
#[derive(Clone, Copy, Debug)]
pub(super) struct SessionTime {
    started: Stopwatch,
    stood_still: Duration,
    /// When the last wait began, and when it should end at the latest; `None` once it has ended.
    wait: Option<(Duration, Duration)>,
    /// The lower bound that keeps the time from going back.
    least: Duration,
}

impl SessionTime {
    pub(super) fn start() -> SessionTime {
        let (stood_still, least) = (Duration::ZERO, Duration::ZERO);
        SessionTime { started: Stopwatch::start(), stood_still, wait: None, least }
    }

    pub(super) fn now(&mut self) -> Duration {
        self.at(self.started.elapsed())
    }

    /// Begins a wait until a time, at most `most` long; returns how long it should last.
    pub(super) fn wait(&mut self, until: Option<Duration>, most: Duration) -> Duration {
        let now = self.now();
        let pause = until.map_or(most, |until| until.saturating_sub(now)).min(most);
        self.wait = Some((now, now + pause));
        pause
    }

    fn at(&mut self, elapsed: Duration) -> Duration {
        let now = elapsed.saturating_sub(self.stood_still).max(self.least);
        let Some((began, end)) = self.wait.take() else { return now };
        let late = now.saturating_sub(end);
        if late <= STANDSTILL {
            return now;
        }
        self.stood_still += late + CATCHING_UP;
        self.least = began;
        began.max(elapsed.saturating_sub(self.stood_still))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn secs(secs: f64) -> Duration {
        Duration::from_secs_f64(secs)
    }

    /// A time whose last wait began and should have ended at these times [s].
    fn waiting(began: f64, end: f64) -> SessionTime {
        SessionTime { wait: Some((secs(began), secs(end))), ..SessionTime::start() }
    }

    #[test]
    fn a_standstill_does_not_count() {
        let mut time = waiting(5.0, 5.5);
        assert_eq!(time.at(secs(65.5)), secs(5.0), "what waits is received first");
        assert_eq!(time.at(secs(67.0)), secs(6.0));
    }

    #[test]
    fn a_wait_that_ends_a_little_late_counts() {
        assert_eq!(waiting(5.0, 6.0).at(secs(6.9)), secs(6.9));
    }
}
