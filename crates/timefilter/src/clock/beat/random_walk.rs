//! A clock's offset between moments at which it is known, with a skew that performs a random walk.
//!
//! The state is the offset and the skew; the skew's variance grows linearly with time (a Wiener process, as in the
//! two-state model of oscillators; Zucca & Tavella 2005, doi:10.1109/TUFFC.2005.1406554), and faster while a device
//! warms up. One Kalman filter runs forwards through the moments before a time, and another backwards through those
//! after it. How fast the skew walks is not known, so the results for a few rates are averaged, weighted by the
//! likelihood of the moments under each rate.

use crate::clock::fit::Point;

/// The rates of the walk [1/s], from the quartz of a computer to that of a worn device, each with its prior
/// probability.
const RATES: [(f64, f64); 4] = [(3e-16, 0.2), (3e-15, 0.38), (3e-14, 0.4), (3e-13, 0.02)];
/// The standard deviation of the change of skew that a device's warm-up still causes at the start, and its time
/// constant [s].
const WARM_UP_SKEW: f64 = 20e-6;
const WARM_UP_SECS: f64 = 120.0;
/// The standard deviation of a skew about which nothing is known, as with numbered samples, and that of an unknown
/// offset [s].
const UNKNOWN_SKEW: f64 = 0.03;
const UNKNOWN_SECS: f64 = 1.0;
/// The number of moments that are used on either side.
const NEAREST: usize = 24;

/// The offset and skew of a clock at a time, and the standard error of the offset.
#[derive(Clone, Copy, Debug)]
pub(super) struct Estimate {
    /// The offset: the delay of a packet that is not held up on its way [s].
    pub delay: f64,
    /// The slope of the delay over device time.
    pub slope: f64,
    /// The standard error of the delay [s], and that of the slope.
    pub error: f64,
    pub slope_error: f64,
}

/// Estimates the delay at `device` [s] from `knots`, moments whose delays are known with the standard error `noise`
/// [s].
pub(super) fn estimate(knots: &[Point], noise: f64, device: f64) -> Estimate {
    let after = knots.partition_point(|knot| knot.device <= device);
    let before = &knots[after.saturating_sub(NEAREST)..after];
    let after = &knots[after..knots.len().min(after + NEAREST)];
    let base = before.last().or(after.first()).map_or(0.0, |knot| knot.delay);
    let walks = RATES.map(|(rate, probability)| {
        let mut likelihood = probability.ln();
        let mut past = State::unknown(device);
        for (place, knot) in before.iter().enumerate() {
            past.move_to(knot.device, rate);
            likelihood += past.see(knot.delay - base, noise, place);
        }
        past.move_to(device, rate);
        let mut future = State::unknown(device);
        for (place, knot) in after.iter().rev().enumerate() {
            future.move_to(knot.device, rate);
            likelihood += future.see(knot.delay - base, noise, place);
        }
        future.move_to(device, rate);
        (past.with(&future), likelihood)
    });
    let most = walks.iter().map(|(_, likelihood)| *likelihood).fold(f64::MIN, f64::max);
    let weight = |likelihood: f64| (likelihood - most).exp();
    let sum: f64 = walks.iter().map(|(_, likelihood)| weight(*likelihood)).sum();
    let mean = |of: fn(&State) -> f64| {
        walks.iter().map(|(state, likelihood)| weight(*likelihood) * of(state)).sum::<f64>() / sum
    };
    let (delay, slope) = (mean(|state| state.offset), mean(|state| state.skew));
    let square = mean(|state| state.offset * state.offset + state.variance.0);
    let slope_square = mean(|state| state.skew * state.skew + state.variance.2);
    let error = (square - delay * delay).max(0.0).sqrt();
    let slope_error = (slope_square - slope * slope).max(0.0).sqrt();
    Estimate { delay: base + delay, slope, error, slope_error }
}

/// The state of a Kalman filter at a time.
#[derive(Clone, Copy, Debug)]
struct State {
    device: f64,
    offset: f64,
    skew: f64,
    /// The variance of the offset, the covariance of offset and skew, and the variance of the skew.
    variance: (f64, f64, f64),
}

impl State {
    fn unknown(device: f64) -> State {
        let variance = (UNKNOWN_SECS * UNKNOWN_SECS, 0.0, UNKNOWN_SKEW * UNKNOWN_SKEW);
        State { device, offset: 0.0, skew: 0.0, variance }
    }

    /// Moves to another time [s], where the skew walks at `rate` [1/s].
    fn move_to(&mut self, device: f64, rate: f64) {
        let step = device - self.device;
        let (length, begin) = (step.abs(), self.device.min(device).max(0.0));
        let decay = (-2.0 * begin / WARM_UP_SECS).exp();
        let warm_up =
            WARM_UP_SKEW * WARM_UP_SKEW * decay * (1.0 - (-2.0 * length / WARM_UP_SECS).exp());
        let walked = rate * length + warm_up;
        let (offset, both, skew) = self.variance;
        self.offset += self.skew * step;
        self.variance = (
            offset + 2.0 * both * step + skew * step * step + walked * length * length / 3.0,
            both + skew * step + walked * step / 2.0,
            skew + walked,
        );
        self.device = device;
    }

    /// Updates the state with an offset of standard error `noise` [s]. Returns the logarithm of its likelihood, or 0
    /// for the first two offsets, since any two lie on a line.
    fn see(&mut self, offset: f64, noise: f64, place: usize) -> f64 {
        let (of_offset, both, of_skew) = self.variance;
        let variance = of_offset + noise * noise;
        let surprise = offset - self.offset;
        let (gain, of_slope) = (of_offset / variance, both / variance);
        self.offset += gain * surprise;
        self.skew += of_slope * surprise;
        self.variance = ((1.0 - gain) * of_offset, (1.0 - gain) * both, of_skew - of_slope * both);
        if place < 2 { 0.0 } else { -0.5 * (surprise * surprise / variance + variance.ln()) }
    }

    /// Combines two independent states at the same time.
    fn with(&self, other: &State) -> State {
        let invert = |(a, b, c): (f64, f64, f64)| {
            let determinant = (a * c - b * b).max(f64::MIN_POSITIVE);
            (c / determinant, -b / determinant, a / determinant)
        };
        let (mine, others) = (invert(self.variance), invert(other.variance));
        let sum = (mine.0 + others.0, mine.1 + others.1, mine.2 + others.2);
        let variance = invert(sum);
        let offset = mine.0 * self.offset
            + mine.1 * self.skew
            + others.0 * other.offset
            + others.1 * other.skew;
        let skew = mine.1 * self.offset
            + mine.2 * self.skew
            + others.1 * other.offset
            + others.2 * other.skew;
        State {
            offset: variance.0 * offset + variance.1 * skew,
            skew: variance.1 * offset + variance.2 * skew,
            variance,
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Moments `apart` seconds from each other of a clock that temperature moves by 3 ppm in 40 minutes.
    fn knots(apart: f64, count: usize) -> Vec<Point> {
        (0..count)
            .map(|place| Point { device: place as f64 * apart, delay: truth(place as f64 * apart) })
            .collect()
    }

    fn truth(device: f64) -> f64 {
        let phase = std::f64::consts::TAU / 2400.0;
        30e-6 * device + 3e-6 / phase * (phase * device).sin()
    }

    #[test]
    fn between_moments_a_clock_is_known_within_what_is_stated() {
        let knots = knots(300.0, 8);
        for device in (0..2_100).map(f64::from) {
            let found = estimate(&knots, 1e-5, device);
            let error = (found.delay - truth(device)).abs();
            assert!(
                error <= 2.0 * found.error && error < 2e-4,
                "{device} s: {error}, {}",
                found.error
            );
        }
    }

    #[test]
    fn what_is_not_known_grows_behind_the_last_moment() {
        let knots = knots(300.0, 8);
        let mut before = 0.0;
        for device in (2_100..4_000).step_by(50).map(f64::from) {
            let found = estimate(&knots, 1e-5, device);
            assert!((found.delay - truth(device)).abs() <= 2.0 * found.error, "{device} s");
            assert!(found.error > before, "{device} s");
            before = found.error;
        }
    }

    #[test]
    fn a_steadier_clock_is_known_better() {
        let steady: Vec<Point> = knots(100.0, 20)
            .iter()
            .map(|knot| Point { delay: 30e-6 * knot.device, ..*knot })
            .collect();
        let restless: Vec<Point> = (steady.iter().zip([0.0, 1e-3].into_iter().cycle()))
            .map(|(knot, more)| Point { delay: knot.delay + more, ..*knot })
            .collect();
        let error = |knots: &[Point]| estimate(knots, 1e-5, 2_000.0).error;
        assert!(3.0 * error(&steady) < error(&restless));
    }
}
