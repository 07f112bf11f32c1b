//! The connection interval of a Bluetooth Low Energy link, estimated from arrival times alone.

use std::f64::consts::TAU;

/// The number of arrivals in a window.
const WINDOW: usize = 64;
/// The unit of connection intervals [s], and the shortest and longest interval searched for in units: 7.5
/// to 100 ms (Bluetooth Core Specification 5.4, volume 6, part B, 4.5.1).
pub(super) const UNIT_SECS: f64 = 0.001_25;
pub(super) const SHORTEST_UNITS: usize = 6;
const LONGEST_UNITS: usize = 80;
/// The minimum mean resultant length of arrivals, taken modulo the interval, at which they lie on a lattice.
const ON_LATTICE: f64 = 0.85;
/// The margin by which a fraction of an interval must fit better to replace it.
const BETTER: f64 = 0.03;
/// If more than `SAME_STEP` of the steps are equal and fewer than `SAME_EVENT` are between packets of one event, a
/// packet's period may be any number of events.
const SAME_STEP: f64 = 0.95;
const SAME_EVENT: f64 = 0.05;

/// Estimates the connection interval of a link.
///
/// Packets arrive at the connection events of the link, which are one interval apart, so arrivals lie on a
/// lattice. The estimate is the longest interval that fits two consecutive windows of 64 arrivals. There is
/// none where arrivals lie on no lattice (Wi-Fi, USB, relayed messages), or where packets are always the
/// same number of events apart (10 Hz over an interval of 50 ms): 50, 25 and 12.5 ms are then
/// indistinguishable.
#[derive(Clone, Debug)]
pub struct ConnectionInterval {
    arrivals: [i64; WINDOW],
    count: usize,
    /// The interval found in the last window [units].
    last: Option<usize>,
    known: Option<usize>,
}

impl Default for ConnectionInterval {
    fn default() -> ConnectionInterval {
        ConnectionInterval { arrivals: [0; WINDOW], count: 0, last: None, known: None }
    }
}

impl ConnectionInterval {
    /// Takes the arrival time of a packet [ns].
    pub fn push(&mut self, arrival: i64) {
        self.arrivals[self.count] = arrival;
        self.count += 1;
        if self.count == WINDOW {
            self.count = 0;
            let found = self.find();
            if found.is_some() && found == self.last {
                self.known = found;
            }
            self.last = found;
        }
    }

    /// The interval [s]; `None` until two windows agree on one. A link may change its interval at any time.
    pub fn secs(&self) -> Option<f64> {
        self.known.map(|units| units as f64 * UNIT_SECS)
    }

    /// The longest interval on whose lattice the window lies [units].
    fn find(&self) -> Option<usize> {
        (SHORTEST_UNITS..=LONGEST_UNITS).rev().find(|&units| {
            let fits = self.direction(units);
            fits > ON_LATTICE && !self.has_better_part(units, fits) && !self.is_ambiguous(units)
        })
    }

    /// The mean resultant length of arrivals modulo this interval [0..1].
    fn direction(&self, units: usize) -> f64 {
        let per_nano = TAU / (units as f64 * UNIT_SECS * 1e9);
        let (mut x, mut y) = (0.0, 0.0);
        for arrival in self.arrivals {
            let (sin, cos) = (arrival.saturating_sub(self.arrivals[0]) as f64 * per_nano).sin_cos();
            (x, y) = (x + cos, y + sin);
        }
        f64::hypot(x, y) / WINDOW as f64
    }

    /// Whether packets also arrive between the events, at a half, a third or a quarter of the interval.
    fn has_better_part(&self, units: usize, fits: f64) -> bool {
        (2..=4)
            .filter(|parts| units.is_multiple_of(*parts) && units / parts >= SHORTEST_UNITS)
            .any(|parts| self.direction(units / parts) > fits + BETTER)
    }

    /// Whether almost every packet came the same number of events after the previous one.
    fn is_ambiguous(&self, units: usize) -> bool {
        let nanos = units as f64 * UNIT_SECS * 1e9;
        let mut steps: [i64; WINDOW - 1] = std::array::from_fn(|k| {
            (self.arrivals[k + 1].saturating_sub(self.arrivals[k]) as f64 / nanos).round() as i64
        });
        steps.sort_unstable();
        let (mut of_one_event, mut most) = (0, 0);
        for same in steps.chunk_by(|a, b| a == b) {
            if same[0] == 0 {
                of_one_event = same.len();
            } else {
                most = most.max(same.len());
            }
        }
        most as f64 > SAME_STEP * (steps.len() - of_one_event) as f64
            && (of_one_event as f64) < SAME_EVENT * steps.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::clock::simulated::Device;

    /// The estimate for packets sent at `period` [s] over a link with this interval [s, 0 for none].
    fn found(interval: f64, period: f64, fails: f64, packets: usize) -> Option<f64> {
        let mut random = Device::new(1.0);
        let mut finder = ConnectionInterval::default();
        for number in 0..packets {
            // The device's clock is 40 ppm off that of the link.
            let sent = 3.1 + number as f64 * period * 1.000_04;
            let mut taken = sent;
            if interval > 0.0 {
                taken = (sent / interval).ceil() * interval;
                while random.uniform() < fails {
                    taken += interval;
                }
            }
            let host_secs = 0.000_3 * -(1.0 - random.uniform()).ln();
            finder.push(((taken + host_secs) * 1e9) as i64);
        }
        finder.secs()
    }

    #[test]
    fn an_interval_is_found_at_any_rate_of_packets() {
        for interval in [0.0075, 0.01125, 0.015, 0.030, 0.045, 0.050] {
            for period in [0.01, 1.0 / 52.0, 0.0771, 73.0 / 130.0] {
                let secs = found(interval, period, 0.05, 2_000);
                assert_eq!(secs, Some(interval), "interval {interval} s, period {period} s");
            }
        }
    }

    #[test]
    fn without_a_lattice_none_is_found() {
        for period in [0.0083, 1.0 / 52.0, 0.0771, 0.5615] {
            let mut random = Device::new(1.0);
            let mut finder = ConnectionInterval::default();
            for number in 0..2_000 {
                let delay = 0.02 * random.uniform();
                finder.push(((f64::from(number) * period + delay) * 1e9) as i64);
            }
            assert_eq!(finder.secs(), None, "period {period} s");
        }
    }

    #[test]
    fn packets_that_beat_with_their_link_show_none() {
        assert_eq!(found(0.050, 0.1, 0.0, 2_000), None);
        assert_eq!(found(0.0, 0.1, 0.0, 2_000), None);
        assert_eq!(found(0.0, 0.008, 0.0, 2_000), None);
    }

    proptest! {
        #[test]
        fn no_arrivals_make_it_panic(arrivals in prop::collection::vec(any::<i64>(), 0..300)) {
            let mut finder = ConnectionInterval::default();
            for arrival in arrivals {
                finder.push(arrival);
            }
            let secs = finder.secs();
            prop_assert!(secs.is_none_or(|secs| (0.0075..=0.1).contains(&secs)));
        }
    }
}
