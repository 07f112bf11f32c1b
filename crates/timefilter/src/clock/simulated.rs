//! A simulated device with a known clock, for tests.

use super::Stamps;

pub const SECOND: i64 = 1_000_000_000;

/// A device that sends batches of samples over a link with a minimum delay and a random additional one.
#[derive(Clone, Debug)]
pub struct Device {
    /// The session's time [ns].
    pub now: i64,
    /// The device's clock now [ns].
    pub clock: i64,
    /// The rate of the device's clock.
    pub rate: f64,
    /// The time after which the clock wraps [ns].
    pub wraps: i64,
    /// The number of samples in a batch.
    pub batch: u32,
    /// The index of the next sample.
    pub index: u64,
    /// The sampling period [ns].
    pub period: i64,
    /// The minimum delay of a packet [s].
    pub least_delay: f64,
    /// The mean additional delay of a packet [s].
    pub tail: f64,
    last_arrival: i64,
    seed: u64,
}

impl Device {
    pub fn new(rate_hz: f64) -> Device {
        Device {
            now: 1_700_000_000 * SECOND,
            clock: 5 * SECOND,
            rate: 1.0,
            wraps: i64::MAX,
            batch: 1,
            index: 0,
            period: (1e9 / rate_hz) as i64,
            least_delay: 0.02,
            tail: 0.02,
            last_arrival: 0,
            seed: 1,
        }
    }

    /// The next packet: the true time of its first sample [ns], and its stamps.
    pub fn send(&mut self) -> (i64, Stamps) {
        let (first, device) = (self.now, self.clock);
        let length = i64::from(self.batch) * self.period;
        self.now += length;
        self.clock += (length as f64 * self.rate).round() as i64;
        let last = self.now - self.period;
        let delay = self.least_delay - self.tail * (1.0 - self.uniform()).ln();
        self.last_arrival = self.last_arrival.max(last + (delay * 1e9) as i64);
        let stamps = Stamps {
            device: Some(device % self.wraps),
            index: self.index,
            count: self.batch,
            period_nanos: self.period as f64 * f64::from(u8::from(self.batch > 1)),
            ..Stamps::arrived(self.last_arrival)
        };
        self.index += u64::from(self.batch);
        (first, stamps)
    }

    /// A uniform random number in [0, 1) (splitmix64).
    pub fn uniform(&mut self) -> f64 {
        self.seed = self.seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.seed;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}
