//! A number of a stream that an alert of the study watches.

use std::sync::Arc;

use teampulse_core::alerts::Why;
use teampulse_core::data::{Data, Reason};
use teampulse_core::sample::Sample;
use teampulse_core::stream::{About, Stream, StreamId};
use teampulse_core::time::Time;
use teampulse_messages::readout::Readout;

use super::alerts::{Alerts, Cause, Concern, Said, Topic};
use crate::people::estimates;
use crate::thresholds::{Limit, Threshold};

/// How many times its declared interval a slow stream may be silent.
const INTERVALS: f64 = 3.0;

/// A number of a stream that an alert of the study watches.
pub(super) struct WatchedNumber {
    cause: Cause,
    concern: Concern,
    limit: Limit,
    for_secs: f64,
    silent_secs: f64,
    /// The index of the number's channel, and how many channels there are.
    place: (usize, usize),
    readout: Readout,
    state: State,
    /// The measured time of the newest value.
    newest: Option<Time>,
    /// When a value last arrived, or was first expected.
    heard: Option<Time>,
}

/// What is known about the number.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Fine,
    /// Beyond the limit since this time, but not yet for long enough.
    Beyond(Time),
    Raised,
    /// Raised, and silent since.
    Unknown,
}

impl WatchedNumber {
    /// The number of a stream that an alert watches; `None` if it does not watch the stream.
    pub(super) fn of(
        (number, alert): (usize, &Threshold),
        id: StreamId,
        stream: &Stream,
    ) -> Option<WatchedNumber> {
        let place = alert.place_in(stream)?;
        let (limit, subject) = (alert.limit()?, alert.about(stream)?);
        let topic = match subject.about {
            About::Person if stream.family == estimates::FAMILY => {
                Topic::Estimates(subject.id.clone())
            }
            About::Person => Topic::Person(subject.id.clone()),
            About::Robot | About::Team | About::Session => Topic::Team,
        };
        let why = Why::Limit(alert.reason(stream, place));
        let slow_secs = if stream.rate_hz > 0.0 { INTERVALS / stream.rate_hz } else { 0.0 };
        Some(WatchedNumber {
            cause: (id, number),
            concern: Concern { topic, subject, why, tier: Some(alert.tier) },
            limit,
            for_secs: alert.for_secs,
            silent_secs: alert.silent_secs.max(slow_secs),
            place: (place, stream.channels.len()),
            readout: Readout::of(stream)?,
            state: State::Fine,
            newest: None,
            heard: None,
        })
    }

    /// The stream that reports the alerts on this number.
    pub(super) fn topic(&self) -> &Topic {
        &self.concern.topic
    }

    /// The position of its alert in the study.
    pub(super) fn number(&self) -> usize {
        self.cause.1
    }

    /// Whether both watch the same number for the same alert.
    pub(super) fn is_same(&self, other: &WatchedNumber) -> bool {
        self.cause == other.cause && self.concern == other.concern
    }

    /// The same watched number, with the state from an earlier declaration of the stream.
    pub(super) fn continuing(self, before: &WatchedNumber) -> WatchedNumber {
        WatchedNumber { state: before.state, newest: before.newest, heard: before.heard, ..self }
    }

    /// Takes in a sample of the stream. A late one, after newer values, changes nothing.
    pub(super) fn push(&mut self, sample: &Sample, alerts: &mut Alerts) {
        let (place, width) = self.place;
        let is_nothing = is_nothing(&sample.data, place);
        let Some(numbers) = self.readout.read(&sample.data) else { return };
        let numbers: Arc<[f64]> =
            numbers.chunks(width).filter_map(|all| all.get(place)).copied().collect();
        for (step, number) in numbers.iter().enumerate() {
            let after_ns = (sample.period_ns * step as f64).round() as i64;
            let at = Time::from_nanos(sample.measured.nanos().saturating_add(after_ns));
            if self.newest.is_some_and(|newest| at < newest) {
                continue;
            }
            if is_nothing || number.is_finite() {
                self.newest = Some(at);
                self.heard =
                    Some(self.heard.map_or(sample.log_time, |heard| heard.max(sample.log_time)));
                self.judge(*number, is_nothing, at, alerts);
            }
        }
    }

    fn judge(&mut self, number: f64, is_nothing: bool, at: Time, alerts: &mut Alerts) {
        let is_beyond = !is_nothing && self.limit.is_beyond(number);
        let is_back = is_nothing || self.limit.is_back(number);
        let next = match self.state {
            State::Fine if is_beyond => State::Beyond(at),
            State::Beyond(_) if !is_beyond => State::Fine,
            State::Raised | State::Unknown if is_back => State::Fine,
            // Between the limit and the number at which it clears, the alert continues.
            State::Unknown => State::Raised,
            state => state,
        };
        let next = match next {
            State::Beyond(since) if at.secs_since(since) >= self.for_secs => State::Raised,
            next => next,
        };
        let before = std::mem::replace(&mut self.state, next);
        let said = match (before, next) {
            (State::Raised | State::Unknown, State::Fine) => Said::Fine,
            (State::Fine | State::Beyond(_) | State::Unknown, State::Raised) => Said::Needs(number),
            _ => return,
        };
        alerts.take(&self.concern, self.cause, said, at);
    }

    /// Advances the time: after a silence, counting restarts, and an alert becomes unknown.
    pub(super) fn tick(&mut self, now: Time, alerts: &mut Alerts) {
        let heard = *self.heard.get_or_insert(now);
        if now.secs_since(heard) <= self.silent_secs {
            return;
        }
        match self.state {
            State::Beyond(_) => self.state = State::Fine,
            State::Raised => {
                self.state = State::Unknown;
                alerts.take(&self.concern, self.cause, Said::Unknown, now);
            }
            State::Fine | State::Unknown => {}
        }
    }

    /// Notes that nothing could arrive before `until`.
    pub(super) fn stood_still(&mut self, until: Time) {
        self.heard = self.heard.map(|heard| heard.max(until));
    }
}

/// Whether the event that a number describes has not happened, or is over.
fn is_nothing(data: &Data, place: usize) -> bool {
    let Data::Feature(values) = data else { return false };
    values.reasons.get(place) == Some(&Reason::Nothing)
}
