//! Readings that came before it was clear that their clock had been set: with hindsight they belong to the next course.

use std::collections::{BTreeMap, VecDeque};

use crate::clock::epoch::Packet;
use crate::clock::one_way::{Placed, astray};

/// The most readings that wait for the next course.
const MOST_WAITING: usize = 64;

/// Readings by their number, in order of arrival.
#[derive(Clone, Debug, Default)]
pub(super) struct Held {
    readings: u64,
    waiting: VecDeque<(u64, Placed)>,
    /// The later course to which a reading belongs, and the first packet of that course.
    later: BTreeMap<u64, (u32, Packet)>,
}

impl Held {
    /// Takes the next reading, which does not fit its clock, by the device's clock since it started.
    pub fn unfit(&mut self, reading: Option<Placed>) {
        if self.waiting.len() == MOST_WAITING {
            self.waiting.pop_front();
        }
        self.waiting.extend(reading.map(|reading| (self.readings, reading)));
        self.readings += 1;
    }

    /// Takes the next reading, which is in the course that begins with this packet. If `is_new`, readings that
    /// agree with the packet and came after it are in that course, too.
    pub fn fit(&mut self, course: u32, origin: Packet, is_new: bool) {
        let waiting = self.waiting.drain(..);
        let is_later = |(_, reading): &(u64, Placed)| {
            is_new
                && reading.packet.arrival >= origin.arrival
                && astray::agree(reading.packet, origin, reading.span())
        };
        self.later.extend(waiting.filter(is_later).map(|(number, _)| (number, (course, origin))));
        self.readings += 1;
    }

    /// Starts again with the first reading.
    pub fn again(self) -> Held {
        Held { readings: 0, ..self }
    }

    /// Counts the next reading; returns the later course to which it belongs, and the first packet of that course.
    pub fn next(&mut self) -> Option<(u32, Packet)> {
        self.readings += 1;
        self.later.remove(&(self.readings - 1))
    }
}
