//! The whole seconds that pass between ticks.

use teampulse_core::time::Time;

const NANOS_PER_SEC: i64 = 1_000_000_000;

/// Detects when a whole second of the session's time has passed.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct WholeSeconds {
    last_tick: Option<Time>,
}

impl WholeSeconds {
    /// The newest whole second in (last tick, `now`].
    pub(crate) fn passed(&mut self, now: Time) -> Option<Time> {
        let second = now.nanos().div_euclid(NANOS_PER_SEC) * NANOS_PER_SEC;
        let last_tick = self.last_tick.replace(now);
        let is_new = last_tick.map_or(second == now.nanos(), |last| last.nanos() < second);
        is_new.then(|| Time::from_nanos(second))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_whole_second_passes_once() {
        let mut seconds = WholeSeconds::default();
        let passed = (3..35).filter_map(|k| seconds.passed(Time::from_nanos(k * 100_000_000)));
        let expected = [1, 2, 3].map(|secs| Time::from_stamp(secs, 0));
        assert_eq!(passed.collect::<Vec<_>>(), expected);
    }
}
