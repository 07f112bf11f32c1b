//! The streams of a device: how far apart their samples are, and whether numbers and device time go
//! on together.

mod train;

use self::train::{KNOWN, TOLERANCE, Train, Wrong};
use super::Stamps;

/// How many streams a device may have; more share places.
const TRAINS: usize = 8;
/// For how long after a step that was not understood numbers do not vouch [ns].
const UNEXPLAINED_NANOS: i64 = 60_000_000_000;

/// What is known of each stream.
#[derive(Clone, Debug, Default)]
pub(super) struct Trains {
    trains: [Option<Train>; TRAINS],
    /// The place that is given away next.
    next: usize,
}

/// What a packet's number says of its device time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Word {
    /// They go on together, or nothing can be said.
    Goes,
    /// Perhaps the clock was set; wait for what follows.
    Wait,
    /// The clock was set, ahead by so much [ns].
    Set(i64),
}

impl Trains {
    /// The place of the stream of a packet; it is begun where it is new.
    pub fn of(&mut self, stamps: &Stamps, device: i64) -> usize {
        let known =
            |train: &Option<Train>| train.is_some_and(|train| train.stream == stamps.stream);
        if let Some(place) = self.trains.iter().position(known) {
            return place;
        }
        let place = self.next;
        self.next = (self.next + 1) % TRAINS;
        self.trains[place] = Some(Train::new(stamps, device));
        place
    }

    fn at(&mut self, place: usize) -> Option<&mut Train> {
        self.trains[place].as_mut()
    }

    /// From one sample of a batch to the next [ns]: what was learned, while it is near to what its
    /// driver says.
    pub fn period(&mut self, place: usize, said_nanos: f64) -> f64 {
        let Some(train) = self.at(place) else { return said_nanos };
        if train.wrong != Wrong::No {
            return train.period_nanos;
        }
        let near = (train.period_nanos / said_nanos - 1.0).abs() <= TOLERANCE;
        if near { train.period_nanos } else { said_nanos }
    }

    /// What a stream's driver said the period is and what it is instead [ns], where that has just been found.
    pub fn take_wrong(&mut self, place: usize) -> Option<(f64, f64)> {
        let train = self.at(place)?;
        let Wrong::Found(said_nanos) = train.wrong else { return None };
        train.wrong = Wrong::Reported;
        Some((said_nanos, train.period_nanos))
    }

    /// Holds a packet's number against its device time; it came so much ahead of where the envelope
    /// has it [s], as far as there is one, which is uncertain by `spread` [s].
    pub fn hold(
        &mut self,
        place: usize,
        stamps: &Stamps,
        device: i64,
        ahead: Option<(f64, f64)>,
    ) -> Word {
        self.at(place).map_or(Word::Goes, |train| train.hold(stamps, device, ahead))
    }

    /// Whether numbers show that the device's clock goes on, whatever delays are; and from one
    /// packet to the next [s], 0 where that is irregular.
    pub fn vouches(&self, place: usize, stamps: &Stamps) -> (bool, f64) {
        let Some(train) = &self.trains[place] else { return (false, 0.0) };
        if train.packets < KNOWN || train.rough > train.most_rough() {
            return (false, 0.0);
        }
        let explained = stamps.arrival.saturating_sub(train.unexplained) > UNEXPLAINED_NANOS;
        (explained, train.period_nanos * f64::from(stamps.count) / 1e9)
    }

    /// Where the batch before this one ended [ns, session's time].
    pub fn end_before(&self, place: usize) -> i64 {
        self.trains[place].map_or(i64::MIN, |train| train.end)
    }

    /// A batch ended there [ns, session's time].
    pub fn ended(&mut self, place: usize, end: i64) {
        if let Some(train) = self.at(place) {
            train.end = train.end.max(end);
        }
    }

    /// What came to be in another epoch says nothing of where the last batch ended.
    pub fn begin(&mut self) {
        for train in self.trains.iter_mut().flatten() {
            train.end = i64::MIN;
        }
    }
}
