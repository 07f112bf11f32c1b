//! Letting messages gather: at high rates a thread that receives pauses whenever it has caught up,
//! so that one wake-up serves many messages, as network cards moderate their interrupts.
//!
//! Waking up costs more than receiving: at 20,000 messages a second of 1 KiB it is a third of all
//! the work. The price is up to half a millisecond on the arrival, at such rates only.

use std::cell::RefCell;
use std::time::Duration;

use teampulse_core::clock::Clock;
use teampulse_core::time::Time;

/// How long the thread pauses.
const PAUSE: Duration = Duration::from_micros(500);
/// Over how long the rate is counted [ns].
const WINDOW_NANOS: i64 = 20_000_000;
/// From how many messages in a window on it pauses: 5,000 a second.
const MANY: usize = 100;
/// A thread that waited this long for a message had caught up [ns].
const CAUGHT_UP_NANOS: i64 = 15_000;

thread_local! {
    static RECEIVING: RefCell<Receiving> = RefCell::new(Receiving::new(Clock::host()));
}

/// The time at which this thread begins to hand messages over.
pub(super) fn begin() -> Time {
    RECEIVING.with_borrow(|receiving| receiving.clock.now())
}

/// So many messages were handed over since `began`; pauses if that saves work.
pub(super) fn end(began: Time, messages: usize) {
    let pauses = RECEIVING.with_borrow_mut(|receiving| receiving.pauses(began, messages));
    if pauses {
        std::thread::sleep(PAUSE);
    }
    RECEIVING.with_borrow_mut(|receiving| receiving.idle_since = receiving.clock.now());
}

/// What one thread receives.
struct Receiving {
    clock: Clock,
    window_began: Time,
    in_window: usize,
    many: bool,
    idle_since: Time,
}

impl Receiving {
    fn new(clock: Clock) -> Receiving {
        let now = clock.now();
        Receiving { clock, window_began: now, in_window: 0, many: false, idle_since: now }
    }

    /// Whether to pause behind messages that came at `began`.
    fn pauses(&mut self, began: Time, messages: usize) -> bool {
        self.in_window += messages;
        if began.nanos_since(self.window_began) >= WINDOW_NANOS {
            let stale = began.nanos_since(self.window_began) >= 2 * WINDOW_NANOS;
            self.many = self.in_window >= MANY && !stale;
            self.window_began = began;
            self.in_window = 0;
        }
        self.many && began.nanos_since(self.idle_since) >= CAUGHT_UP_NANOS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Receives for a second with so much time between messages [ns]; counts the pauses.
    fn pauses(gap_nanos: i64) -> usize {
        let mut receiving = Receiving::new(Clock::told());
        let moments = (1..1_000_000_000 / gap_nanos).map(|k| Time::from_nanos(k * gap_nanos));
        let paused = moments.filter(|&moment| {
            let pauses = receiving.pauses(moment, 1);
            receiving.idle_since = moment;
            pauses
        });
        paused.count()
    }

    #[test]
    fn only_a_fast_stream_that_was_caught_up_with_is_paused_for() {
        assert_eq!(pauses(1_000_000), 0, "1,000 messages a second come one by one");
        assert!(pauses(50_000) > 15_000, "20,000 messages a second gather");
        assert_eq!(pauses(4_000), 0, "a backlog is worked off without a pause");
    }

    #[test]
    fn a_burst_after_silence_is_not_paused_for() {
        let mut receiving = Receiving::new(Clock::told());
        assert!(!receiving.pauses(Time::from_stamp(5, 0), 99));
        assert!(!receiving.pauses(Time::from_stamp(9, 0), 99));
    }
}
