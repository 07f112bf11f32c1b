//! The life of a stream: how it is judged, on ticks, from its rate, its age and its losses.

mod pace;

use std::collections::VecDeque;

use pace::Pace;
use teampulse_timefilter::clock::ClockState;

use crate::status::{SIGMAS_95, State, StreamStatus};
use crate::time::Time;

/// Over how many seconds a rate is counted, and a loss remembered [s].
const WINDOW_SECS: usize = 10;
/// How many delays are kept for the median.
const DELAYS: usize = 32;
/// A rate is learned from so many samples on, over at least so many seconds [s], and within so many
/// seconds of the first [s].
const LEARNED_FROM: u64 = 5;
const LEARNED_FROM_SECS: f64 = 2.0;
const LEARNED_WITHIN_SECS: f64 = 60.0;
/// A rate was kept up when it held for so many seconds: a burst after a pause raises it for as long as
/// one counts, which is less.
const KEPT_UP_SECS: usize = 13;
/// How often a stream without any samples is reported: there may be thousands.
const SILENT_SECS: u32 = 30;

/// What is counted of a stream within one second.
#[derive(Clone, Copy, Debug, Default)]
struct Second {
    lost: u64,
    late: u64,
    duplicates: u64,
    disbelieved: u64,
}

/// The life of one stream so far; a function of what arrived and of the ticks.
#[derive(Clone, Debug)]
pub(crate) struct Life {
    expected_hz: Option<f64>,
    declared: bool,
    /// Whether it comes now and then, so that a silence means nothing.
    irregular: bool,
    now: Time,
    first: Option<Time>,
    seconds: VecDeque<Second>,
    current: Second,
    newest: Option<Time>,
    /// Until when nothing could be heard, as this process did not run.
    deaf_until: Option<Time>,
    /// How many seconds passed before anything came.
    silent_secs: u32,
    received: u64,
    pace: Pace,
    /// The rates of the last seconds, while it is learned which is usual [Hz].
    held_hz: VecDeque<f64>,
    lost_source: Option<u64>,
    lost_queue: u64,
    late: u64,
    duplicates: u64,
    delays_secs: VecDeque<f64>,
    /// How far the last stamp was ahead of its arrival [s].
    ahead_secs: f64,
    disbelieved_ahead_secs: f64,
}

impl Life {
    /// The life of a stream whose rate is declared [Hz], or is to be learned when that is 0.
    pub(crate) fn new(declared_hz: f64) -> Life {
        let declared = declared_hz > 0.0;
        Life {
            expected_hz: declared.then_some(declared_hz),
            declared,
            irregular: false,
            now: Time::EPOCH,
            first: None,
            seconds: VecDeque::with_capacity(WINDOW_SECS + 1),
            current: Second::default(),
            newest: None,
            deaf_until: None,
            silent_secs: 0,
            received: 0,
            pace: Pace::default(),
            held_hz: VecDeque::new(),
            lost_source: None,
            lost_queue: 0,
            late: 0,
            duplicates: 0,
            delays_secs: VecDeque::with_capacity(DELAYS + 1),
            ahead_secs: f64::NAN,
            disbelieved_ahead_secs: f64::NAN,
        }
    }

    /// The life of a stream that comes now and then: no rate is learned, and no silence held against it.
    pub(crate) fn irregular() -> Life {
        Life { irregular: true, ..Life::new(0.0) }
    }

    /// A declared rate became known [Hz].
    pub(crate) fn declare_rate(&mut self, declared_hz: f64) {
        if declared_hz > 0.0 {
            self.expected_hz = Some(declared_hz);
            self.declared = true;
        }
    }

    /// A sample was taken, or a run of so many.
    pub(crate) fn arrived(
        &mut self,
        samples: u32,
        log_time: Time,
        measured: Time,
        source_time: Option<Time>,
    ) {
        self.first.get_or_insert(log_time);
        self.newest = Some(log_time);
        self.received += 1;
        self.pace.arrived(samples.into(), log_time);
        self.ahead_secs = source_time.map_or(f64::NAN, |stamp| stamp.secs_since(log_time));
        if measured != log_time {
            self.delays_secs.push_back(log_time.secs_since(measured));
            if self.delays_secs.len() > DELAYS {
                self.delays_secs.pop_front();
            }
        }
    }

    /// A sample was taken that was published before the subscription: it says nothing about the rate.
    pub(crate) fn was_given_history(&mut self, log_time: Time) {
        self.newest = Some(log_time);
        self.received += 1;
    }

    /// The sample just taken came out of its turn.
    pub(crate) fn was_late(&mut self) {
        self.late += 1;
        self.current.late += 1;
    }

    /// Until then nothing could be heard: a silence counts from there.
    pub(crate) fn stood_still(&mut self, until: Time) {
        self.deaf_until = self.deaf_until.max(Some(until));
    }

    /// The sample just taken came twice.
    pub(crate) fn was_duplicate(&mut self) {
        self.duplicates += 1;
        self.current.duplicates += 1;
    }

    /// The stamp of the sample just taken was not believed.
    pub(crate) fn was_disbelieved(&mut self) {
        self.current.disbelieved += 1;
        self.disbelieved_ahead_secs = self.ahead_secs;
    }

    /// So many were lost on the way; NaN when that can't be known.
    pub(crate) fn lost_on_the_way(&mut self, count: f64) {
        if count.is_nan() {
            self.lost_source = None;
            return;
        }
        *self.lost_source.get_or_insert(0) += count as u64;
        self.current.lost += count as u64;
    }

    /// So many were dropped in our own queue.
    pub(crate) fn lost_in_our_queue(&mut self, count: f64) {
        self.lost_queue += count as u64;
        self.current.lost += count as u64;
    }

    /// A whole second of the session has passed: it is `now`.
    pub(crate) fn second(&mut self, now: Time) {
        self.now = now;
        if self.newest.is_none() {
            self.silent_secs = self.silent_secs.saturating_add(1);
        }
        self.seconds.push_back(std::mem::take(&mut self.current));
        if self.seconds.len() > WINDOW_SECS {
            self.seconds.pop_front();
        }
        if !self.declared && !self.irregular {
            self.learn();
        }
    }

    /// Whether its status is due: every second once something came; before that in the first second
    /// and now and then.
    pub(crate) fn is_due(&self) -> bool {
        self.newest.is_some() || self.silent_secs % SILENT_SECS == 1
    }

    /// Learns the rate in the first minute: the fastest that it kept up, so that a silence within
    /// does not pass for the way it is.
    fn learn(&mut self) {
        let (Some(first), Some(newest)) = (self.first, self.newest) else { return };
        let between_secs = newest.secs_since(first);
        let enough = self.received >= LEARNED_FROM && between_secs >= LEARNED_FROM_SECS;
        if !enough || self.now.secs_since(first) > LEARNED_WITHIN_SECS {
            return;
        }
        let silent_secs = self.now.secs_since(newest);
        if self.expected_hz.is_some_and(|hz| is_stale(silent_secs, hz)) {
            return;
        }
        self.held_hz.push_back(self.pace.rate_hz(self.now));
        let kept_up_hz = self.held_hz.iter().copied().fold(f64::INFINITY, f64::min);
        if self.held_hz.len() <= KEPT_UP_SECS {
            self.expected_hz = Some(kept_up_hz);
        } else {
            self.held_hz.pop_front();
            self.expected_hz = self.expected_hz.map(|known| known.max(kept_up_hz));
        }
    }

    /// How the stream of this name is doing at `now`; its clock is as `clock` says, with what is
    /// wrong with that.
    pub(crate) fn status(
        &self,
        name: &str,
        now: Time,
        clock: &ClockState,
        complaint: Option<String>,
    ) -> StreamStatus {
        let (state, reason) = self.judge(now, complaint);
        StreamStatus {
            name: name.to_owned(),
            state,
            reason,
            rate_hz: self.pace.rate_hz(now),
            age_secs: self.newest.map_or(f64::NAN, |newest| now.secs_since(newest)),
            received: self.received,
            lost_source: self.lost_source,
            lost_queue: self.lost_queue,
            late: self.late,
            duplicates: self.duplicates,
            clock: clock.kind as u8,
            epoch: clock.epoch,
            offset_secs: clock.offset_secs,
            skew_ppm: clock.skew_ppm,
            jitter_secs: clock.jitter_secs,
            sigma_secs: clock.uncertainty_secs / SIGMAS_95,
            latency_secs: self.median_delay_secs(),
        }
    }

    fn judge(&self, now: Time, of_clock: Option<String>) -> (State, String) {
        let Some(newest) = self.newest else {
            let reason =
                if self.irregular { "nothing yet; comes now and then" } else { "no sample yet" };
            return (State::Never, reason.into());
        };
        let age_secs = now.secs_since(newest);
        let silent_secs = now.secs_since(self.heard_since(newest));
        if let Some(expected_hz) = self.expected_hz {
            let silent = || format!("silent for {age_secs:.1} s");
            if silent_secs > f64::max(10.0 / expected_hz, 5.0) {
                return (State::Dead, silent());
            }
            if is_stale(silent_secs, expected_hz) {
                return (State::Stale, silent());
            }
        }
        match self.complaint(of_clock) {
            Some(reason) => (State::Degraded, reason),
            None => (State::Ok, String::new()),
        }
    }

    /// That moment, or when it could be heard again after it.
    fn heard_since(&self, moment: Time) -> Time {
        self.deaf_until.map_or(moment, |until| until.max(moment))
    }

    /// What is wrong with a stream that does come, with what is wrong with its clock.
    fn complaint(&self, of_clock: Option<String>) -> Option<String> {
        let lost = self.sum(|second| second.lost);
        let disbelieved = self.sum(|second| second.disbelieved);
        let late = self.sum(|second| second.late);
        let duplicates = self.sum(|second| second.duplicates);
        if lost > 0 {
            return Some(format!("{lost} lost in the last {WINDOW_SECS} s"));
        }
        if of_clock.is_some() {
            return of_clock;
        }
        if disbelieved > 0 {
            let ahead_secs = self.disbelieved_ahead_secs;
            return Some(if ahead_secs.is_nan() {
                format!("{disbelieved} of its stamps can't be believed")
            } else {
                format!("its stamps are {ahead_secs:+.3} s off")
            });
        }
        if let Some(slow) = self.too_slow() {
            return Some(slow);
        }
        if late > 0 {
            return Some(format!("{late} out of order in the last {WINDOW_SECS} s"));
        }
        (duplicates > 0).then(|| format!("{duplicates} twice in the last {WINDOW_SECS} s"))
    }

    fn too_slow(&self) -> Option<String> {
        let expected_hz = self.expected_hz?;
        let rate_hz = self.pace.rate_hz(self.now);
        let watched_secs = self.now.secs_since(self.heard_since(self.first?));
        let whole_window = watched_secs > WINDOW_SECS as f64 + 1.0;
        (whole_window && rate_hz < 0.8 * expected_hz && expected_hz * WINDOW_SECS as f64 >= 5.0)
            .then(|| format!("{rate_hz:.1} Hz instead of {expected_hz:.1} Hz"))
    }

    fn sum(&self, count: impl Fn(&Second) -> u64) -> u64 {
        self.seconds.iter().map(&count).fold(0, u64::saturating_add)
    }

    fn median_delay_secs(&self) -> f64 {
        let mut delays_secs: Vec<f64> = self.delays_secs.iter().copied().collect();
        delays_secs.sort_by(f64::total_cmp);
        delays_secs.get(delays_secs.len() / 2).copied().unwrap_or(f64::NAN)
    }
}

/// Whether a stream of a rate [Hz] is silent for longer than it should be.
fn is_stale(silent_secs: f64, expected_hz: f64) -> bool {
    silent_secs > f64::max(3.0 / expected_hz, 1.0)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn status(life: &Life, now: Time) -> StreamStatus {
        life.status("/x", now, &crate::clocks::UNKNOWN, None)
    }

    /// Lives through `secs` seconds from `from_secs` on, with `rate` samples in each.
    fn live(life: &mut Life, from_secs: i64, secs: i64, rate: i64) -> Time {
        for second in from_secs..from_secs + secs {
            for k in 0..rate {
                let nanos = second * 1_000_000_000 + k * 1_000_000_000 / rate;
                let now = Time::from_nanos(nanos);
                life.arrived(1, now, now, None);
            }
            life.second(Time::from_nanos((second + 1) * 1_000_000_000));
        }
        Time::from_nanos((from_secs + secs) * 1_000_000_000)
    }

    #[test]
    fn a_stream_that_never_came_is_never_fine() {
        let life = Life::new(5.0);
        assert_eq!(status(&life, Time::from_nanos(1)).state, State::Never);
    }

    #[test]
    fn what_was_not_heard_while_nothing_could_be_heard_was_not_silent() {
        let mut life = Life::new(5.0);
        let stopped = live(&mut life, 0, 20, 5);
        let woke = stopped + Duration::from_secs(60);
        life.stood_still(woke);
        (21..=80).for_each(|second| life.second(Time::from_stamp(second, 0)));
        assert_eq!(status(&life, woke).state, State::Ok);
        let back = live(&mut life, 80, 1, 5);
        assert_eq!(status(&life, back).state, State::Ok, "{}", status(&life, back).reason);
        let gone = back + Duration::from_secs(6);
        assert_eq!(status(&life, gone).state, State::Dead);
        // What did not come back is as silent as it is.
        let mut life = Life::new(5.0);
        live(&mut life, 0, 20, 5);
        life.stood_still(woke);
        let status = status(&life, woke + Duration::from_secs(6));
        assert_eq!((status.state, &*status.reason), (State::Dead, "silent for 66.2 s"));
    }

    #[test]
    fn a_stream_that_never_came_is_reported_now_and_then() {
        let mut life = Life::new(0.0);
        let reported = |life: &mut Life, from_secs: i64, secs: i64| {
            let seconds = from_secs..from_secs + secs;
            let due = seconds.filter(|second| {
                life.second(Time::from_stamp(*second as i32 + 1, 0));
                life.is_due()
            });
            due.count()
        };
        assert_eq!(reported(&mut life, 0, 10), 1);
        assert_eq!(reported(&mut life, 10, 290), 9);
        live(&mut life, 300, 1, 5);
        assert_eq!(reported(&mut life, 301, 60), 60, "what came once is told of every second");
    }

    #[test]
    fn a_learned_rate_is_held_against_the_stream() {
        let mut life = Life::new(0.0);
        let now = live(&mut life, 0, 20, 10);
        assert_eq!(status(&life, now).state, State::Ok);
        let now = live(&mut life, 20, 12, 4);
        let status = status(&life, now);
        assert_eq!(
            (status.state, status.reason.as_str()),
            (State::Degraded, "4.0 Hz instead of 10.0 Hz")
        );
    }

    #[test]
    fn what_comes_now_and_then_is_never_dead() {
        let mut life = Life::irregular();
        live(&mut life, 0, 20, 10);
        let now = live(&mut life, 20, 100, 0);
        assert_eq!(status(&life, now).state, State::Ok);
    }

    #[test]
    fn a_run_counts_as_the_samples_in_it() {
        for declared_hz in [0.0, 128.0] {
            let mut life = Life::new(declared_hz);
            for quarter in 1..=60 {
                let now = Time::from_nanos(quarter * 250_000_000);
                life.arrived(32, now, now, None);
                if quarter % 4 == 0 {
                    life.second(now);
                }
            }
            let status = status(&life, Time::from_nanos(15_000_000_000));
            assert_eq!((status.state, status.reason.as_str()), (State::Ok, ""));
            assert!((status.rate_hz - 128.0).abs() < 1e-9, "{}", status.rate_hz);
            assert_eq!(status.received, 60);
        }
    }

    #[test]
    fn silence_is_stale_then_dead_and_ends() {
        let mut life = Life::new(2.0);
        let now = live(&mut life, 0, 10, 2);
        let after = |secs: u64| now + std::time::Duration::from_secs(secs);
        assert_eq!(status(&life, after(2)).state, State::Stale);
        assert_eq!(status(&life, after(6)).state, State::Dead);
        live(&mut life, 10, 6, 0);
        let now = live(&mut life, 16, 12, 2);
        assert_eq!(status(&life, now).state, State::Ok);
    }

    #[test]
    fn a_silence_while_learning_is_not_the_way_it_is() {
        let mut life = Life::new(0.0);
        live(&mut life, 0, 3, 20);
        let now = live(&mut life, 3, 8, 0);
        assert_eq!(status(&life, now).state, State::Dead, "silent for 8 s");
        let now = live(&mut life, 11, 30, 20);
        assert_eq!(status(&life, now).state, State::Ok);
        let now = live(&mut life, 41, 2, 0);
        assert_eq!(status(&life, now).state, State::Stale);
    }

    #[test]
    fn a_network_that_catches_up_is_not_the_way_it_is() {
        for (held_up_from, held_up_secs) in [(2, 3), (6, 3), (15, 4), (30, 4)] {
            let mut life = Life::new(0.0);
            live(&mut life, 0, held_up_from, 20);
            live(&mut life, held_up_from, held_up_secs, 0);
            let resumed = held_up_from + held_up_secs;
            let at_once = Time::from_nanos(resumed * 1_000_000_000);
            (0..20 * held_up_secs).for_each(|_| life.arrived(1, at_once, at_once, None));
            let now = live(&mut life, resumed, 25, 20);
            assert_eq!(status(&life, now).reason, "", "held up after {held_up_from} s");
            let now = live(&mut life, resumed + 25, 15, 10);
            assert_eq!(status(&life, now).reason, "10.0 Hz instead of 20.0 Hz");
        }
    }

    #[test]
    fn losses_are_unknown_until_reported() {
        let mut life = Life::new(0.0);
        let now = live(&mut life, 0, 1, 5);
        assert_eq!(status(&life, now).lost_source, None);
        life.lost_on_the_way(0.0);
        assert_eq!(status(&life, now).lost_source, Some(0));
        life.lost_on_the_way(3.0);
        life.second(now);
        let status = status(&life, now);
        assert_eq!((status.lost_source, status.state), (Some(3), State::Degraded));
    }
}
