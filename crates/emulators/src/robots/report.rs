//! The report of one topic of a robot: when it is due, and how faults change it.

use std::time::Duration;

use super::script::{Change, Script};
use super::telegram::{Body, Telegram};
use super::time::SimTime;
use super::topic::Topic;

/// The delay of a duplicate after its message.
const DUPLICATE_AFTER: Duration = Duration::from_millis(2);

/// The report of one topic of a robot.
#[derive(Clone, Debug)]
pub struct Report {
    topic: Topic,
    stream: usize,
    period: Duration,
    due: SimTime,
    count: u64,
    said: Option<Body>,
}

impl Report {
    /// Creates a report that is first due at a time.
    pub fn new(topic: Topic, stream: usize, rate_hz: f64, due: SimTime) -> Report {
        let period = Duration::from_secs_f64(1.0 / rate_hz);
        Report { topic, stream, period, due, count: 0, said: None }
    }

    /// The topic of the report.
    pub fn topic(&self) -> Topic {
        self.topic
    }

    /// Whether the report is due; if so, it is next due a period later, and `slow_factor` lengthens the period.
    pub fn falls_due(&mut self, now: SimTime, slow_factor: f64) -> bool {
        let is_due = self.due <= now;
        if is_due {
            self.due = self.due + self.period.mul_f64(slow_factor);
        }
        is_due
    }

    /// Publishes the current measurement, subject to the faults in the script: not at all, once or twice.
    pub fn report(
        &mut self,
        measured: Body,
        now: SimTime,
        script: &Script,
        out: &mut Vec<Telegram>,
    ) {
        let has = |change| script.has(change, self.topic, now);
        self.count += 1;
        let held_back = has(Change::OutOfOrder) && self.count.is_multiple_of(2);
        let said = self.said.take().filter(|_| has(Change::Stuck)).unwrap_or(measured);
        if !has(Change::Dead) && !has(Change::Outage) {
            let at = if held_back { now + self.period.mul_f64(1.5) } else { now };
            let stamp = self.stamp(now, script);
            let telegram = Telegram { stream: self.stream, at, stamp, body: said.clone() };
            if has(Change::Duplicate) {
                out.push(Telegram { at: at + DUPLICATE_AFTER, ..telegram.clone() });
            }
            out.push(telegram);
        }
        self.said = Some(said);
    }

    /// Returns the time by the robot's clock, or by the simulation's clock for the ground truth.
    fn stamp(&self, now: SimTime, script: &Script) -> SimTime {
        let ahead_secs = if self.topic.is_truth() { 0.0 } else { script.clock_ahead_secs(now) };
        now.ahead_by(ahead_secs)
    }
}
