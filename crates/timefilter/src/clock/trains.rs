//! The streams of a device: their sampling periods, and whether sample indices and device time advance
//! consistently.

mod train;

use self::train::{KNOWN, TOLERANCE, Train, Wrong};
use super::Stamps;

/// The most streams that are followed; further ones replace the oldest.
const TRAINS: usize = 8;
/// How long after an unexplained step sample indices do not vouch for the clock [ns].
const UNEXPLAINED_NANOS: i64 = 60_000_000_000;

/// The state of each stream.
#[derive(Clone, Debug, Default)]
pub(super) struct Trains {
    trains: [Option<Train>; TRAINS],
    /// The slot that is reused next.
    next: usize,
}

/// What a packet's sample index implies about device time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum IndexCheck {
    /// They are consistent, or nothing can be concluded.
    Consistent,
    /// The clock may have been set; wait for more packets.
    Wait,
    /// The clock was set forward by this much [ns].
    Set(i64),
    /// The clock is behind its reading before a silence: it was set back or restarted meanwhile.
    Behind,
}

impl Trains {
    /// The slot of a packet's stream, which is added if it is new.
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

    /// The sampling period [ns]: the learned value if it is close to the declared one.
    pub fn period(&mut self, place: usize, declared_nanos: f64) -> f64 {
        let Some(train) = self.at(place) else { return declared_nanos };
        if train.wrong != Wrong::No {
            return train.period_nanos;
        }
        let near = (train.period_nanos / declared_nanos - 1.0).abs() <= TOLERANCE;
        if near { train.period_nanos } else { declared_nanos }
    }

    /// The declared and the true period [ns], if the declared one has just been found to be wrong.
    pub fn take_wrong(&mut self, place: usize) -> Option<(f64, f64)> {
        let train = self.at(place)?;
        let Wrong::Found(declared_nanos) = train.wrong else { return None };
        train.wrong = Wrong::Reported;
        Some((declared_nanos, train.period_nanos))
    }

    /// Compares a packet's index with its device time. `ahead` is how early it arrived relative to the
    /// envelope and the uncertainty of that [s], if known.
    pub fn hold(
        &mut self,
        place: usize,
        stamps: &Stamps,
        device: i64,
        ahead: Option<(f64, f64)>,
    ) -> IndexCheck {
        self.at(place).map_or(IndexCheck::Consistent, |train| train.hold(stamps, device, ahead))
    }

    /// Whether sample indices show that the device's clock runs on, regardless of delays; and the packet
    /// period [s], 0 if irregular.
    pub fn vouches(&self, place: usize, stamps: &Stamps) -> (bool, f64) {
        let Some(train) = &self.trains[place] else { return (false, 0.0) };
        if train.packets < KNOWN || train.rough > train.most_rough() {
            return (false, 0.0);
        }
        let explained = stamps.arrival.saturating_sub(train.unexplained) > UNEXPLAINED_NANOS;
        (explained, train.period_nanos * f64::from(stamps.count) / 1e9)
    }

    /// The end of the previous batch [ns of session time].
    pub fn end_before(&self, place: usize) -> i64 {
        self.trains[place].map_or(i64::MIN, |train| train.end)
    }

    /// Records the end of a batch [ns of session time].
    pub fn ended(&mut self, place: usize, end: i64) {
        if let Some(train) = self.at(place) {
            train.end = train.end.max(end);
        }
    }

    /// Starts a new epoch: the ends and arrivals of earlier batches no longer apply.
    pub fn begin(&mut self) {
        for train in self.trains.iter_mut().flatten() {
            (train.end, train.arrival) = (i64::MIN, i64::MAX);
        }
    }
}
