//! Linear fits: an offset or a delay as a linear function of time.

/// The typical rate difference between the clocks of computers [ns/s].
const USUAL_SKEW: f64 = 1e5;
/// The minimum noise of points [ns].
const FINEST: f64 = 50_000.0;
/// The number of reweighting rounds; weights converge sooner.
const ROUNDS: usize = 12;

/// A duration that changes linearly with time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct LinearFit {
    /// The reference time [ns].
    pub(super) origin: i64,
    /// The value at the reference time [ns].
    pub(super) nanos: i64,
    /// The slope [1].
    pub(super) slope: f64,
}

/// A point to fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) at: i64,
    pub(super) nanos: i64,
    /// The weight [0..1].
    pub(super) weight: f64,
}

impl LinearFit {
    /// The value at a time [ns].
    pub(super) fn at(self, time: i64) -> i64 {
        let since = time.saturating_sub(self.origin) as f64;
        self.nanos.saturating_add((self.slope * since) as i64)
    }

    /// The negated fit.
    pub(super) fn reversed(self) -> LinearFit {
        LinearFit { nanos: self.nanos.saturating_neg(), slope: -self.slope, ..self }
    }

    /// Fits an expectile line: residuals below weigh `1 − expectile`, those above weigh `expectile`.
    /// Returns the line and its spread [ns]. An expectile of 0.5 is least squares; a small one is a lower
    /// bound robust against some noise. The skew is regularised towards the usual range where the points
    /// leave it open. `None` without points.
    pub(super) fn fit(
        points: impl Iterator<Item = Point> + Clone,
        expectile: f64,
    ) -> Option<(LinearFit, f64)> {
        let newest = points.clone().max_by_key(|point| point.at)?;
        let relative = points.map(|point| {
            let before_secs = point.at.saturating_sub(newest.at) as f64 * 1e-9;
            (before_secs, point.nanos.saturating_sub(newest.nanos) as f64, point.weight)
        });
        let (mut level, mut slope, mut spread) = (0.0, 0.0, FINEST);
        for round in 0..ROUNDS {
            let mut sums = Sums::default();
            for (x, y, weight) in relative.clone() {
                let residual = y - level - slope * x;
                let side = if residual > 0.0 { expectile } else { 1.0 - expectile };
                sums.add(x, y, if round == 0 { weight } else { weight * side });
            }
            (level, slope) = sums.solve((spread / USUAL_SKEW).powi(2));
            let mut squares = Sums::default();
            for (x, y, weight) in relative.clone() {
                let residual = y - level - slope * x;
                let side = if residual > 0.0 { expectile } else { 1.0 - expectile };
                squares.add(0.0, residual.powi(2), weight * side);
            }
            spread = (squares.wy / squares.w).sqrt().max(FINEST);
        }
        let nanos = newest.nanos.saturating_add(level as i64);
        Some((LinearFit { origin: newest.at, nanos, slope: slope * 1e-9 }, spread))
    }
}

/// The sums of a weighted regression.
#[derive(Default)]
struct Sums {
    w: f64,
    wx: f64,
    wy: f64,
    wxx: f64,
    wxy: f64,
}

impl Sums {
    fn add(&mut self, x: f64, y: f64, w: f64) {
        self.w += w;
        self.wx += w * x;
        self.wy += w * y;
        self.wxx += w * x * x;
        self.wxy += w * x * y;
    }

    /// Solves for level and slope, with the ridge penalty `ridge` on the squared slope.
    fn solve(&self, ridge: f64) -> (f64, f64) {
        let across = self.wxx - self.wx * self.wx / self.w + ridge;
        let slope = (self.wxy - self.wx * self.wy / self.w) / across;
        ((self.wy - slope * self.wx) / self.w, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(noise: impl Fn(i64) -> i64) -> Vec<Point> {
        (0..60)
            .map(|k| {
                let at = k * 2_000_000_000;
                Point { at, nanos: 1_500_000_000 + at / 25_000 + noise(k), weight: 1.0 }
            })
            .collect()
    }

    #[test]
    fn a_line_is_found_again() {
        let (line, _) = LinearFit::fit(points(|_| 0).into_iter(), 0.5).unwrap();
        let (truth, at) = (1_500_000_000 + 4_720_000, 118_000_000_000);
        assert!((line.at(at) - truth).abs() < 100_000, "{line:?}");
        assert!((line.slope * 1e6 - 40.0).abs() < 1.0, "{line:?}");
    }

    #[test]
    fn late_points_do_not_lift_the_lower_line() {
        let late = points(|k| (k * 7919 % 13) * 3_000_000);
        let (line, _) = LinearFit::fit(late.into_iter(), 0.05).unwrap();
        let truth = 1_500_000_000 + 4_720_000;
        let lifted = line.at(118_000_000_000) - truth;
        assert!((-2_000_000..8_000_000).contains(&lifted), "{lifted}");
    }

    #[test]
    fn no_points_have_no_line() {
        assert!(LinearFit::fit([].into_iter(), 0.5).is_none());
    }
}
