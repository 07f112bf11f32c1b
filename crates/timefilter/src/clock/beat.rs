//! Packets that beat with the connection events of a link, so that delays follow a sawtooth.

mod random_walk;
mod teeth;

pub(super) use self::teeth::Teeth;
use super::comb::Comb;
use super::epoch::Packet;
use super::fit::Point;

/// The number of arrivals in a window.
const ARRIVALS: usize = 64;
/// The minimum mean resultant length at which arrivals count as lying on a lattice.
const ON_LATTICE: f64 = 0.8;
/// How close to an integer fraction of the period a step of delays must be, relative to the step.
const NEAR: f64 = 0.2;
/// Slightly less than the shortest interval of a Bluetooth link [s].
const SHORTEST_SECS: f64 = 0.0074;
/// The longest interval of a link [s].
const LONGEST_SECS: f64 = 0.11;
/// The most events in a period.
const MOST_EVENTS: f64 = 40.0;
/// How long after the last step delays count as beating [ns].
const BEATS_NANOS: i64 = 3_600_000_000_000;
/// The height of the gate for a sawtooth, as a multiple of its height: a delay may be half of that above
/// the middle of its band, and step.
const GATE: f64 = 2.2;
/// The longest pause across which bins can show a step [s].
const PAUSE_SECS: f64 = 10.0;
/// The number of recent packets with a sudden extra delay that are remembered, and the smallest such delay [s].
const LATER: usize = 8;
const LATER_SECS: f64 = 0.003;
/// The number of packets with a sudden extra delay between two searches for an interval.
const LOOKS: usize = 4;
/// How many of the remembered packets must be late by whole intervals, with a known interval and without; and how close
/// to a whole number they must be [fraction of the interval].
const STILL: usize = 4;
const WHOLE: usize = 6;
const NEAR_WHOLE: f64 = 0.15;
/// The largest change of delay between packets that beat, as a fraction of the interval, and the change that is always
/// allowed [s]. Only the steadiest packets must meet it, as the others may have been retransmitted.
const STEADIEST: usize = ARRIVALS * 2 / 5;
const STEADY: f64 = 0.02;
const STEADY_SECS: f64 = 0.0003;
/// The number of windows between two searches for a comb, and the minimum number of events in a window that shows one.
const COMB_EVERY: usize = 16;
const EVENTS: usize = 12;
/// The regularity above which packets may come from polling, which beats, and the longest period of such packets [s].
const POLLED: f64 = 0.99;
const POLLED_SECS: f64 = 0.02;
/// The number of packets among which some are retransmitted if a link has events.
const UNSEEN: usize = 1500;

/// A link whose connection interval divides the packet period.
///
/// A packet waits for the next event. If the packet period is a whole number of intervals, the wait changes
/// only by the difference of the two clocks, and steps by an interval when an event is missed or a packet
/// is retransmitted. These steps show the length of the interval. If packets are never retransmitted and
/// are as regular as polls, the interval may be the packet period itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beat {
    arrivals: [i64; ARRIVALS],
    count: usize,
    /// The packet period [s]; 0 if irregular.
    period: f64,
    /// The interval [s], and when delays last stepped by it.
    known: Option<(f64, i64)>,
    device: i64,
    /// The change of delay from packet to packet over the last packets [s].
    changes: [f64; ARRIVALS],
    /// The last large increases of the delay, and their number.
    later: [f64; LATER],
    steps: usize,
    /// The suspected interval [s]; 0 for none.
    suspected: f64,
    /// The lowest point of the last bin.
    lowest: Option<Point>,
    /// The comb found last; kept while later windows show none.
    comb: Comb,
    /// Whether delays hardly changed in the last window.
    steady: bool,
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
            comb: Comb::NONE,
            steady: false,
        }
    }
}

impl Beat {
    /// Takes a packet; packets are sent every `period` [s].
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
            self.steady = self.is_steady(0.0);
            let windows = self.count / ARRIVALS;
            if windows.is_power_of_two() || windows.is_multiple_of(COMB_EVERY) {
                let is_lattice = |interval| self.direction_of_events(interval) > ON_LATTICE;
                self.comb = Comb::of(period, is_lattice).unwrap_or(self.comb);
            }
        }
        if self.known.is_some_and(|(_, at)| arrival.saturating_sub(at) > BEATS_NANOS) {
            self.known = None;
        }
    }

    /// Takes the lowest point of a closed bin, and checks whether delays have stepped since the previous
    /// one.
    pub fn bin(&mut self, lowest: Point) {
        let before = self.lowest.replace(lowest);
        if let Some(before) = before.filter(|before| lowest.device - before.device < PAUSE_SECS) {
            let step = (lowest.delay - before.delay).abs();
            if step > LATER_SECS || step > 0.5 * self.suspected {
                self.stepped(step);
            }
        }
    }

    /// Handles a step of the delays by `step` [s].
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

    /// The comb on which the waits of packets lie.
    pub fn comb(&self) -> Comb {
        self.comb
    }

    /// How long packets may have waited without showing it [s]: if delays hardly change, each packet may have waited for
    /// the same part of an interval, which is known only once some were retransmitted.
    pub fn unseen_secs(&self) -> f64 {
        let may_beat = self.steady && self.count < UNSEEN;
        if may_beat { self.period.min(LONGEST_SECS) } else { 0.0 }
    }

    /// The interval between events [s]; 0 if none is known.
    pub fn interval(&self) -> f64 {
        self.known.map_or(self.suspected, |(interval, _)| interval)
    }

    /// How high bins may be above the line because of the sawtooth [s].
    pub fn height_secs(&self) -> f64 {
        GATE * self.interval()
    }

    /// Handles a packet that was delayed by `later` more than the one before it [s].
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

    /// The number of delayed packets that were late by whole intervals.
    fn whole(&self, interval: f64) -> usize {
        let (mut single, mut more) = (0, 0);
        for later in self.later.map(|later| later / interval) {
            let is_whole = (later - later.round()).abs() < NEAR_WHOLE;
            single += usize::from(is_whole && (0.5..1.5).contains(&later));
            more += usize::from(is_whole && later >= 1.5);
        }
        // Most packets are retransmitted only once; if few are late by a single interval, `interval` is only a fraction
        // of the true one.
        if single >= more { single + more } else { 0 }
    }

    /// The mean resultant length of arrivals modulo this interval [0..1].
    fn direction(&self, interval: f64) -> f64 {
        resultant(self.arrivals.into_iter(), interval)
    }

    /// The mean resultant length modulo this interval of the first packet of each event [0..1]; 0 with too few events.
    /// Packets that were held up and delivered at once would lie on the lattice of any interval.
    fn direction_of_events(&self, interval: f64) -> f64 {
        let is_first =
            |place: &usize| *place == 0 || self.secs_after_previous(*place) > SHORTEST_SECS / 2.0;
        let firsts = (0..ARRIVALS).filter(is_first).map(|place| self.arrivals[place]);
        if firsts.clone().count() < EVENTS { 0.0 } else { resultant(firsts, interval) }
    }

    fn secs_after_previous(&self, place: usize) -> f64 {
        self.arrivals[place].saturating_sub(self.arrivals[place - 1]) as f64 / 1e9
    }
}

/// The mean resultant length of times [ns] modulo an interval [s] [0..1].
fn resultant(times: impl Iterator<Item = i64> + Clone, interval: f64) -> f64 {
    let Some(begin) = times.clone().next() else { return 0.0 };
    let (mut x, mut y, mut count) = (0.0, 0.0, 0.0);
    for time in times {
        let since = time.saturating_sub(begin) as f64 / 1e9;
        let (sin, cos) = (std::f64::consts::TAU * since / interval).sin_cos();
        (x, y, count) = (x + cos, y + sin, count + 1.0);
    }
    f64::hypot(x, y) / count
}

#[cfg(test)]
mod tests;
