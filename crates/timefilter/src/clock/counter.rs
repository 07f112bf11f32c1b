//! Conversion of wrapping counters to continuous time.

/// A device's tick counter of any width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counter {
    bits: u32,
    hz: f64,
}

impl Counter {
    /// A counter of `bits` (1 to 64) with a rate of `hz` ticks per second.
    ///
    /// ```
    /// use teampulse_timefilter::clock::Counter;
    /// let shimmer3 = Counter::new(24, 32_768.0);
    /// assert_eq!(shimmer3.nanos(32_768), 1_000_000_000);
    /// assert_eq!(shimmer3.wraps_nanos(), Some(512_000_000_000));
    /// ```
    pub fn new(bits: u32, hz: f64) -> Counter {
        Counter { bits: bits.clamp(1, 64), hz }
    }

    /// The time since the counter was last at zero [ns]; 0 without a usable rate.
    pub fn nanos(&self, ticks: u64) -> i64 {
        let ticks = ticks & (u64::MAX >> (64 - self.bits));
        if self.hz > 0.0 { (ticks as f64 * (1e9 / self.hz)).round() as i64 } else { 0 }
    }

    /// The time after which the counter wraps [ns]; `None` if that is more than a century.
    pub fn wraps_nanos(&self) -> Option<i64> {
        let period = f64::from(self.bits).exp2() * (1e9 / self.hz);
        (1.0..3e18).contains(&period).then(|| period.round() as i64)
    }
}

/// Unwraps a wrapping clock.
#[derive(Clone, Debug)]
pub(super) struct Unwrap {
    /// The time after which the clock wraps [ns].
    period: Option<i64>,
    last: Option<Turned>,
    furthest_turn: i64,
}

#[derive(Clone, Copy, Debug)]
struct Turned {
    device: i64,
    arrival: i64,
}

impl Unwrap {
    pub fn new(period: Option<i64>) -> Unwrap {
        Unwrap { period: period.filter(|&period| period > 1), last: None, furthest_turn: 0 }
    }

    /// The reading of the clock itself at an unwrapped device time [ns].
    pub fn within_a_turn(&self, device: i64) -> i64 {
        self.period.map_or(device, |period| device.rem_euclid(period))
    }

    /// The unwrapped device time [ns], and whether the clock has just wrapped.
    ///
    /// It is the possible time that is nearest to the expected one: the last reading or, after a silence of half a
    /// turn, the last reading plus the time between arrivals.
    pub fn follow(&mut self, device: i64, arrival: i64) -> (i64, bool) {
        let Some(period) = self.period else { return (device, false) };
        let device = device.rem_euclid(period);
        let Some(last) = self.last else {
            self.last = Some(Turned { device, arrival });
            return (device, false);
        };
        let silence = arrival.saturating_sub(last.arrival);
        let passed = if silence < period / 2 { 0 } else { silence };
        let expected = last.device.saturating_add(passed);
        let turn = i128::from(expected) - i128::from(device) + i128::from(period / 2);
        let turn = turn.div_euclid(i128::from(period)) as i64;
        let turned = turn.checked_mul(period).and_then(|turned| turned.checked_add(device));
        let Some(turned) = turned else { return (device, false) };
        self.last = Some(Turned { device: turned, arrival });
        let wrapped = turn > self.furthest_turn;
        self.furthest_turn = self.furthest_turn.max(turn);
        (turned, wrapped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_knows_its_turn() {
        let counter = Counter::new(16, 1024.0);
        assert_eq!(counter.nanos(1024 + (1 << 16)), 1_000_000_000);
        assert_eq!(counter.wraps_nanos(), Some(64_000_000_000));
        assert_eq!(Counter::new(64, 1.0).wraps_nanos(), None);
        for hz in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(Counter::new(24, hz).wraps_nanos(), None);
            assert_eq!(Counter::new(24, hz).nanos(5), 0);
        }
    }

    #[test]
    fn turns_are_counted_through_reordering_and_silence() {
        let mut clock = Unwrap::new(Some(100));
        let readings = [(90, 1090), (99, 1099), (5, 1105), (98, 1106), (7, 1107), (7, 1107)];
        let turned: Vec<(i64, bool)> = readings.map(|(d, a)| clock.follow(d, a)).to_vec();
        let expected =
            [(90, false), (99, false), (105, true), (98, false), (107, false), (107, false)];
        assert_eq!(turned, expected);
        assert_eq!(clock.follow(20, 1107 + 313), (420, true));
    }

    #[test]
    fn without_a_turn_time_is_as_it_is() {
        for period in [None, Some(0), Some(-5)] {
            let mut clock = Unwrap::new(period);
            for device in [i64::MIN, 0, i64::MAX] {
                assert_eq!(clock.follow(device, 0), (device, false));
            }
        }
    }

    proptest::proptest! {
        #[test]
        fn any_readings_can_be_followed(
            period in proptest::num::i64::ANY,
            readings: Vec<(i64, i64)>,
        ) {
            let mut clock = Unwrap::new(Some(period));
            for (device, arrival) in readings {
                clock.follow(device, arrival);
            }
        }
    }
}
