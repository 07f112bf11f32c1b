use std::time::Duration;

use super::TICKS_HZ;

const WRAP: i64 = 1 << 24;

/// Extends the device's 24-bit ticks to one count across wraps.
#[derive(Debug, Default)]
pub(super) struct Clock {
    last: Option<(u32, i64, Duration)>,
}

impl Clock {
    /// Returns the full count at a packet, and its increase since the previous one.
    ///
    /// Pauses longer than a wrap of 512 s are resolved with the caller's time.
    pub fn count(&mut self, ticks: u32, now: Duration) -> (i64, Option<i64>) {
        let Some((last, count, then)) = self.last else {
            self.last = Some((ticks, ticks.into(), now));
            return (ticks.into(), None);
        };
        let step = i64::from(ticks.wrapping_sub(last) & 0x00ff_ffff);
        let waited = now.saturating_sub(then).as_secs().min(1 << 32) as i64 * i64::from(TICKS_HZ);
        let wraps = (waited - step + WRAP / 2).max(0) / WRAP;
        let step = step + wraps * WRAP;
        let count = count.saturating_add(step);
        self.last = Some((ticks, count, now));
        (count, Some(step))
    }
}

/// Converts a count of ticks to nanoseconds.
pub(super) fn nanos(ticks: i64) -> i64 {
    let nanos = i128::from(ticks) * 1_000_000_000 / i128::from(TICKS_HZ);
    i64::try_from(nanos).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_wraps_every_512_seconds_and_goes_on() {
        let mut clock = Clock::default();
        let now = Duration::ZERO;
        clock.count(0xff_ff00, now);
        assert_eq!(clock.count(0x00_0000, now), (0x100_0000, Some(256)));
        assert_eq!(nanos(0x100_0000), 512_000_000_000);
    }

    #[test]
    fn what_comes_after_several_wraps_is_placed_by_the_callers_time() {
        let mut clock = Clock::default();
        clock.count(1000, Duration::ZERO);
        let later = 3 * 512 + 10;
        let ticks = 1000 + 10 * TICKS_HZ;
        let (count, _) = clock.count(ticks, Duration::from_secs(later));
        assert_eq!(count - 1000, later as i64 * i64::from(TICKS_HZ));
    }
}
