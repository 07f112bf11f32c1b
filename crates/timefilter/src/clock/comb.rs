//! Packets whose waits repeat after a few periods, which together last a whole number of a link's intervals.
//!
//! At 52 Hz over an interval of 25 ms, thirteen packets take ten events: each of the thirteen always waits about as
//! long as ten events before, the waits are 1.9 ms apart, and the shortest wait is anywhere between zero and 1.9 ms.
//! Only the difference between the clocks of device and link changes the waits, over minutes, so that the lowest delays
//! follow a sawtooth as high as the distance between waits. A line under one edge of a tooth is wrong by up to the
//! tooth's height, and its residuals do not show that.

use std::f64::consts::TAU;

use super::fit::{Fit, Point};
use super::interval::{SHORTEST_UNITS, UNIT_SECS};

/// The longest connection interval searched for [units]: 50 ms.
const LONGEST_UNITS: usize = 40;
/// The most packets in a turn of the comb.
const MOST_PACKETS: usize = 16;
/// How close the duration of a turn is to a whole number of intervals [fraction].
const WHOLE: f64 = 3e-4;
/// The number of turns in a stretch: in fewer, all packets with the shortest wait may have been retransmitted.
const TURNS: f64 = 5.0;
/// The factor from the mean resultant length of delays, modulo the height of a tooth, to the share of the possible
/// deviation that is stated.
const PART: f64 = 2.0;
/// The shortest stretch [s].
const LEAST_SECS: f64 = 10.0;

/// The evenly spaced waits of packets.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Comb {
    /// The distance between waits [s]; 0 if there is no comb.
    apart: f64,
    /// The duration of a stretch in which a packet with the shortest wait has certainly arrived in time [s].
    stretch: f64,
}

impl Comb {
    /// No comb.
    pub const NONE: Comb = Comb { apart: 0.0, stretch: 0.0 };

    /// Finds the comb of packets sent every `period` [s], for the longest interval on whose lattice they arrive; `None`
    /// without one.
    pub fn of(period: f64, is_lattice: impl Fn(f64) -> bool) -> Option<Comb> {
        (SHORTEST_UNITS..=LONGEST_UNITS).rev().find_map(|units| {
            let interval = units as f64 * UNIT_SECS;
            let is_whole = |packets: &usize| {
                let events = *packets as f64 * period / interval;
                (events - events.round()).abs() < WHOLE * events
            };
            // Regular arrivals lie on the lattice of their own period, whatever the link.
            let packets = (1..=MOST_PACKETS).find(is_whole).filter(|packets| *packets > 1)?;
            let comb = Comb {
                apart: interval / packets as f64,
                stretch: (TURNS * packets as f64 * period).max(LEAST_SECS),
            };
            is_lattice(interval).then_some(comb)
        })
    }

    /// How far a line under points may be from its usual level, the middle of the teeth, according to the lowest delays
    /// [s]: the packets with these delays waited for any time from zero to the height of a tooth.
    pub fn off_level(&self, points: impl Iterator<Item = Point>, line: &Fit) -> f64 {
        if self.apart <= 0.0 {
            return 0.0;
        }
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut lowest, mut until) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut x, mut y, mut count) = (0.0, 0.0, 0.0);
        for point in points {
            let above = point.delay - line.at(point.device);
            let (sin, cos) = (TAU * above / self.apart).sin_cos();
            (x, y, count) = (x + cos, y + sin, count + 1.0);
            if point.device >= until {
                if lowest.is_finite() {
                    (least, most) = (least.min(lowest), most.max(lowest));
                }
                (lowest, until) = (f64::INFINITY, point.device + self.stretch);
            }
            lowest = lowest.min(above);
        }
        let middle = self.apart / 2.0;
        if least > most {
            return middle;
        }
        let unseen = (self.apart - (most - least)).max(0.0);
        let off = (-least - middle).abs().max((unseen - least - middle).abs());
        // Whichever packet of a turn is the lowest, its wait shows which part of a tooth was seen.
        let direction = f64::hypot(x, y) / count;
        off.min(middle) * (PART * direction).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_under_one_edge_of_a_tooth_may_be_half_a_tooth_off_and_one_under_many_is_not() {
        let comb =
            Comb::of(1.0 / 52.0, |interval| (interval - 0.025).abs() < 1e-9).unwrap_or(Comb::NONE);
        assert!((comb.apart - 0.025 / 13.0).abs() < 1e-9, "{comb:?}");
        let off = |tooth_secs: f64| {
            let point = |bin: i32| {
                let device = 2.0 * f64::from(bin);
                Point { device, delay: comb.apart * (device / tooth_secs).fract() }
            };
            let line = Fit::level(Point { device: 0.0, delay: comb.apart * 0.05 });
            comb.off_level((0..100).map(point), &line)
        };
        assert!(off(4000.0) > 0.4 * comb.apart, "{}", off(4000.0));
        assert!(off(41.0) < 0.1 * comb.apart, "{}", off(41.0));
    }

    #[test]
    fn regular_arrivals_alone_are_no_comb() {
        assert!(Comb::of(0.02, |interval| (interval - 0.02).abs() < 1e-9).is_none());
    }
}
