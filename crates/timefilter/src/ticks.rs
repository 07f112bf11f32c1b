//! The periodic ticks by which silence is measured.

/// The longest silence for which ticks are filled in [ticks]; after a longer one the sequence restarts. At ten ticks a
/// second this is a day.
const LONGEST_SILENCE: i64 = 864_000;

/// The multiples of a period, each returned once and in order.
#[derive(Clone, Debug)]
pub struct Ticks {
    period_nanos: i64,
    last: Option<i64>,
}

impl Ticks {
    /// Ticks at the whole multiples of `period_nanos` [ns, at least 1].
    pub fn every(period_nanos: i64) -> Ticks {
        Ticks { period_nanos: period_nanos.max(1), last: None }
    }

    /// The ticks after the last one returned, up to and including `now` [ns]. The first call returns none:
    /// it sets the starting point.
    pub fn until(&mut self, now: i64) -> impl Iterator<Item = i64> + use<> {
        let (last, newest) = self.due(now);
        self.last = Some(newest.max(last));
        let period_nanos = self.period_nanos;
        (last.saturating_add(1)..=newest).map(move |tick| tick * period_nanos)
    }

    /// The first of the ticks that [`until`](Self::until) would return; later calls return the rest.
    pub fn next_until(&mut self, now: i64) -> Option<i64> {
        let (last, newest) = self.due(now);
        let next = last.saturating_add(1).min(newest.max(last));
        self.last = Some(next);
        (next > last).then(|| next * self.period_nanos)
    }

    /// The last tick that was returned or skipped, and the newest that is due at `now` [ns].
    fn due(&self, now: i64) -> (i64, i64) {
        let newest = now.div_euclid(self.period_nanos);
        let known = self.last.filter(|last| newest.saturating_sub(*last) <= LONGEST_SILENCE);
        (known.unwrap_or(newest), newest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_the_same_for_any_chunking() {
        let mut whole = Ticks::every(100);
        let mut parts = whole.clone();
        let whole: Vec<i64> = whole.until(50).chain(whole.until(1_000)).collect();
        let parts: Vec<i64> = [50, 51, 99, 100, 100, 350, 340, 999, 1_000]
            .iter()
            .flat_map(|&t| parts.until(t))
            .collect();
        assert_eq!(whole, parts);
        assert_eq!(whole, [100, 200, 300, 400, 500, 600, 700, 800, 900, 1_000]);
    }

    #[test]
    fn ticks_are_the_same_one_by_one() {
        let mut whole = Ticks::every(100);
        let mut single = whole.clone();
        for now in [50, 1_000, 400, 90_000_000, 90_000_300, i64::MAX, i64::MIN, 0, 700] {
            let ticks: Vec<i64> = std::iter::from_fn(|| single.next_until(now)).collect();
            assert_eq!(ticks, whole.until(now).collect::<Vec<_>>());
        }
    }

    #[test]
    fn absurd_times_do_not_keep_it_busy() {
        let mut ticks = Ticks::every(100_000_000);
        for now in [0, i64::MAX, i64::MIN, 0, 1_700_000_000_000_000_000] {
            assert!(ticks.until(now).count() <= LONGEST_SILENCE as usize);
        }
    }
}
