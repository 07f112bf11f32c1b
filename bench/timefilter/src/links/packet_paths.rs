//! Packet paths, each of which maps times of sending to times of arrival, in order.

use super::random::Random;

/// The path of packets from a device to the host.
pub trait PacketPath {
    /// Returns when a packet sent at `sent` arrives [s]; `None` if it is lost. Packets come in order of sending.
    fn arrival(&mut self, sent: f64, random: &mut Random) -> Option<f64>;
}

/// Returns the delay added by the host's driver and scheduler [s]: mostly tenths of a millisecond, seldom milliseconds.
fn host(random: &mut Random) -> f64 {
    let seldom = if random.chance(0.01) { random.exponential(0.005) } else { 0.0 };
    random.log_normal(0.0002, 0.5) + seldom
}

/// A Bluetooth Low Energy connection: packets wait for the next connection event, a limited number fits into each
/// event, and those that fail are sent again in the next one.
#[derive(Clone, Debug)]
pub struct Bluetooth {
    /// The connection interval by the host's clock [s].
    pub interval: f64,
    /// The time of the first event [s].
    pub phase: f64,
    /// The probability that a packet fails in an event.
    pub fails: f64,
    /// The number of events that the device may skip while it has nothing to send.
    pub latency: u32,
    /// The number of packets that fit into an event.
    pub fit: u32,
    /// The times when the connection is lost, and for how long [s].
    pub drop_outs: Vec<(f64, f64)>,
    /// Whether data measured without a connection are sent when it is back.
    pub flushes: bool,
    /// The number of the event last used, and how many packets it has carried.
    event: (i64, u32),
    last: f64,
}

/// The connection intervals chosen by hosts are multiples of this [s].
pub const INTERVAL_STEP: f64 = 0.00125;

impl Bluetooth {
    /// Makes a connection with a random interval of 7.5 to 50 ms, in which a share `fails` of the packets fails.
    pub fn new(random: &mut Random, fails: f64) -> Bluetooth {
        let interval = (6 + random.below(35)) as f64 * INTERVAL_STEP;
        Bluetooth::of_interval(interval, random, fails)
    }

    /// Makes a connection with this nominal interval [s]; its clock is up to 20 ppm off.
    pub fn of_interval(interval: f64, random: &mut Random, fails: f64) -> Bluetooth {
        Bluetooth {
            interval: interval * (1.0 + random.between(-20e-6, 20e-6)),
            phase: random.unit() * interval,
            fails,
            latency: 0,
            fit: 6,
            drop_outs: Vec::new(),
            flushes: true,
            event: (i64::MIN, 0),
            last: f64::NEG_INFINITY,
        }
    }

    /// Adds drop-outs of 1 to 6 s, on average one every `every` seconds.
    pub fn dropping_out(mut self, every: f64, until: f64, random: &mut Random) -> Bluetooth {
        let mut at = random.exponential(every);
        while at < until {
            let lasts = random.between(1.0, 6.0);
            self.drop_outs.push((at, lasts));
            at += lasts + random.exponential(every);
        }
        self
    }

    fn out_until(&self, secs: f64) -> Option<f64> {
        let out = self.drop_outs.iter().find(|(at, lasts)| (*at..at + lasts).contains(&secs));
        out.map(|(at, lasts)| at + lasts)
    }
}

impl PacketPath for Bluetooth {
    fn arrival(&mut self, sent: f64, random: &mut Random) -> Option<f64> {
        let mut ready = sent;
        if let Some(end) = self.out_until(ready) {
            if !self.flushes {
                return None;
            }
            ready = end;
        }
        let mut event = ((ready - self.phase) / self.interval).ceil() as i64;
        // A device that skips events wakes when it has data, if its firmware is quick.
        if self.latency > 0 && random.chance(0.2) {
            event += random.below(self.latency as usize + 1) as i64;
        }
        event = event.max(self.event.0);
        loop {
            if event == self.event.0 && self.event.1 >= self.fit {
                event += 1;
                continue;
            }
            let time = self.phase + event as f64 * self.interval;
            if let Some(end) = self.out_until(time) {
                event = ((end - self.phase) / self.interval).ceil() as i64;
                continue;
            }
            if random.chance(self.fails) {
                event += 1;
                continue;
            }
            let before = if event == self.event.0 { self.event.1 } else { 0 };
            self.event = (event, before + 1);
            let arrival = time + f64::from(before) * 0.0004 + host(random);
            self.last = self.last.max(arrival);
            return Some(self.last);
        }
    }
}

/// A link that carries less than is sent for minutes at a time, so that delays grow to seconds.
#[derive(Clone, Debug)]
pub struct Saturated {
    /// The underlying connection.
    pub link: Bluetooth,
    /// The time that a packet takes on the link [s]: normally, and while the link is slow.
    pub takes: (f64, f64),
    /// The spans in which the link is slow: start and end [s].
    pub slow: Vec<(f64, f64)>,
    /// The longest queue [s]; packets beyond it are lost.
    pub most: f64,
    free: f64,
}

impl Saturated {
    /// Makes a link that half of the time is too slow for a packet every `period` [s].
    pub fn new(period: f64, until: f64, random: &mut Random) -> Saturated {
        let mut slow = Vec::new();
        let mut at = random.between(60.0, 240.0);
        while at < until {
            let lasts = random.between(60.0, 240.0);
            slow.push((at, at + lasts));
            at += lasts + random.between(60.0, 240.0);
        }
        let takes = (period * 0.7, period * random.between(1.02, 1.15));
        let link = Bluetooth::new(random, 0.05);
        Saturated { link, takes, slow, most: random.between(2.0, 6.0), free: 0.0 }
    }
}

impl PacketPath for Saturated {
    fn arrival(&mut self, sent: f64, random: &mut Random) -> Option<f64> {
        if self.free - sent > self.most {
            return None;
        }
        let is_slow = self.slow.iter().any(|(from, until)| (*from..*until).contains(&sent));
        let takes = if is_slow { self.takes.1 } else { self.takes.0 };
        self.free = self.free.max(sent) + takes * random.between(0.8, 1.2);
        self.link.arrival(self.free, random)
    }
}

/// A network: a delay for each packet, a heavy tail, stalls, and other routes for a while.
#[derive(Clone, Debug)]
pub struct Network {
    /// The delay of every packet [s].
    pub base: f64,
    /// The smallest additional delay, which has a Pareto tail [s].
    pub tail: f64,
    /// The exponent of the tail.
    pub alpha: f64,
    /// The spans in which nothing passes: start and end [s].
    pub stalls: Vec<(f64, f64)>,
    /// The spans in which packets take another route: start, end, and how much longer it takes [s].
    pub routes: Vec<(f64, f64, f64)>,
    last: f64,
}

impl Network {
    /// Makes a Wi-Fi network: 3 ms, with a tail that is usually 1 ms.
    pub fn wifi() -> Network {
        let (stalls, routes) = (Vec::new(), Vec::new());
        Network { base: 0.003, tail: 0.001, alpha: 1.5, stalls, routes, last: f64::NEG_INFINITY }
    }

    /// Adds stalls of up to `longest` [s], on average one every `every` [s].
    pub fn stalling(
        mut self,
        every: f64,
        (shortest, longest): (f64, f64),
        until: f64,
        random: &mut Random,
    ) -> Network {
        let mut at = random.exponential(every);
        while at < until {
            let lasts = random.between(shortest, longest);
            self.stalls.push((at, at + lasts));
            at += lasts + random.exponential(every);
        }
        self
    }
}

impl PacketPath for Network {
    fn arrival(&mut self, sent: f64, random: &mut Random) -> Option<f64> {
        let longer = self.routes.iter().filter(|(from, until, _)| (*from..*until).contains(&sent));
        let longer: f64 = longer.map(|(_, _, longer)| longer).sum();
        let tail = random.pareto(self.tail, self.alpha).min(2.0);
        let mut arrival = sent + self.base + longer + tail + random.log_normal(0.0002, 0.5);
        for (from, until) in &self.stalls {
            if (*from..*until).contains(&arrival) {
                arrival = *until + random.between(0.0, 0.002);
            }
        }
        self.last = (self.last + 20e-6).max(arrival);
        Some(self.last)
    }
}

/// A camera on USB: a frame is read out, and the driver adds a small delay.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    last: f64,
}

impl Camera {
    pub fn new() -> Camera {
        Camera { last: f64::NEG_INFINITY }
    }
}

impl PacketPath for Camera {
    fn arrival(&mut self, sent: f64, random: &mut Random) -> Option<f64> {
        let busy = if random.chance(0.003) { random.exponential(0.030) } else { 0.0 };
        let arrival = sent + 0.033 + random.normal().abs() * 0.002 + busy;
        self.last = (self.last + 1e-5).max(arrival);
        Some(self.last)
    }
}

/// A USB port that is polled: data wait for the next poll.
#[derive(Clone, Copy, Debug)]
pub struct Polled {
    /// The time between polls, by the host's clock [s].
    pub interval: f64,
    /// The time of the first poll [s].
    pub phase: f64,
    last: i64,
}

impl Polled {
    /// Makes a port that is polled at a nominal interval [s]; the bus's clock is up to 30 ppm off.
    pub fn new(interval: f64, random: &mut Random) -> Polled {
        let interval = interval * (1.0 + random.between(-30e-6, 30e-6));
        Polled { interval, phase: random.unit() * interval, last: i64::MIN }
    }
}

impl PacketPath for Polled {
    fn arrival(&mut self, sent: f64, random: &mut Random) -> Option<f64> {
        let poll = ((sent - self.phase) / self.interval).ceil() as i64;
        self.last = poll.max(self.last);
        Some(self.phase + self.last as f64 * self.interval + random.log_normal(0.00005, 0.5))
    }
}
