//! How long a live pump lets readings gather before it takes them.

use std::time::Duration;

use crate::clock::Stopwatch;

/// The longest time that readings gather: at any rate of messages, the pump and its sinks wake up at most 60 times a
/// second. At a few hundred readings a second, waking up is most of the cost.
const LONGEST: Duration = Duration::from_millis(16);
/// The rate from which readings gather for [`LONGEST`] [Hz]. At lower rates less is saved, and readings are taken
/// sooner.
const MANY_HZ: f64 = 300.0;
/// The time over which readings are counted.
const WINDOW: Duration = Duration::from_millis(250);

/// Counts the readings taken, which decides how long the next ones gather.
pub(super) struct Gathering {
    counted: Stopwatch,
    taken: usize,
    time: Duration,
}

impl Gathering {
    pub(super) fn begin() -> Gathering {
        Gathering { counted: Stopwatch::start(), taken: 0, time: Duration::ZERO }
    }

    /// Counts `taken` readings; returns how long readings gather, from wake-up to wake-up.
    pub(super) fn after(&mut self, taken: usize) -> Duration {
        self.taken += taken;
        let elapsed = self.counted.elapsed();
        if elapsed >= WINDOW {
            self.time = time(self.taken as f64 / elapsed.as_secs_f64());
            (self.counted, self.taken) = (Stopwatch::start(), 0);
        }
        self.time
    }
}

/// How long readings gather at this rate [Hz].
fn time(rate_hz: f64) -> Duration {
    LONGEST.mul_f64((rate_hz / MANY_HZ).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fewer_readings_there_are_the_sooner_each_is_taken() {
        assert_eq!(time(0.0), Duration::ZERO);
        assert_eq!(time(75.0), Duration::from_millis(4));
        assert_eq!([300.0, 1e6].map(time), [LONGEST; 2]);
        // Then a reading comes every 10 ms, and hardly any two are taken together.
        assert!(time(100.0) < Duration::from_millis(6));
    }
}
