//! The rate of samples as it is, whatever was declared.

/// How many packets are looked at.
const POINTS: usize = 32;
/// How many must be there.
const ENOUGH: usize = 8;
/// They are no nearer to each other than this [ns]: eight seconds of them are kept.
const APART_NANOS: i64 = 250_000_000;
/// For how long they must have come [ns].
const LONG_NANOS: i64 = 4_000_000_000;
/// A rate is wrong that is further off than this, as a logarithm.
const WRONG: f64 = 0.1;
/// No rate is taken that is further off than this, as a logarithm.
const ABSURD: f64 = 2.5;
/// How near to each other the halves of what is seen must be, as a part.
const AGREE: f64 = 0.05;

/// Packets of numbered samples and when they came.
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
    /// Takes the number of a packet's last sample, and its arrival. Gives the period of samples [ns]
    /// where that is surely not `declared`.
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
