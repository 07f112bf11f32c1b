//! One stream in front of the pump: its numbers, its place in time, its life.

use std::collections::VecDeque;
use std::sync::Arc;

use bytes::Bytes;
use teampulse_timefilter::clock::{ClockModel, Host, Stamps};

use crate::data::Data;
use crate::life::Life;
use crate::loss::Loss;
use crate::sample::{Sample, Turn};
use crate::source::Reading;
use crate::stream::{About, Origin, Shape, Stream, StreamId};
use crate::time::Time;

/// With how many of its newest neighbours a message is compared to find it sent twice.
const NEIGHBOURS: usize = 4;

/// One stream: how its readings become samples.
#[derive(Debug)]
pub(crate) struct Track {
    pub(crate) id: StreamId,
    pub(crate) stream: Arc<Stream>,
    pub(crate) life: Life,
    /// What it is called where its health is told.
    pub(crate) told_as: String,
    /// The losses that are told on this stream, if it is one of those.
    pub(crate) tells: Option<Loss>,
    clock: Host,
    next_index: u64,
    newest: Option<Time>,
    neighbours: VecDeque<(Time, Bytes)>,
}

impl Track {
    pub(crate) fn new(id: StreamId, stream: Arc<Stream>) -> Track {
        Track {
            id,
            life: Life::new(stream.rate_hz),
            told_as: stream.name.clone(),
            tells: Loss::told_on(&stream),
            stream,
            clock: Host::default(),
            next_index: 0,
            newest: None,
            neighbours: VecDeque::with_capacity(NEIGHBOURS + 1),
        }
    }

    /// Whether its health is told: that of every raw stream but the session's own events.
    pub(crate) fn has_health(&self) -> bool {
        let own = self.stream.about == About::Session && self.stream.shape == Shape::Event;
        self.stream.origin == Origin::Raw && !own
    }

    /// Numbers a reading and gives it its place in time.
    ///
    /// A stamp equal to the log time tells nothing; a bag can't tell it from a missing one.
    pub(crate) fn sample(&mut self, mut reading: Reading, log_time: Time) -> Sample {
        reading.source_time = reading.source_time.filter(|&stamp| stamp != log_time);
        let source = reading.source_time.map(Time::nanos);
        let arrival = log_time.nanos();
        let (measured, disbelieved) = match self.stream.origin {
            Origin::Raw => {
                let corrected = self.clock.correct(&Stamps { source, ..Stamps::arrived(arrival) });
                (corrected.measured, corrected.disbelieved)
            }
            Origin::Derived => (source.unwrap_or(arrival), false),
        };
        let measured = Time::from_nanos(measured);
        self.life.arrived(log_time, reading.source_time);
        if disbelieved {
            self.life.was_disbelieved();
        }
        let turn = self.turn(measured, &reading);
        Sample {
            stream: self.id,
            measured,
            log_time,
            device_time: reading.device_time,
            source_time: reading.source_time,
            index: self.number(),
            turn,
            data: reading.data,
        }
    }

    /// The number of the next sample.
    pub(crate) fn number(&mut self) -> u64 {
        let index = self.next_index;
        self.next_index += 1;
        index
    }

    /// So many samples are missing before the next one.
    pub(crate) fn lost(&mut self, loss: Loss, count: f64) {
        match loss {
            Loss::OnTheWay => self.life.lost_on_the_way(count),
            Loss::InOurQueue => self.life.lost_in_our_queue(count),
        }
        self.next_index += count as u64;
    }

    fn turn(&mut self, measured: Time, reading: &Reading) -> Turn {
        if self.came_before(reading) {
            self.life.was_duplicate();
            return Turn::Duplicate;
        }
        if self.newest.is_some_and(|newest| measured < newest) {
            self.life.was_late();
            return Turn::Late;
        }
        self.newest = Some(measured);
        Turn::OnTime
    }

    /// Whether the same bytes with the same stamp came just before.
    fn came_before(&mut self, reading: &Reading) -> bool {
        let (Some(stamp), Data::Message(bytes)) = (reading.source_time, &reading.data) else {
            return false;
        };
        if self.neighbours.iter().any(|(known, same)| *known == stamp && same == bytes) {
            return true;
        }
        self.neighbours.push_back((stamp, bytes.clone()));
        if self.neighbours.len() > NEIGHBOURS {
            self.neighbours.pop_front();
        }
        false
    }
}
