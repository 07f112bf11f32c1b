//! One stream in front of the pump: its numbers, its place in time, its life.

use std::collections::VecDeque;
use std::sync::Arc;

use bytes::Bytes;
use teampulse_timefilter::clock::{Corrected, Stamps};

use crate::clocks::{Clocks, UNKNOWN};
use crate::data::Data;
use crate::life::Life;
use crate::loss::Loss;
use crate::sample::{Sample, Turn};
use crate::source::Reading;
use crate::status::StreamStatus;
use crate::stream::{About, Origin, Shape, Signal, Stream, StreamId};
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
    next_index: u64,
    /// How many samples there were, of waves each one counted, and the lost ones too.
    position: u64,
    /// How many samples the last reading had.
    last_count: u32,
    newest: Option<Time>,
    neighbours: VecDeque<(Time, Bytes)>,
}

/// Whether a stream comes now and then by its nature: what happens, and what people do.
fn is_irregular(stream: &Stream) -> bool {
    stream.shape == Shape::Event || stream.signal == Signal::Input
}

impl Track {
    pub(crate) fn new(id: StreamId, stream: Arc<Stream>) -> Track {
        Track {
            id,
            life: if is_irregular(&stream) { Life::irregular() } else { Life::new(stream.rate_hz) },
            told_as: stream.name.clone(),
            tells: Loss::told_on(&stream),
            stream,
            next_index: 0,
            position: 0,
            last_count: 1,
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
    pub(crate) fn sample(
        &mut self,
        mut reading: Reading,
        log_time: Time,
        clocks: &mut Clocks,
    ) -> Sample {
        reading.source_time = reading.source_time.filter(|&stamp| stamp != log_time);
        let stamps = self.stamps(&reading, log_time);
        let Corrected { measured, period_nanos, disbelieved } = match self.stream.origin {
            Origin::Raw => clocks.correct(self.id, &self.stream, &stamps),
            Origin::Derived => Corrected {
                measured: stamps.source.unwrap_or(stamps.arrival),
                period_nanos: stamps.period_nanos,
                disbelieved: false,
            },
        };
        let measured = Time::from_nanos(measured);
        if let (Data::Wave(wave), true) = (&mut reading.data, clocks.stamps_anew()) {
            wave.period_ns = period_nanos;
        }
        self.position = self.position.saturating_add(u64::from(stamps.count));
        self.last_count = stamps.count;
        // Of our own shapes a recording has no stamp of the source's.
        let told = matches!(self.stream.shape, Shape::Message(_));
        let source_time = reading.source_time.filter(|_| told);
        self.life.arrived(stamps.count, log_time, measured, source_time);
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
            period_ns: period_nanos,
            index: self.number(),
            turn,
            data: reading.data,
        }
    }

    /// How the stream is doing at `now`, its clock included.
    pub(crate) fn status(&self, now: Time, clocks: &Clocks) -> StreamStatus {
        let clock = clocks.state(self.id).unwrap_or(UNKNOWN);
        self.life.status(&self.told_as, now, &clock, clocks.complaint(self.id))
    }

    fn stamps(&self, reading: &Reading, log_time: Time) -> Stamps {
        let (count, period_nanos) = match &reading.data {
            Data::Wave(wave) => {
                let count = wave.samples.len() / wave.channels.max(1) as usize;
                (u32::try_from(count).unwrap_or(u32::MAX).max(1), wave.period_ns)
            }
            _ => (1, 0.0),
        };
        Stamps {
            device: reading.device_time,
            source: reading.source_time.map(Time::nanos),
            arrival: log_time.nanos(),
            index: self.position,
            count,
            period_nanos,
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
        let samples = (count as u64).saturating_mul(u64::from(self.last_count));
        self.position = self.position.saturating_add(samples);
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
