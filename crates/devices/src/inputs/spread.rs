/// The smallest number of times for which a mean is given: the mean of fewer would be close to the time of a single
/// press.
pub const LEAST_GROUP: u32 = 5;

/// The number, mean and standard deviation of times.
#[derive(Clone, Debug, Default)]
pub(super) struct Spread {
    count: u32,
    sum_ms: f64,
    sum_of_squares: f64,
}

impl Spread {
    pub(super) fn add(&mut self, ns: i64) {
        let ms = ns as f64 / 1e6;
        self.count += 1;
        self.sum_ms += ms;
        self.sum_of_squares += ms * ms;
    }

    /// Returns the number, mean and population SD of the times, and starts again. If there are too few, returns a count
    /// of 0 and NaN, and keeps them for the next second.
    pub(super) fn take(&mut self) -> [f64; 3] {
        if self.count < LEAST_GROUP {
            return [0.0, f64::NAN, f64::NAN];
        }
        let Spread { count, sum_ms, sum_of_squares } = std::mem::take(self);
        let mean_ms = sum_ms / f64::from(count);
        let variance = sum_of_squares / f64::from(count) - mean_ms * mean_ms;
        [f64::from(count), mean_ms, variance.max(0.0).sqrt()]
    }
}
