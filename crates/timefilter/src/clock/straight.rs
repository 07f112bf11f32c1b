//! The straight line that points define by themselves, without a prior.

use super::fit::{LEAST_SPREAD, Point};

/// The largest correlation assumed between neighbours.
const CORRELATED: f64 = 0.95;

/// A slope and its standard error.
#[derive(Clone, Copy, Debug)]
pub(super) struct Straight {
    pub slope: f64,
    /// The standard error, widened where there are few points.
    pub error: f64,
}

impl Straight {
    /// The least-squares fit to points that scatter by at least `scatter` [s]; the error allows for the correlation of
    /// neighbouring residuals.
    pub fn through(points: impl Iterator<Item = Point> + Clone, scatter: f64) -> Straight {
        let (mut count, mut device, mut delay) = (0.0, 0.0, 0.0);
        for point in points.clone() {
            (count, device, delay) = (count + 1.0, device + point.device, delay + point.delay);
        }
        let centred = |point: Point| (point.device - device / count, point.delay - delay / count);
        let (mut squares, mut product) = (0.0, 0.0);
        for (x, y) in points.clone().map(centred) {
            (squares, product) = (squares + x * x, product + x * y);
        }
        let squares = f64::max(squares, f64::MIN_POSITIVE);
        let slope = product / squares;
        let (mut rest, mut next, mut before) = (0.0, 0.0, 0.0);
        for (x, y) in points.map(centred) {
            let residual = y - slope * x;
            (rest, next, before) = (rest + residual * residual, next + residual * before, residual);
        }
        let correlation = if rest > 0.0 { (next / rest).clamp(0.0, CORRELATED) } else { 0.0 };
        let repeats = (1.0 + correlation) / (1.0 - correlation);
        let few = 1.0 + 4.0 / count;
        let residual = f64::sqrt(rest / f64::max(count - 2.0, 1.0) * repeats);
        let error = few * residual.max(scatter).max(10.0 * LEAST_SPREAD) / squares.sqrt();
        Straight { slope, error }
    }
}
