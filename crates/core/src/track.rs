//! One stream in the pump: its sample numbers, its times, its health.

use std::collections::VecDeque;
use std::sync::Arc;

use bytes::Bytes;
use teampulse_timefilter::clock::{Corrected, StampOf, Stamps};

use crate::clocks::{Clocks, UNKNOWN};
use crate::computers::UNTOLD;
use crate::data::Data;
use crate::density::Density;
use crate::intake::{Intake, Shared};
use crate::life::Life;
use crate::loss::Loss;
use crate::publishers;
use crate::qos::{Durability, Qos};
use crate::sample::{Sample, Turn};
use crate::session_streams::SESSION_EVENTS;
use crate::source::Reading;
use crate::status::StreamStatus;
use crate::stopped;
use crate::stream::{About, Origin, Shape, Stream, StreamId};
use crate::time::Time;

/// The number of newest messages that a message is compared with to find duplicates.
const NEIGHBOURS: usize = 4;

/// The relative difference up to which two rates count as equal.
const SAME_RATE: f64 = 1e-6;
/// The age from which a message may have been kept for late joiners [s].
const KEPT_SECS: f64 = 1.0;
/// How long after the first message, or after a silence, kept messages may arrive [s].
const JOINING_SECS: f64 = 2.0;
/// The shortest silence after which kept messages may arrive again [s].
const SILENCE_SECS: f64 = 5.0;

/// One stream: how its readings become samples.
#[derive(Debug)]
pub(crate) struct Track {
    pub(crate) id: StreamId,
    pub(crate) stream: Arc<Stream>,
    pub(crate) life: Life,
    intake: Intake,
    density: Density,
    /// The stream's name in health reports.
    pub(crate) reported_as: String,
    /// The kind of losses that this stream reports, if any.
    pub(crate) gives: Option<Loss>,
    /// The reports in its readings that the pump itself acts on, if any.
    pub(crate) word: Option<Word>,
    /// The fault of the stream's publishers, if any.
    pub(crate) published_by: Option<String>,
    /// A declared rate that proved wrong, and the true one [Hz].
    wrong_rate: Option<(f64, f64)>,
    joining: Option<Joining>,
    next_index: u64,
    /// The number of the last sample.
    last_index: Option<u64>,
    /// The number of samples, including those within waves and the lost ones.
    position: u64,
    /// The number of samples of the last reading.
    last_count: u32,
    newest: Option<Time>,
    neighbours: VecDeque<(Time, Bytes)>,
}

/// The reports that the pump itself acts on; recognised by the stream's name, which does not change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Word {
    /// Events of the session.
    Happenings,
    /// The computer that stamps a stream, or the result of a probe of its clock.
    Computers,
    /// The publishers of a topic.
    Publishers,
    /// Streams that were stopped on purpose.
    Stopped,
}

impl Word {
    fn of(stream: &Stream) -> Option<Word> {
        match stream.name.as_str() {
            SESSION_EVENTS => Some(Word::Happenings),
            publishers::TOPIC => Some(Word::Publishers),
            stopped::TOPIC => Some(Word::Stopped),
            name if UNTOLD.contains(&name) => Some(Word::Computers),
            _ => None,
        }
    }
}

/// The period in which messages that were kept for late joiners may arrive.
#[derive(Debug)]
struct Joining {
    /// Whether a publisher keeps messages for late joiners.
    is_kept: bool,
    /// When readings began to arrive, at first or after a silence.
    began: Time,
    /// When the last reading arrived.
    last: Time,
}

fn is_same_rate(hz: f64, other_hz: f64) -> bool {
    (hz / other_hz - 1.0).abs() < SAME_RATE
}

impl Track {
    pub(crate) fn new(id: StreamId, stream: Arc<Stream>) -> Track {
        Track {
            id,
            life: if stream.is_irregular() { Life::irregular() } else { Life::new(stream.rate_hz) },
            reported_as: stream.name.clone(),
            intake: Intake::default(),
            density: Density::default(),
            gives: Loss::of_stream(&stream),
            word: Word::of(&stream),
            published_by: None,
            wrong_rate: None,
            joining: None,
            stream,
            next_index: 0,
            last_index: None,
            position: 0,
            last_count: 1,
            newest: None,
            neighbours: VecDeque::with_capacity(NEIGHBOURS + 1),
        }
    }

    /// Takes in a new declaration, in which a rate that proved wrong stays corrected. Returns whether it contains
    /// anything new: a replay corrects the rate itself, and then reads the same declaration from the recording.
    pub(crate) fn redeclare(&mut self, stream: &Arc<Stream>) -> bool {
        let stream = self.with_true_rate(stream);
        let is_new = self.wrong_rate.is_none() || stream != self.stream;
        self.life.declare_rate(stream.rate_hz);
        self.stream = stream;
        is_new
    }

    /// Replaces the declared rate by the true one [Hz]; returns whether this stream had the declared rate.
    pub(crate) fn correct_rate(&mut self, declared_hz: f64, hz: f64) -> bool {
        let has_it = is_same_rate(self.stream.rate_hz, declared_hz);
        if has_it {
            let hundredths = (hz * 100.0).round() / 100.0;
            self.wrong_rate = Some((self.stream.rate_hz, hundredths));
            self.redeclare(&Arc::clone(&self.stream));
        }
        has_it
    }

    fn with_true_rate(&self, stream: &Arc<Stream>) -> Arc<Stream> {
        match self.wrong_rate {
            Some((declared_hz, rate_hz)) if is_same_rate(stream.rate_hz, declared_hz) => {
                Arc::new(Stream { rate_hz, ..Stream::clone(stream) })
            }
            _ => Arc::clone(stream),
        }
    }

    /// Numbers a reading and corrects its time.
    ///
    /// A stamp equal to the log time is ignored, as it can't be distinguished from a missing stamp in a bag.
    pub(crate) fn sample(
        &mut self,
        mut reading: Reading,
        log_time: Time,
        clocks: &mut Clocks,
    ) -> Sample {
        // A bag has no times before 1970, and a replay must see the same stamps.
        let source_time = reading.source_time.map(|stamp| stamp.max(Time::EPOCH));
        reading.source_time = source_time.filter(|&stamp| stamp != log_time);
        let is_history = self.stream.origin == Origin::Raw && self.is_history(&reading, log_time);
        let is_message = matches!(self.stream.shape, Shape::Message(_));
        let stamp_of = match (is_message, is_history) {
            (_, true) => StampOf::Kept,
            (true, false) => StampOf::Sent,
            (false, false) => StampOf::Measured,
        };
        let stamps = self.stamps(&reading, log_time, stamp_of);
        let Corrected { measured, period_nanos, disbelieved } = match self.stream.origin {
            // Old messages say nothing about the publisher's clock.
            Origin::Raw if !(is_history && is_message) => {
                clocks.correct(self.id, &self.stream, &stamps)
            }
            Origin::Raw | Origin::Derived => Corrected {
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
        if is_history {
            self.life.was_given_history(log_time);
        } else {
            // A recording has no source stamp for our own messages.
            let source_time = reading.source_time.filter(|_| is_message);
            self.life.arrived(stamps.count, log_time, measured, source_time);
            if disbelieved {
                self.life.was_disbelieved();
            }
        }
        let turn = self.turn(measured, &reading, is_history);
        if turn == Turn::OnTime && matches!(reading.data, Data::Wave(_)) {
            let stated_hz = self.stated_hz(period_nanos);
            self.density.came(stamps.count.into(), measured, log_time, stated_hz);
        }
        Sample {
            stream: self.id,
            measured,
            log_time,
            device_time: reading.device_time,
            source_time: reading.source_time,
            period_ns: period_nanos,
            index: self.number(reading.index),
            turn,
            data: reading.data,
        }
    }

    /// The stated rate, by the period of a wave [ns] or by the description, whichever is lower [Hz]; 0 if neither
    /// states one.
    fn stated_hz(&self, period_nanos: f64) -> f64 {
        let rates_hz = [1e9 / period_nanos, self.stream.rate_hz];
        let stated_hz = rates_hz.into_iter().filter(|hz| hz.is_finite() && *hz > 0.0);
        stated_hz.reduce(f64::min).unwrap_or(0.0)
    }

    /// Marks a sample that is on time or late as excess once the limit for features is reached.
    pub(crate) fn bound(&mut self, sample: &mut Sample, all: &mut Shared) {
        let is_computed_with = matches!(sample.turn, Turn::OnTime | Turn::Late);
        if is_computed_with && !self.intake.admits(all, &self.stream, &sample.data, sample.log_time)
        {
            sample.turn = Turn::Excess;
        }
    }

    /// The status of the stream at `now`, including its clock.
    pub(crate) fn status(&self, now: Time, clocks: &Clocks) -> StreamStatus {
        let clock = clocks.state(self.id).unwrap_or(UNKNOWN);
        let of_publishers = || self.published_by.clone();
        let of_clock = || clocks.complaint(self.id);
        let of_density = || self.density.complaint();
        let complaint = self.intake.complaint(now).or_else(of_publishers);
        let complaint = complaint.or_else(of_density).or_else(of_clock);
        self.life.status(&self.reported_as, now, &clock, complaint)
    }

    fn stamps(&self, reading: &Reading, log_time: Time, stamp_of: StampOf) -> Stamps {
        let period_nanos = match &reading.data {
            Data::Wave(wave) => wave.period_ns,
            _ => 0.0,
        };
        Stamps {
            device: reading.device_time,
            source: reading.source_time.map(Time::nanos),
            stamp_of,
            arrival: log_time.nanos(),
            stream: self.id.0,
            index: self.position,
            count: reading.data.samples(),
            period_nanos,
        }
    }

    /// Numbers the next sample: with the publisher's `own` number if that is higher than the last one, so that gaps
    /// show here, too; otherwise with the next number.
    pub(crate) fn number(&mut self, own: Option<u64>) -> u64 {
        let goes_on = |own: &u64| self.last_index.is_none_or(|last| *own > last);
        let index = own.filter(goes_on).unwrap_or(self.next_index);
        self.last_index = Some(index);
        self.next_index = index.saturating_add(1);
        index
    }

    /// Notes that this many samples are missing before the next reading; `None` if losses can't be known.
    pub(crate) fn lost(&mut self, loss: Loss, samples: Option<u64>) {
        match loss {
            Loss::OnTheWay => self.life.lost_on_the_way(samples),
            Loss::InOurQueue => self.life.lost_in_our_queue(samples.unwrap_or(0)),
        }
        let samples = samples.unwrap_or(0);
        self.position = self.position.saturating_add(samples);
        // Readings are numbered, not samples: a loss shorter than a wave shows as a gap, too.
        let readings = samples.div_ceil(self.last_count.into());
        self.next_index = self.next_index.saturating_add(readings);
    }

    fn turn(&mut self, measured: Time, reading: &Reading, is_history: bool) -> Turn {
        if self.came_before(reading) {
            self.life.was_duplicate();
            return Turn::Duplicate;
        }
        if self.newest.is_some_and(|newest| measured < newest) {
            // The kept messages of two publishers arrive one after the other.
            if !is_history {
                self.life.was_late();
            }
            return Turn::Late;
        }
        self.newest = Some(measured);
        Turn::OnTime
    }

    /// Whether a publisher kept a reading for late joiners: it was published long before it arrived, and arrived with
    /// the first readings or, if it is a message, after a silence.
    ///
    /// Uses only values that a recording contains, too: the quality of service offered at the first reading, and stored
    /// stamps.
    fn is_history(&mut self, reading: &Reading, log_time: Time) -> bool {
        let is_message = matches!(self.stream.shape, Shape::Message(_));
        let joining = self.joining.get_or_insert_with(|| {
            let keeps = |qos: &Qos| qos.durability == Durability::TransientLocal;
            let may_be_kept =
                self.stream.shape == Shape::Event && self.stream.about != About::Session;
            let is_kept = (is_message || may_be_kept) && self.stream.qos.iter().any(keeps);
            Joining { is_kept, began: log_time, last: log_time }
        });
        if is_message && log_time.secs_since(joining.last) >= SILENCE_SECS {
            joining.began = log_time;
        }
        joining.last = log_time;
        let is_old = |stamp: Time| log_time.secs_since(stamp) > KEPT_SECS;
        joining.is_kept
            && log_time.secs_since(joining.began) <= JOINING_SECS
            && reading.source_time.is_some_and(is_old)
    }

    /// Whether the same bytes with the same stamp arrived just before.
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
