//! The health of a stream: judged on ticks, from its rate, its age and its losses.

mod pace;
mod usual;

use std::collections::VecDeque;

use pace::Pace;
use teampulse_timefilter::clock::ClockState;

use crate::counted::counted;
use crate::status::{SIGMAS_95, State, StreamStatus};
use crate::time::Time;
use usual::{Heard, UsualRate, is_stale};

/// The time over which a rate is counted, and a loss is reported [s].
const WINDOW_SECS: usize = 10;
/// The number of delays that are kept for the median.
const DELAYS: usize = 32;
/// The interval at which a stream without any samples is reported [s]: there may be thousands of such streams.
const SILENT_SECS: u32 = 30;

/// The counts of a stream within one second.
#[derive(Clone, Copy, Debug, Default)]
struct Second {
    lost: u64,
    late: u64,
    duplicates: u64,
    disbelieved: u64,
}

/// The health of one stream so far; a function of its arrivals and of the ticks.
#[derive(Clone, Debug)]
pub(crate) struct Life {
    usual: UsualRate,
    /// Whether the stream is irregular, so that silence means nothing.
    irregular: bool,
    now: Time,
    first: Option<Time>,
    seconds: VecDeque<Second>,
    current: Second,
    newest: Option<Time>,
    /// Whether the stream was stopped on purpose.
    stopped: bool,
    /// Until when nothing could be received, as this process was suspended or the stream was stopped.
    deaf_until: Option<Time>,
    /// The number of seconds before the first sample.
    silent_secs: u32,
    received: u64,
    pace: Pace,
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
    /// The health of a stream with a declared rate [Hz], or with one to be learned when that is 0.
    pub(crate) fn new(declared_hz: f64) -> Life {
        Life {
            usual: UsualRate::of(declared_hz),
            irregular: false,
            now: Time::EPOCH,
            first: None,
            seconds: VecDeque::with_capacity(WINDOW_SECS + 1),
            current: Second::default(),
            newest: None,
            stopped: false,
            deaf_until: None,
            silent_secs: 0,
            received: 0,
            pace: Pace::default(),
            lost_source: None,
            lost_queue: 0,
            late: 0,
            duplicates: 0,
            delays_secs: VecDeque::with_capacity(DELAYS + 1),
            ahead_secs: f64::NAN,
            disbelieved_ahead_secs: f64::NAN,
        }
    }

    /// The health of an irregular stream: no rate is learned, and silence is no fault.
    pub(crate) fn irregular() -> Life {
        Life { irregular: true, ..Life::new(0.0) }
    }

    /// Sets the declared rate, once it is known [Hz].
    pub(crate) fn declare_rate(&mut self, declared_hz: f64) {
        if declared_hz > 0.0 {
            self.usual = UsualRate::of(declared_hz);
        }
    }

    /// Counts the arrival of a reading with this many samples.
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

    /// Counts a sample that was published before the subscription: it does not count towards the rate.
    pub(crate) fn was_given_history(&mut self, log_time: Time) {
        self.newest = Some(log_time);
        self.received += 1;
    }

    /// Counts the sample just taken as out of order.
    pub(crate) fn was_late(&mut self) {
        self.late += 1;
        self.current.late += 1;
    }

    /// Notes that nothing could be received until `until`: silence is counted from then on.
    pub(crate) fn stood_still(&mut self, until: Time) {
        self.deaf_until = self.deaf_until.max(Some(until));
    }

    /// Notes that the stream was stopped on purpose, or resumed, at `at`: its silence before then means nothing.
    pub(crate) fn was_stopped(&mut self, is_stopped: bool, at: Time) {
        self.stopped = is_stopped;
        self.stood_still(at);
    }

    /// Counts the sample just taken as a duplicate.
    pub(crate) fn was_duplicate(&mut self) {
        self.duplicates += 1;
        self.current.duplicates += 1;
    }

    /// Counts the stamp of the sample just taken as implausible.
    pub(crate) fn was_disbelieved(&mut self) {
        self.current.disbelieved += 1;
        self.disbelieved_ahead_secs = self.ahead_secs;
    }

    /// Counts samples lost in transit; `None` when their number can't be known.
    pub(crate) fn lost_on_the_way(&mut self, samples: Option<u64>) {
        let Some(samples) = samples else {
            self.lost_source = None;
            return;
        };
        *self.lost_source.get_or_insert(0) += samples;
        self.current.lost += samples;
    }

    /// Counts samples dropped in our own queue.
    pub(crate) fn lost_in_our_queue(&mut self, samples: u64) {
        self.lost_queue += samples;
        self.current.lost += samples;
    }

    /// Advances by a whole second of the session, to `now`.
    pub(crate) fn second(&mut self, now: Time) {
        self.now = now;
        if self.newest.is_none() {
            self.silent_secs = self.silent_secs.saturating_add(1);
        }
        self.seconds.push_back(std::mem::take(&mut self.current));
        if self.seconds.len() > WINDOW_SECS {
            self.seconds.pop_front();
        }
        if let (Some(first), Some(newest), false) = (self.first, self.newest, self.irregular) {
            let heard = Heard { first, newest, received: self.received, now };
            self.usual.learn(&heard, || self.pace.rate_hz(now));
        }
    }

    /// Whether the stream's status is due: every second once a sample has arrived; before that, in the first second and
    /// every 30 s.
    pub(crate) fn is_due(&self) -> bool {
        self.newest.is_some() || self.silent_secs % SILENT_SECS == 1
    }

    /// The status of the stream of this name at `now`, with the state of its clock and the clock's fault, if any.
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
                if self.irregular { "no sample yet; irregular by nature" } else { "no sample yet" };
            return (State::Never, reason.into());
        };
        if self.stopped {
            return (State::Ok, "stopped on purpose".into());
        }
        let age_secs = now.secs_since(newest);
        let silent_secs = now.secs_since(self.heard_since(newest));
        if let Some(expected_hz) = self.usual.expected_hz() {
            // Samples arrive in runs.
            let expected_hz = expected_hz / self.pace.run() as f64;
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

    /// The later of a time and the end of the last standstill.
    fn heard_since(&self, moment: Time) -> Time {
        self.deaf_until.map_or(moment, |until| until.max(moment))
    }

    /// The fault of a stream that delivers samples, or of its clock.
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
                let stamps = counted(disbelieved, "implausible stamp", "implausible stamps");
                format!("{stamps} in the last {WINDOW_SECS} s")
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
        (duplicates > 0).then(|| format!("{duplicates} duplicated in the last {WINDOW_SECS} s"))
    }

    fn too_slow(&self) -> Option<String> {
        let expected_hz = self.usual.expected_hz()?;
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

#[cfg(test)]
mod tests;
