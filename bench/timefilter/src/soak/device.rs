//! Devices and computers as in a session: their rates, batches, clocks and interruptions.

use teampulse_timefilter::align::{Aggregate, Policy};
use teampulse_timefilter::clock::Stamps;

const MILLI: i64 = 1_000_000;
const SECOND: i64 = 1_000 * MILLI;
/// The interval at which a device is away, and for how long [ns]; its clock restarts after that.
const BEGINS_ANEW: i64 = 40 * 60 * SECOND;
const AWAY: i64 = 60 * SECOND;

/// How a kind of source stamps its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    OneWay,
    SampleIndex,
    Remote,
}

/// A kind of source.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    pub rate_hz: f64,
    /// The number of samples that arrive together.
    pub batch: u32,
    pub clock: Clock,
    pub policy: Policy,
    /// The shortest and the mean additional delay of a message [ns].
    delay: (i64, i64),
}

const LINEAR: Policy = Policy::Linear { max_gap_nanos: SECOND };
const HOLD: Policy = Policy::Hold { max_age_nanos: 10 * SECOND };
const MEAN: Policy = Policy::Window { length_nanos: SECOND, aggregate: Aggregate::Mean };
const BLUETOOTH: (i64, i64) = (50 * MILLI, 30 * MILLI);
const WIFI: (i64, i64) = (2 * MILLI, 3 * MILLI);

const fn kind(rate_hz: f64, batch: u32, clock: Clock, policy: Policy) -> Kind {
    let delay = if matches!(clock, Clock::Remote) { WIFI } else { BLUETOOTH };
    Kind { rate_hz, batch, clock, policy, delay }
}

/// The kinds of sources; eight of each make 64 sources.
pub const KINDS: [Kind; 8] = [
    kind(130.0, 73, Clock::OneWay, LINEAR),
    kind(100.0, 20, Clock::SampleIndex, MEAN),
    kind(64.0, 6, Clock::OneWay, MEAN),
    kind(50.0, 25, Clock::SampleIndex, LINEAR),
    kind(30.0, 1, Clock::Remote, LINEAR),
    kind(10.0, 1, Clock::Remote, HOLD),
    kind(1.0, 1, Clock::OneWay, HOLD),
    kind(0.2, 1, Clock::Remote, HOLD),
];

/// One source, and the message that it sends next.
#[derive(Clone, Debug)]
pub struct Device {
    number: usize,
    /// When the first sample of the message was measured [ns].
    measured: f64,
    /// When the message arrives [ns].
    arrival: i64,
    index: u64,
    /// When the device's clock started [ns].
    begun: i64,
    /// The relative rate error of the device's clock and samples.
    drift: f64,
    random: u64,
}

impl Device {
    pub fn new(number: usize, start: i64) -> Device {
        let mut device = Device {
            number,
            measured: start as f64,
            arrival: start,
            index: 0,
            begun: start - 5 * SECOND * number as i64,
            drift: (number as f64 - 32.0) * 2e-6,
            random: number as u64,
        };
        device.send();
        device
    }

    pub fn kind(&self) -> Kind {
        KINDS[self.number % KINDS.len()]
    }

    /// Returns when the next message arrives [ns].
    pub fn arrival(&self) -> i64 {
        self.arrival
    }

    /// Returns the stamps of the next message.
    pub fn stamps(&self) -> Stamps {
        let kind = self.kind();
        let measured = self.measured as i64;
        let since_begun = (measured - self.begun) as f64 * (1.0 + self.drift);
        Stamps {
            device: (kind.clock == Clock::OneWay).then_some(since_begun as i64),
            source: (kind.clock == Clock::Remote).then_some(measured + 30 * MILLI),
            index: self.index,
            count: kind.batch,
            period_nanos: if kind.batch > 1 { 1e9 / kind.rate_hz } else { 0.0 },
            ..Stamps::arrived(self.arrival)
        }
    }

    /// Prepares the following message; sometimes the device is away before it.
    pub fn go_on(&mut self) {
        let kind = self.kind();
        let length = f64::from(kind.batch) * 1e9 / kind.rate_hz / (1.0 + self.drift);
        let turn = |time: f64| (time as i64 + self.number as i64 * 37 * SECOND) / BEGINS_ANEW;
        let begins_anew = turn(self.measured) != turn(self.measured + length);
        self.measured += length;
        self.index += u64::from(kind.batch);
        if begins_anew {
            self.measured += AWAY as f64;
            self.begun = self.measured as i64;
        }
        self.send();
    }

    fn send(&mut self) {
        let kind = self.kind();
        let last = self.measured + f64::from(kind.batch - 1) * 1e9 / kind.rate_hz;
        let (shortest, further) = kind.delay;
        let delay = shortest + (further as f64 * -self.uniform().ln()) as i64;
        self.arrival = self.arrival.max(last as i64 + delay);
    }

    /// Returns a number above 0 and up to 1 (splitmix64).
    fn uniform(&mut self) -> f64 {
        self.random = self.random.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.random;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (((z ^ (z >> 31)) >> 11) + 1) as f64 / (1_u64 << 53) as f64
    }
}
