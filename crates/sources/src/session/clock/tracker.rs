//! The time of a session while `/clock` jumps, stops and resumes.

use teampulse_core::simulated_time::Break;
use teampulse_core::time::Time;
use teampulse_ros::graph::Gid;

/// A step back smaller than this is a message out of order [s].
const LEAST_BACK_SECS: f64 = 1.0;
/// A step ahead larger than this is a jump, not a fast simulation [s].
const MOST_AHEAD_SECS: f64 = 3600.0;
/// The time without progress after which the clock counts as stopped, by the host's clock [s].
const STOPPED_AFTER_SECS: f64 = 3.0;

/// Follows `/clock`. The session's time never goes back and never stands still.
#[derive(Debug, Default)]
pub(super) struct ClockTracker {
    /// The followed publisher of `/clock`, and the last published time; `None` before the first message.
    last: Option<(Gid, Time)>,
    /// How far the session's time is ahead of the published time [ns].
    ahead_nanos: i64,
    session: Time,
    /// The time of the last progress, by the host's clock.
    heard: Time,
    /// When the clock was found to have stopped, by the host's clock and by the session's clock.
    stopped: Option<(Time, Time)>,
    /// Whether a second node publishes `/clock`, and whether that was reported.
    has_other: bool,
    has_said_other: bool,
}

impl ClockTracker {
    /// How far the session's time is ahead of the published time [ns].
    pub(super) fn ahead_nanos(&self) -> i64 {
        self.ahead_nanos
    }

    /// Handles a time from a publisher; returns the session's time, and the break of the clock if there is one.
    pub(super) fn hear(&mut self, publisher: Gid, now: Time, host: Time) -> (Time, Option<Break>) {
        let Some((known, last)) = self.last else {
            (self.last, self.session, self.heard) = (Some((publisher, now)), now, host);
            return (self.session, None);
        };
        if known != publisher && self.stopped.is_none() {
            self.has_other = true;
            return (self.session, None);
        }
        let step_secs = now.secs_since(last);
        let news = if let Some((since, _)) = self.stopped {
            if known == publisher && step_secs == 0.0 {
                return self.look(host);
            }
            self.pass(host);
            self.stopped = None;
            Some(Break::GoesOn(host.secs_since(since)))
        } else if step_secs <= -LEAST_BACK_SECS {
            Some(Break::Back(-step_secs))
        } else if step_secs > MOST_AHEAD_SECS {
            Some(Break::Ahead(step_secs))
        } else {
            if step_secs <= 0.0 {
                return self.look(host);
            }
            None
        };
        (self.last, self.heard) = (Some((publisher, now)), host);
        if news.is_some() {
            self.ahead_nanos = self.session.nanos().saturating_sub(now.nanos());
        }
        let session = Time::from_nanos(now.nanos().saturating_add(self.ahead_nanos));
        self.session = self.session.max(session);
        (self.session, news.or_else(|| self.say_other()))
    }

    /// Advances the host's time; returns the session's time, and whether the clock has stopped.
    pub(super) fn look(&mut self, host: Time) -> (Time, Option<Break>) {
        let silent_secs = host.secs_since(self.heard);
        let mut news = None;
        if self.last.is_some() && self.stopped.is_none() && silent_secs > STOPPED_AFTER_SECS {
            self.stopped = Some((host, self.session));
            news = Some(Break::Stopped(silent_secs));
        }
        self.pass(host);
        (self.session, news)
    }

    /// Advances the session's time by the host's clock while `/clock` has stopped.
    fn pass(&mut self, host: Time) {
        if let Some((since, session)) = self.stopped {
            let passed_nanos = host.nanos_since(since).max(0);
            let now = Time::from_nanos(session.nanos().saturating_add(passed_nanos));
            self.session = self.session.max(now);
        }
    }

    /// Reports once that a second node publishes `/clock`.
    fn say_other(&mut self) -> Option<Break> {
        let is_new = self.has_other && !self.has_said_other;
        self.has_said_other |= is_new;
        is_new.then_some(Break::Several)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const A: Gid = Gid::prefixed([1; 16]);
    const B: Gid = Gid::prefixed([2; 16]);

    fn secs(secs: f64) -> Time {
        Time::from_nanos((secs * 1e9) as i64)
    }

    /// Feeds these times of a clock, a tenth of a second of the host apart, from some time on; returns the session's
    /// times [s] and the breaks.
    fn hear(tracker: &mut ClockTracker, from: f64, stamps: &[f64]) -> (Vec<f64>, Vec<Break>) {
        let heard = stamps.iter().enumerate();
        let heard = heard.map(|(k, now)| tracker.hear(A, secs(*now), secs(from + k as f64 * 0.1)));
        let (times, breaks): (Vec<Time>, Vec<Option<Break>>) = heard.unzip();
        (times.into_iter().map(Time::secs).collect(), breaks.into_iter().flatten().collect())
    }

    #[test]
    fn a_clock_that_jumps_back_is_a_new_epoch_in_which_time_goes_on() {
        let mut tracker = ClockTracker::default();
        let (times, breaks) = hear(&mut tracker, 1000.0, &[50.0, 50.5, 10.0, 10.5, 11.0]);
        assert_eq!(times, [50.0, 50.5, 50.5, 51.0, 51.5]);
        assert_eq!(breaks, [Break::Back(40.5)]);
        assert_eq!(tracker.ahead_nanos(), 40_500_000_000);
    }

    #[test]
    fn one_message_from_a_far_future_does_not_hold_the_time_there() {
        let mut tracker = ClockTracker::default();
        let (times, breaks) = hear(&mut tracker, 1000.0, &[50.0, 9e9, 50.5, 51.0]);
        assert_eq!(times, [50.0, 50.0, 50.0, 50.5]);
        assert_eq!(breaks, [Break::Ahead(9e9 - 50.0), Break::Back(9e9 - 50.5)]);
    }

    #[test]
    fn a_message_out_of_order_is_no_jump() {
        let mut tracker = ClockTracker::default();
        let (times, breaks) = hear(&mut tracker, 1000.0, &[50.0, 50.5, 50.4, 51.0]);
        assert_eq!(times, [50.0, 50.5, 50.5, 51.0]);
        assert!(breaks.is_empty());
    }

    #[test]
    fn a_clock_that_stops_stops_no_session_and_may_go_on() {
        let mut tracker = ClockTracker::default();
        tracker.hear(A, secs(50.0), secs(1000.0));
        assert_eq!(tracker.look(secs(1002.9)), (secs(50.0), None));
        let (now, stopped) = tracker.look(secs(1004.0));
        assert_eq!((now, stopped), (secs(50.0), Some(Break::Stopped(4.0))));
        assert_eq!(tracker.look(secs(1010.0)), (secs(56.0), None));
        // A paused publisher repeats the same time.
        assert_eq!(tracker.hear(A, secs(50.0), secs(1011.0)), (secs(57.0), None));
        assert_eq!(
            tracker.hear(A, secs(50.1), secs(1012.0)),
            (secs(58.0), Some(Break::GoesOn(8.0)))
        );
        assert_eq!(tracker.hear(A, secs(50.6), secs(1012.5)), (secs(58.5), None));
    }

    #[test]
    fn only_one_of_two_clocks_is_followed_and_the_other_after_it_has_stopped() {
        let mut tracker = ClockTracker::default();
        tracker.hear(A, secs(50.0), secs(1000.0));
        assert_eq!(tracker.hear(B, secs(7.0), secs(1000.1)), (secs(50.0), None));
        assert_eq!(tracker.hear(A, secs(50.2), secs(1000.2)), (secs(50.2), Some(Break::Several)));
        assert_eq!(tracker.look(secs(1004.2)).1, Some(Break::Stopped(4.0)));
        let (now, goes_on) = tracker.hear(B, secs(11.0), secs(1005.2));
        assert_eq!((now, goes_on), (secs(51.2), Some(Break::GoesOn(1.0))));
        assert_eq!(tracker.hear(B, secs(12.0), secs(1006.2)), (secs(52.2), None));
    }

    proptest! {
        #[test]
        fn whatever_is_reported_time_never_goes_back_and_never_stands_still(
            heard_stamps in prop::collection::vec((any::<i64>(), 0_u8..2), 0..40),
        ) {
            let mut tracker = ClockTracker::default();
            let (mut last, mut host) = (Time::from_nanos(i64::MIN), 0.0);
            for (nanos, who) in heard_stamps {
                host += 0.5;
                let (now, _) = tracker.hear(Gid::prefixed([who; 16]), Time::from_nanos(nanos / 4), secs(host));
                prop_assert!(now >= last);
                last = now;
            }
            if tracker.last.is_some() {
                let before = tracker.look(secs(host + 4.0)).0;
                prop_assert!(tracker.look(secs(host + 8.0)).0 > before);
            }
        }
    }
}
