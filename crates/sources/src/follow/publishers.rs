//! Decides which publisher of a person's topic is primary: one at a time.

use std::collections::{BTreeMap, BTreeSet};

use teampulse_core::time::Time;
use teampulse_ros::graph::Gid;

/// How long to wait for the departure of the current publisher before a newcomer counts as a second publisher [s]. A
/// restarted node leaves and joins almost simultaneously, but the two events arrive separately.
const GOODBYE_SECS: f64 = 0.1;
/// Another publisher takes over after a silence of `SILENCE_SECS` plus `SILENCES` times the longest silence before.
const SILENCE_SECS: f64 = 2.0;
const SILENCES: f64 = 3.0;
/// The silence after which a publisher that has sent a single message is replaced [s].
const SILENCE_OF_ONE_SECS: f64 = 10.0;
/// The largest number of secondary publishers that are kept separate.
pub(super) const MOST_BESIDE: usize = 8;
/// The largest number of newcomers that wait for this decision; more count as second publishers immediately.
const MOST_NEWCOMERS: usize = 64;

/// The publishers of one topic.
#[derive(Debug, Default)]
pub(super) struct Publishers {
    heard: Option<Heard>,
    /// The secondary publishers, each at the index of its stream.
    beside: Vec<Option<Gid>>,
    /// When each newcomer started to wait.
    newcomers: BTreeMap<Gid, Time>,
    /// The publishers last listed by the bus, and when it listed them; publishers missing from a new list have left.
    shown: BTreeSet<Gid>,
    shown_at: Option<Time>,
    changes: Vec<Change>,
}

/// Which stream a message belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// The stream of the topic.
    Heard,
    /// The separate stream of a secondary publisher, with this index.
    Beside(usize),
    /// The decision is not made yet: ask again.
    Unknown,
    /// No stream: there are too many publishers.
    Refused,
}

/// A change of the publishers of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    /// Another publisher of the topic appeared; it is kept separate at this index.
    Beside(usize),
    /// Another publisher became primary, as the previous one was silent.
    TookOver,
}

/// The primary publisher.
#[derive(Debug)]
struct Heard {
    gid: Gid,
    last: Time,
    messages: u64,
    longest_silence_secs: f64,
}

impl Heard {
    fn new(gid: Gid, now: Time) -> Heard {
        Heard { gid, last: now, messages: 0, longest_silence_secs: 0.0 }
    }

    fn speaks(&mut self, now: Time) {
        if self.messages > 0 {
            self.longest_silence_secs = self.longest_silence_secs.max(now.secs_since(self.last));
        }
        (self.last, self.messages) = (now, self.messages + 1);
    }

    fn is_silent(&self, now: Time) -> bool {
        let usual_secs = match self.messages {
            0 | 1 => SILENCE_OF_ONE_SECS,
            _ => SILENCE_SECS + SILENCES * self.longest_silence_secs,
        };
        now.secs_since(self.last) > usual_secs
    }
}

impl Publishers {
    /// Returns the stream that a message arriving at `now` belongs to.
    pub(super) fn place(&mut self, gid: Gid, now: Time) -> Place {
        let heard = self.heard.get_or_insert_with(|| Heard::new(gid, now));
        if heard.gid == gid {
            heard.speaks(now);
            return Place::Heard;
        }
        let is_silent = heard.is_silent(now);
        if is_silent || self.has_left() {
            if is_silent {
                self.changes.push(Change::TookOver);
            }
            self.succeed(gid, now);
            return Place::Heard;
        }
        if let Some(place) = self.beside.iter().position(|each| *each == Some(gid)) {
            return Place::Beside(place);
        }
        let is_full = self.newcomers.len() == MOST_NEWCOMERS;
        let since = *self.newcomers.entry(gid).or_insert(now);
        if !is_full && now.secs_since(since) < GOODBYE_SECS {
            return Place::Unknown;
        }
        self.newcomers.remove(&gid);
        self.seat_beside(gid)
    }

    /// Sets the present publishers of the topic: those missing from the list have left, and a primary publisher that
    /// left is replaced by the next one.
    pub(super) fn show(&mut self, present: &BTreeSet<Gid>, now: Time) {
        let left: Vec<Gid> = self.shown.difference(present).copied().collect();
        self.shown.clone_from(present);
        self.shown_at = Some(now);
        for gid in left {
            self.newcomers.remove(&gid);
            for seat in self.beside.iter_mut().filter(|seat| **seat == Some(gid)) {
                *seat = None;
            }
        }
        if self.has_left() {
            let oldest = self.newcomers.iter().min_by_key(|(_, since)| **since);
            let next = oldest.map(|(gid, _)| *gid).or(self.beside.iter().flatten().next().copied());
            match next {
                Some(next) => self.succeed(next, now),
                None => self.heard = None,
            }
        }
    }

    /// Whether the primary publisher has left, according to a list of publishers that is newer than its last message.
    fn has_left(&self) -> bool {
        self.heard.as_ref().is_some_and(|heard| {
            let is_newer = self.shown_at.is_some_and(|shown_at| shown_at >= heard.last);
            is_newer && !self.shown.contains(&heard.gid)
        })
    }

    /// Ends the wait: newcomers count as second publishers.
    pub(super) fn decide(&mut self) {
        self.newcomers.values_mut().for_each(|since| *since = Time::EPOCH);
    }

    /// Returns the changes of the topic's publishers since the last call.
    pub(super) fn take_changes(&mut self) -> Vec<Change> {
        std::mem::take(&mut self.changes)
    }

    /// Returns the publishers that are present and have sent a message, the primary one first.
    pub(super) fn speaking(&self) -> impl Iterator<Item = Gid> {
        let heard = self.heard.iter().map(|heard| heard.gid);
        heard.chain(self.beside.iter().flatten().copied())
    }

    fn succeed(&mut self, gid: Gid, now: Time) {
        self.newcomers.remove(&gid);
        for seat in self.beside.iter_mut().filter(|seat| **seat == Some(gid)) {
            *seat = None;
        }
        let mut heard = Heard::new(gid, now);
        heard.speaks(now);
        self.heard = Some(heard);
    }

    fn seat_beside(&mut self, gid: Gid) -> Place {
        let free = self.beside.iter().position(Option::is_none);
        let place = free.unwrap_or(self.beside.len());
        if place == MOST_BESIDE {
            return Place::Refused;
        }
        if place == self.beside.len() {
            self.beside.push(None);
        }
        self.beside[place] = Some(gid);
        self.changes.push(Change::Beside(place));
        Place::Beside(place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Gid = Gid::prefixed([1; 16]);
    const B: Gid = Gid::prefixed([2; 16]);
    const C: Gid = Gid::prefixed([3; 16]);

    fn at(millis: i64) -> Time {
        Time::from_nanos(1_700_000_000_000_000_000 + millis * 1_000_000)
    }

    /// Messages of a publisher every 250 ms up to a time.
    fn talk(publishers: &mut Publishers, gid: Gid, from: i64, to: i64) {
        for millis in (from..to).step_by(250) {
            publishers.place(gid, at(millis));
        }
    }

    #[test]
    fn a_second_publisher_is_kept_apart_and_reported_once() {
        let mut publishers = Publishers::default();
        publishers.show(&[A, B].into(), at(0));
        talk(&mut publishers, A, 0, 2000);
        assert_eq!(publishers.place(B, at(2000)), Place::Unknown);
        assert_eq!(publishers.place(B, at(2250)), Place::Beside(0));
        assert_eq!(publishers.place(A, at(2300)), Place::Heard);
        assert_eq!(publishers.place(B, at(2500)), Place::Beside(0));
        assert_eq!(publishers.take_changes(), [Change::Beside(0)]);
        assert_eq!(publishers.speaking().collect::<Vec<_>>(), [A, B]);
    }

    #[test]
    fn who_restarts_is_heard_at_once() {
        let mut publishers = Publishers::default();
        publishers.show(&[A].into(), at(0));
        talk(&mut publishers, A, 0, 2000);
        // Its first message arrives before the bus has reported that the other one left.
        assert_eq!(publishers.place(B, at(2001)), Place::Unknown);
        publishers.show(&[B].into(), at(2010));
        assert_eq!(publishers.place(B, at(2011)), Place::Heard);
        assert_eq!(publishers.take_changes(), []);
    }

    #[test]
    fn who_is_there_when_the_first_leaves_is_heard_from_then_on() {
        let mut publishers = Publishers::default();
        publishers.show(&[A, B].into(), at(0));
        talk(&mut publishers, A, 0, 1000);
        talk(&mut publishers, B, 0, 1000);
        publishers.show(&[B].into(), at(1000));
        assert_eq!(publishers.place(B, at(1001)), Place::Heard);
        assert_eq!(publishers.speaking().collect::<Vec<_>>(), [B]);
    }

    #[test]
    fn who_has_died_without_a_word_is_succeeded_after_a_silence() {
        let mut publishers = Publishers::default();
        publishers.show(&[A].into(), at(0));
        talk(&mut publishers, A, 0, 1000);
        publishers.show(&[A, B].into(), at(1100));
        assert_eq!(publishers.place(B, at(1100)), Place::Unknown);
        assert_eq!(publishers.place(B, at(2000)), Place::Beside(0));
        assert_eq!(publishers.place(B, at(3600)), Place::Heard);
        assert_eq!(publishers.take_changes(), [Change::Beside(0), Change::TookOver]);
        assert_eq!(publishers.place(A, at(3700)), Place::Unknown, "it is the newcomer now");
    }

    #[test]
    fn a_slow_sensor_is_not_taken_for_a_dead_one() {
        let mut publishers = Publishers::default();
        for minute in 0..5 {
            publishers.place(A, at(minute * 60_000));
        }
        publishers.place(B, at(4 * 60_000 + 100));
        for minute in 4..7 {
            assert_ne!(publishers.place(B, at(minute * 60_000 + 30_000)), Place::Heard);
        }
    }

    #[test]
    fn there_is_room_for_a_few_and_a_place_is_used_again() {
        let mut publishers = Publishers::default();
        let many: BTreeSet<Gid> = (0..=20).map(|id| Gid::prefixed([id; 16])).collect();
        publishers.show(&many, at(0));
        let first = *many.first().unwrap();
        let mut last = Place::Unknown;
        for millis in [0, 200] {
            for gid in &many {
                publishers.place(first, at(millis));
                last = publishers.place(*gid, at(millis));
            }
        }
        assert_eq!(last, Place::Refused);
        publishers.show(&[first, B].into(), at(300));
        talk(&mut publishers, first, 300, 600);
        publishers.place(Gid::prefixed([77; 16]), at(600));
        assert_ne!(publishers.place(Gid::prefixed([77; 16]), at(800)), Place::Refused);
        assert_ne!(publishers.place(C, at(900)), Place::Heard);
    }
}
