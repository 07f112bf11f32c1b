//! The session's clock: the only place that reads the machine's time.
#![expect(clippy::disallowed_methods, reason = "this is the one reader of the machine's time")]

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use rustix::time::{ClockId, clock_gettime};

use crate::time::Time;

/// The clock of a session; clones share it.
#[derive(Clone, Debug)]
pub struct Clock(Arc<Kind>);

#[derive(Debug)]
enum Kind {
    /// The host's clock, with an offset at the start [s] and a skew [ppm]; both are positive if this clock is ahead.
    Host { wall_at_start: Time, started: Moment, ahead_secs: f64, fast_ppm: f64 },
    Set {
        nanos: AtomicI64,
        /// How far the session's time is ahead of simulated time [ns]: the session's time continues evenly when
        /// simulated time jumps.
        ahead_nanos: AtomicI64,
    },
}

impl Clock {
    /// The host's clock. It starts at the wall clock's time and then follows the monotonic clock that also runs while
    /// the machine sleeps. Later steps of the wall clock do not affect it; see [`Clock::wall_offset_nanos`].
    pub fn host() -> Clock {
        Clock::host_off(0.0, 0.0)
    }

    /// The host's clock with an offset [s] and a skew [ppm]: for a simulated computer.
    pub fn host_off(ahead_secs: f64, fast_ppm: f64) -> Clock {
        let (wall_at_start, started) = wall_and_moment(wall, Moment::now);
        Clock(Arc::new(Kind::Host { wall_at_start, started, ahead_secs, fast_ppm }))
    }

    /// A clock that shows the time to which it was last set: simulated time, or the time of a recording or a test.
    /// Until it is first set, it shows [`Time::EPOCH`].
    pub fn settable() -> Clock {
        Clock(Arc::new(Kind::Set { nanos: AtomicI64::new(0), ahead_nanos: AtomicI64::new(0) }))
    }

    /// The session's current time.
    pub fn now(&self) -> Time {
        match &*self.0 {
            Kind::Host { wall_at_start, started, ahead_secs, fast_ppm } => {
                let elapsed = started.elapsed();
                let ahead_secs = ahead_secs + elapsed.as_secs_f64() * fast_ppm * 1e-6;
                let truth = *wall_at_start + elapsed;
                Time::from_nanos(truth.nanos().saturating_add((ahead_secs * 1e9) as i64))
            }
            Kind::Set { nanos, .. } => Time::from_nanos(nanos.load(Ordering::Acquire)),
        }
    }

    /// Sets the time of a settable clock; returns whether it moved. The time never goes back, and a host's clock can't
    /// be set.
    pub fn set(&self, now: Time) -> bool {
        match &*self.0 {
            Kind::Host { .. } => false,
            Kind::Set { nanos, .. } => nanos.fetch_max(now.nanos(), Ordering::AcqRel) < now.nanos(),
        }
    }

    /// Sets how far the session's time is ahead of the simulated time that stamps messages [ns].
    pub fn run_ahead(&self, of_stamps_nanos: i64) {
        if let Kind::Set { ahead_nanos, .. } = &*self.0 {
            ahead_nanos.store(of_stamps_nanos, Ordering::Release);
        }
    }

    /// Converts a stamp of simulated time to the session's time; with a host's clock the stamp is
    /// returned unchanged.
    pub fn session_from_stamp(&self, stamp: Time) -> Time {
        match &*self.0 {
            Kind::Host { .. } => stamp,
            Kind::Set { ahead_nanos, .. } => {
                let nanos = stamp.nanos().saturating_add(ahead_nanos.load(Ordering::Acquire));
                Time::from_nanos(nanos)
            }
        }
    }

    /// Whether the time is set from outside (simulated time) instead of read from the host.
    pub fn is_settable(&self) -> bool {
        matches!(*self.0, Kind::Set { .. })
    }

    /// How far the session's clock is ahead of the machine's [monotonic](monotonic) clock [ns].
    pub fn ahead_of_monotonic_nanos(&self) -> i64 {
        let (now, between) = fastest(|| self.now(), monotonic);
        let between = i64::try_from(between.as_nanos()).unwrap_or(i64::MAX);
        now.nanos().saturating_sub(between)
    }

    /// How much the machine's wall clock was stepped and slewed since this clock was created [ns]. Zero for a settable
    /// clock.
    pub fn wall_offset_nanos(&self) -> i64 {
        match &*self.0 {
            Kind::Host { wall_at_start, started, .. } => {
                let (wall, moment) = wall_and_moment(wall, Moment::now);
                wall.nanos_since(*wall_at_start + moment.0.saturating_sub(started.0))
            }
            Kind::Set { .. } => 0,
        }
    }
}

/// Reads the wall clock and the monotonic clock at the same moment.
fn wall_and_moment(wall: impl Fn() -> Time, moment: impl Fn() -> Moment) -> (Time, Moment) {
    let (wall, moment) = fastest(wall, || moment().0);
    (wall, Moment(moment))
}

/// Reads a clock and a monotonic clock at the same moment. Takes the fastest of three readings, as this thread may be
/// interrupted during a reading.
fn fastest(clock: impl Fn() -> Time, monotonic: impl Fn() -> Duration) -> (Time, Duration) {
    let reading = || {
        let (before, now, after) = (monotonic(), clock(), monotonic());
        let took = after.saturating_sub(before);
        (took, now, before + took / 2)
    };
    let (_, now, between) =
        [reading(), reading(), reading()].into_iter().min().unwrap_or_else(reading);
    (now, between)
}

/// The machine's wall clock, for uses outside any session: names and ages of files.
pub fn wall() -> Time {
    let nanos = match SystemTime::now().duration_since(UNIX_EPOCH) {
        Ok(after) => i64::try_from(after.as_nanos()).unwrap_or(i64::MAX),
        Err(before) => -i64::try_from(before.duration().as_nanos()).unwrap_or(i64::MAX),
    };
    Time::from_nanos(nanos)
}

/// The machine's `CLOCK_MONOTONIC`, which stops while the machine sleeps. Programs on one machine stamp with it when
/// they share no other clock.
pub fn monotonic() -> Duration {
    let now = clock_gettime(ClockId::Monotonic);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
}

/// A moment on the machine's `CLOCK_BOOTTIME`, which continues while the machine sleeps: a laptop's closed lid appears
/// as silence, not as a step of the wall clock.
#[derive(Clone, Copy, Debug)]
struct Moment(Duration);

impl Moment {
    fn now() -> Moment {
        let now = clock_gettime(ClockId::Boottime);
        Moment(Duration::new(now.tv_sec as u64, now.tv_nsec as u32))
    }

    fn elapsed(self) -> Duration {
        Moment::now().0.saturating_sub(self.0)
    }
}

/// Measures the duration of our own work by the machine's monotonic clock: for pacing only, as no
/// result may depend on it.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch(Moment);

impl Stopwatch {
    /// A stopwatch that starts now.
    pub fn start() -> Stopwatch {
        Stopwatch(Moment::now())
    }

    /// The time since it was started.
    pub fn elapsed(&self) -> Duration {
        self.0.elapsed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_clock_never_goes_back() {
        let clock = Clock::settable();
        assert!(clock.set(Time::from_nanos(5)));
        assert!(!clock.set(Time::from_nanos(3)));
        assert_eq!(clock.now(), Time::from_nanos(5));
    }

    #[test]
    fn an_offset_clock_has_its_offset_and_skew_and_no_step() {
        let clock = Clock::host_off(1.5, 40.0);
        assert!((clock.now().secs_since(wall()) - 1.5).abs() < 1.0);
        assert!(clock.wall_offset_nanos().abs() < 1_000_000_000);
    }

    #[test]
    fn a_host_clock_is_right_even_if_another_program_runs_while_it_starts() {
        use std::cell::Cell;

        // Of all readings of the two clocks, these take 5 ms longer.
        for slow in [1, 2, 3] {
            let (count, elapsed) = (Cell::new(0), Cell::new(Duration::ZERO));
            let pass = || {
                count.set(count.get() + 1);
                let took = Duration::from_micros(if count.get() == slow { 5000 } else { 1 });
                elapsed.set(elapsed.get() + took);
                elapsed.get()
            };
            let (wall, moment) = wall_and_moment(|| Time::EPOCH + pass(), || Moment(pass()));
            let off = wall.nanos_since(Time::EPOCH + moment.0);
            assert!(off.abs() < 2_000, "{off} ns");
        }
    }

    #[test]
    fn a_host_clock_starts_at_the_wall_clock_and_runs() {
        let clock = Clock::host();
        let before = clock.now();
        assert!(before.secs_since(wall()).abs() < 1.0);
        assert!(clock.now() >= before);
    }
}
