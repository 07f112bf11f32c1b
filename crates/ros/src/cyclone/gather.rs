//! Batching of messages: at high rates a receiving thread pauses whenever it has caught up, so that one
//! wake-up serves many messages, like the interrupt moderation of network cards.
//!
//! A wake-up costs more than receiving a message: at 20,000 messages a second of 1 KiB it accounts for a third of the
//! work. The cost is an arrival delay of up to a millisecond, only at such rates; at higher rates it is shorter, as a
//! batch must fit many times into the receive buffer of a socket.

use std::cell::RefCell;
use std::ops::RangeInclusive;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use teampulse_core::clock::Clock;
use teampulse_core::time::Time;

use super::waits;
use crate::receiving;

/// The longest pause.
const LONGEST_PAUSE: Duration = Duration::from_millis(1);
/// The limits of the maximum batch size, which is a tenth of the number of 1 KiB messages that a receive buffer holds:
/// from the batch size for the default buffer of a Linux machine (208 KiB) to a size beyond which hardly any work is
/// saved.
const GATHERED: RangeInclusive<u32> = 16..=64;
/// The space that a packet of 1 KiB takes in a receive buffer [bytes]; the kernel makes the buffer twice as
/// large as requested.
const PACKET_BYTES: usize = 2304 / 2;
/// The window in which messages are counted.
const WINDOW: Duration = Duration::from_millis(20);
/// The number of messages in a window from which the thread pauses: 5,000 a second.
const MANY: u32 = 100;
/// The time between messages from which a thread may have waited for a message [ns]. It may also just have been slow,
/// as its caches are cold after a pause.
const MAY_HAVE_WAITED_NANOS: i64 = 15_000;

/// The largest batch in this process.
static MOST: AtomicU32 = AtomicU32::new(*GATHERED.start());

thread_local! {
    static RECEIVING: RefCell<Receiving> = RefCell::new(Receiving::new(Clock::host(), waits::of_this_thread));
}

/// Adapts the largest batch to receive buffers of this size [bytes].
pub(super) fn suit(buffer_bytes: usize) {
    MOST.store(gathered(buffer_bytes), Ordering::Relaxed);
}

fn gathered(buffer_bytes: usize) -> u32 {
    let tenth = u32::try_from(buffer_bytes / PACKET_BYTES / 10).unwrap_or(u32::MAX);
    tenth.clamp(*GATHERED.start(), *GATHERED.end())
}

/// Returns the time at which this thread starts to deliver messages.
pub(super) fn begin() -> Time {
    RECEIVING.with_borrow(|receiving| receiving.clock.now())
}

/// Reports that messages were delivered since `began`; pauses if that saves work.
pub(super) fn end(began: Time, messages: usize) {
    let pauses = RECEIVING.with_borrow_mut(|receiving| receiving.pauses(began, messages));
    if let Some(pause) = pauses {
        std::thread::sleep(pause);
    }
    RECEIVING.with_borrow_mut(|receiving| receiving.continues(pauses.is_some()));
}

/// The state of one receiving thread.
struct Receiving {
    clock: Clock,
    window_began: Time,
    in_window: u32,
    /// The pause; `None` at low rates.
    pause: Option<Duration>,
    idle_since: Time,
    /// The number of times that this thread had waited for something when it last paused.
    waits: u64,
    /// Reads how many times this thread has waited.
    count_waits: fn() -> u64,
    /// Whether this thread has requested a higher priority.
    comes_first: bool,
}

impl Receiving {
    fn new(clock: Clock, count_waits: fn() -> u64) -> Receiving {
        let now = clock.now();
        Receiving {
            clock,
            window_began: now,
            in_window: 0,
            pause: None,
            idle_since: now,
            waits: count_waits(),
            count_waits,
            comes_first: false,
        }
    }

    /// The pause after messages that arrived at `began`.
    fn pauses(&mut self, began: Time, messages: usize) -> Option<Duration> {
        self.in_window = self.in_window.saturating_add(u32::try_from(messages).unwrap_or(u32::MAX));
        let window_nanos = began.nanos_since(self.window_began);
        if window_nanos >= WINDOW.as_nanos() as i64 {
            let stale = window_nanos >= 2 * WINDOW.as_nanos() as i64;
            let many = self.in_window >= MANY && !stale;
            let most = MOST.load(Ordering::Relaxed);
            self.pause = many.then(|| (WINDOW * most / self.in_window).min(LONGEST_PAUSE));
            if many && !std::mem::replace(&mut self.comes_first, true) && !receiving::come_first() {
                tracing::debug!("not permitted to raise the priority of a receiving thread");
            }
            self.window_began = began;
            self.in_window = 0;
        }
        self.pause.filter(|_| self.caught_up(began))
    }

    /// Whether the socket was empty before the messages that arrived at `began`. A pause during a backlog would
    /// lengthen the backlog, up to the size of the receive buffer.
    fn caught_up(&self, began: Time) -> bool {
        // Reading the clock is cheap, counting waits is a system call.
        let may_have_waited = began.nanos_since(self.idle_since) >= MAY_HAVE_WAITED_NANOS;
        may_have_waited && (self.count_waits)() != self.waits
    }

    /// Begins to wait for messages.
    fn continues(&mut self, paused: bool) {
        if paused {
            self.waits = (self.count_waits)();
        }
        self.idle_since = self.clock.now();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts every call as a wait, as of a thread that has always caught up.
    fn waits_each_time() -> u64 {
        use std::cell::Cell;
        thread_local!(static WAITS: Cell<u64> = const { Cell::new(0) });
        WAITS.replace(WAITS.get() + 1)
    }

    /// Receives for a second with this interval between messages [ns]; returns the pauses.
    fn pauses(gap_nanos: i64, count_waits: fn() -> u64) -> Vec<Duration> {
        let mut receiving = Receiving::new(Clock::settable(), count_waits);
        let moments = (1..1_000_000_000 / gap_nanos).map(|k| Time::from_nanos(k * gap_nanos));
        let paused = moments.filter_map(|moment| {
            let pauses = receiving.pauses(moment, 1);
            receiving.continues(pauses.is_some());
            receiving.idle_since = moment;
            pauses
        });
        paused.collect()
    }

    #[test]
    fn only_a_fast_stream_that_was_caught_up_with_is_paused_for() {
        let pauses = |gap_nanos| pauses(gap_nanos, waits_each_time);
        assert!(pauses(1_000_000).is_empty(), "1,000 messages a second come one by one");
        assert!(pauses(50_000).len() > 15_000, "20,000 messages a second gather");
        assert!(pauses(4_000).is_empty(), "a backlog is worked off without a pause");
    }

    #[test]
    fn a_slow_thread_with_a_backlog_is_not_paused() {
        let pauses = pauses(50_000, || 7);
        assert_eq!(pauses, [], "it took 50 µs a message and never waited for one");
    }

    #[test]
    fn no_more_gather_than_fit_in_a_small_receive_buffer_many_times() {
        for gap_nanos in [180_000, 50_000, 20_000, 16_000] {
            let gathered = |pause: &Duration| pause.as_nanos() as i64 / gap_nanos;
            let most = pauses(gap_nanos, waits_each_time).iter().map(gathered).max();
            assert!((2..=16).contains(&most.unwrap()), "every {gap_nanos} ns: {most:?}");
        }
    }

    #[test]
    fn larger_receive_buffers_let_more_gather() {
        let gathered = [0, 208 << 10, 1 << 20, 4 << 20, 32 << 20].map(gathered);
        assert_eq!(gathered, [16, 18, 64, 64, 64]);
    }

    #[test]
    fn a_burst_after_silence_is_not_paused_for() {
        let mut receiving = Receiving::new(Clock::settable(), waits_each_time);
        assert_eq!(receiving.pauses(Time::from_stamp(5, 0), 99), None);
        assert_eq!(receiving.pauses(Time::from_stamp(9, 0), 99), None);
    }
}
