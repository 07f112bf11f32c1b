//! Packets that beat with the events at which a link takes them: delays go through a saw-tooth.

mod teeth;

pub(super) use self::teeth::Teeth;
use super::epoch::Packet;
use super::fit::Point;

/// How many arrivals are looked at.
const ARRIVALS: usize = 64;
/// How well arrivals lie on a lattice: the length of their mean direction.
const ON_LATTICE: f64 = 0.8;
/// How near to a whole part of the period a step of delays is, as a part of itself.
const NEAR: f64 = 0.2;
/// The shortest interval of a Bluetooth link, nearly [s].
const SHORTEST_SECS: f64 = 0.0074;
/// The longest interval of a link [s].
const LONGEST_SECS: f64 = 0.11;
/// How many events a period may have.
const MOST_EVENTS: f64 = 40.0;
/// For how long after the last step of delays they are taken to beat [ns].
const BEATS_NANOS: i64 = 3_600_000_000_000;
/// What is stated of a saw-tooth that is not followed, as a part of its height.
const STATED: f64 = 0.6;
/// How high the gate is for a saw-tooth, as a part of its height: it may be half of that above what is in the middle
/// of its band, and step.
const GATE: f64 = 2.2;
/// After a longer pause bins show no step [s].
const PAUSE_SECS: f64 = 10.0;
/// How many packets that came later than the ones before them are looked at, each so much at least [s].
const LATER: usize = 8;
const LATER_SECS: f64 = 0.003;
/// Every how many of them.
const LOOKS: usize = 4;
/// How many of them came later by whole intervals, where the interval was known and where not, and how near to
/// these, as a part.
const STILL: usize = 4;
const WHOLE: usize = 6;
const NEAR_WHOLE: f64 = 0.15;
/// How little delays change from one packet to the next where they beat, as a part of the interval, and what
/// never counts as more [s]; of so many of them, as the rest may be of packets that failed.
const STEADIEST: usize = ARRIVALS * 2 / 5;
const STEADY: f64 = 0.02;
const STEADY_SECS: f64 = 0.0003;
/// Packets that come so regularly, at intervals of no more than this [s], may be those of polls, which beat.
const POLLED: f64 = 0.99;
const POLLED_SECS: f64 = 0.02;

/// The events of a link of which a period has a whole number.
///
/// A packet waits for the next event. When a period of packets is a whole number of intervals the wait
/// changes only by the difference of the two clocks, and steps by an interval when an event is missed, or
/// when a packet failed and was sent again. These steps show the length of the interval. With packets that
/// never fail and come as regularly as polls do, the interval may be their own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beat {
    arrivals: [i64; ARRIVALS],
    count: usize,
    /// From packet to packet [s]; 0 where they are irregular.
    period: f64,
    /// The interval [s], and when delays last stepped by it.
    known: Option<(f64, i64)>,
    device: i64,
    /// By how much the last packets were delayed more than the ones before them [s].
    changes: [f64; ARRIVALS],
    /// The last of these that were much, and how many there were.
    later: [f64; LATER],
    steps: usize,
    /// The interval that there may be [s]; 0 for none.
    suspected: f64,
    /// The lowest point of the last bin.
    lowest: Option<Point>,
}

impl Default for Beat {
    fn default() -> Beat {
        Beat {
            arrivals: [0; ARRIVALS],
            count: 0,
            period: 0.0,
            known: None,
            device: 0,
            changes: [0.0; ARRIVALS],
            later: [0.0; LATER],
            steps: 0,
            suspected: 0.0,
            lowest: None,
        }
    }
}

impl Beat {
    /// A packet arrived; they come each `period` [s].
    pub fn push(&mut self, packet: Packet, period: f64) {
        let Packet { device, arrival } = packet;
        if self.count > 0 {
            let last = self.arrivals[(self.count - 1) % ARRIVALS];
            let passed = device.saturating_sub(self.device);
            self.step(arrival.saturating_sub(last).saturating_sub(passed) as f64 / 1e9);
        }
        self.arrivals[self.count % ARRIVALS] = arrival;
        self.count += 1;
        (self.period, self.device) = (period, device);
        if self.count.is_multiple_of(ARRIVALS) {
            let may_be_polled = (0.0..POLLED_SECS).contains(&period) && period > 0.0;
            let is_regular = may_be_polled && self.direction(period) > POLLED;
            self.suspected = if is_regular { period } else { 0.0 };
        }
        if self.known.is_some_and(|(_, at)| arrival.saturating_sub(at) > BEATS_NANOS) {
            self.known = None;
        }
    }

    /// The lowest point of a bin that is over: whether delays stepped since the one before.
    pub fn bin(&mut self, lowest: Point) {
        let before = self.lowest.replace(lowest);
        if let Some(before) = before.filter(|before| lowest.device - before.device < PAUSE_SECS) {
            let step = (lowest.delay - before.delay).abs();
            if step > LATER_SECS || step > 0.5 * self.suspected {
                self.stepped(step);
            }
        }
    }

    /// Delays have stepped by so much [s].
    fn stepped(&mut self, step: f64) {
        if step <= 0.0 || self.count < ARRIVALS || self.period <= 0.0 || step > LONGEST_SECS {
            return;
        }
        let events = (self.period / step).round();
        if !(1.0..=MOST_EVENTS).contains(&events) {
            return;
        }
        let interval = self.period / events;
        let is_near = (interval / step - 1.0).abs() < NEAR;
        if is_near && self.is_steady(0.0) && self.direction(interval) > ON_LATTICE {
            let now = self.arrivals[(self.count - 1) % ARRIVALS];
            self.known = Some((interval, now));
        }
    }

    /// From one event to the next, as far as there are any [s]; 0 where nothing shows any.
    pub fn interval(&self) -> f64 {
        self.known.map_or(self.suspected, |(interval, _)| interval)
    }

    /// How wrong a time may be where its place between two events is not followed [s].
    pub fn secs(interval: f64) -> f64 {
        STATED * interval
    }

    /// How high bins may be above the line for it [s].
    pub fn height_secs(&self) -> f64 {
        GATE * self.interval()
    }

    /// A packet came so much later than the one before it [s].
    fn step(&mut self, later: f64) {
        self.changes[self.count % ARRIVALS] = later;
        if !(LATER_SECS..4.0 * LONGEST_SECS).contains(&later) {
            return;
        }
        self.later[self.steps % LATER] = later;
        self.steps += 1;
        if self.steps < LATER || !self.steps.is_multiple_of(LOOKS) || self.count < ARRIVALS {
            return;
        }
        let now = self.arrivals[(self.count - 1) % ARRIVALS];
        if let Some((interval, _)) = self.known.filter(|(known, _)| self.whole(*known) >= STILL) {
            self.known = Some((interval, now));
            return;
        }
        let intervals = (1..=MOST_EVENTS as usize).map(|events| self.period / events as f64);
        let may_be = |interval: &f64| {
            (SHORTEST_SECS..LONGEST_SECS).contains(interval)
                && self.whole(*interval) >= WHOLE
                && self.is_steady(*interval)
                && self.direction(*interval) > ON_LATTICE
        };
        if let Some(interval) = intervals.into_iter().find(may_be) {
            self.known = Some((interval, now));
        }
    }

    /// Whether delays hardly change from one packet to the next.
    fn is_steady(&self, interval: f64) -> bool {
        let mut changes = self.changes.map(f64::abs);
        changes.sort_by(f64::total_cmp);
        changes[STEADIEST] < (STEADY * interval).max(STEADY_SECS)
    }

    /// How many of the packets that came later did so by whole intervals.
    fn whole(&self, interval: f64) -> usize {
        let (mut single, mut more) = (0, 0);
        for later in self.later.map(|later| later / interval) {
            let is_whole = (later - later.round()).abs() < NEAR_WHOLE;
            single += usize::from(is_whole && (0.5..1.5).contains(&later));
            more += usize::from(is_whole && later >= 1.5);
        }
        // Most packets that fail do so once; where none did, it is a part of the interval.
        if single >= more { single + more } else { 0 }
    }

    /// The length of the mean direction of arrivals on a circle of this interval [0..1].
    fn direction(&self, interval: f64) -> f64 {
        let (mut x, mut y) = (0.0, 0.0);
        for arrival in self.arrivals {
            let since = arrival.saturating_sub(self.arrivals[0]) as f64 / 1e9;
            let (sin, cos) = (std::f64::consts::TAU * since / interval).sin_cos();
            (x, y) = (x + cos, y + sin);
        }
        f64::hypot(x, y) / ARRIVALS as f64
    }
}

#[cfg(test)]
mod tests;
