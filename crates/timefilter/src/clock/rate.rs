//! The true sampling rate, estimated independently of the declared one.

/// The number of packets in the window.
const POINTS: usize = 32;
/// The minimum number of packets for an estimate.
const ENOUGH: usize = 8;
/// The minimum distance between packets in the window [ns], so that it covers eight seconds.
const APART_NANOS: i64 = 250_000_000;
/// The minimum duration that packets must cover [ns].
const LONG_NANOS: i64 = 4_000_000_000;
/// The minimum deviation of a wrong rate [natural logarithm of the ratio].
const WRONG: f64 = 0.1;
/// The largest deviation that is accepted [natural logarithm of the ratio].
const ABSURD: f64 = 2.5;
/// How close the estimates of both halves of the window must be [fraction].
const AGREE: f64 = 0.05;

/// The sample indices of packets and their arrivals.
#[derive(Clone, Debug)]
pub(super) struct Rate {
    points: [(u64, i64); POINTS],
    count: usize,
}

impl Default for Rate {
    fn default() -> Rate {
        Rate { points: [(0, 0); POINTS], count: 0 }
    }
}

impl Rate {
    /// Takes the index of a packet's last sample, and its arrival. Returns the sampling period [ns] if it
    /// certainly differs from `declared`.
    pub fn push(&mut self, number: u64, arrival: i64, declared: f64) -> Option<f64> {
        let newest = self.points[POINTS - 1];
        let goes_on =
            self.count == 0 || number > newest.0 && arrival.saturating_sub(newest.1) >= APART_NANOS;
        if !goes_on {
            return None;
        }
        self.points.rotate_left(1);
        self.points[POINTS - 1] = (number, arrival);
        self.count = (self.count + 1).min(POINTS);
        let points = &self.points[POINTS - self.count..];
        let lasted = arrival.saturating_sub(points[0].1);
        if self.count < ENOUGH || lasted < LONG_NANOS {
            return None;
        }
        let half = self.count / 2;
        let mut periods = [0.0; POINTS / 2];
        for (place, period) in periods.iter_mut().take(half).enumerate() {
            let (from, to) = (points[place], points[place + self.count - half]);
            *period = to.1.saturating_sub(from.1) as f64 / (to.0 - from.0) as f64;
        }
        let periods = &mut periods[..half];
        periods.sort_by(f64::total_cmp);
        let (low, middle, high) =
            (periods[half / 4], periods[half / 2], periods[half - 1 - half / 4]);
        let off = (middle / declared).ln().abs();
        let agree = high - low <= AGREE * middle;
        (agree && off > WRONG && off < ABSURD).then_some(middle)
    }
}
