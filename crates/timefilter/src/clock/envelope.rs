//! The lower envelope of delays: what arrival less device time is when nothing held a packet up.
//!
//! Bluetooth, Wi-Fi and USB only ever add to the shortest delay. So the smallest `arrival - device`
//! of each second is kept, for a quarter of an hour, and a line is laid low through these by
//! asymmetric least squares (an expectile; Newey & Powell 1987, doi:10.2307/1911031), iteratively
//! reweighted; what lies far above counts by its sign alone (Huber). Its slope is the clock's skew,
//! which quartz keeps within about 100 ppm.
//!
//! The weight, the window and the bins were chosen on seeds 1 to 10 of `bench/timefilter`; on seeds
//! 11 to 20 the residuals of two packets a second had a 95th percentile of up to 5.7 ms.

use std::collections::VecDeque;

/// How long a bin is [ns].
pub(super) const BIN_NANOS: i64 = 1_000_000_000;
/// How long bins are kept [s]: in that time a quartz's skew changes by a few ppm with a wrist's
/// temperature, which is a few tenths of a millisecond of error.
pub(super) const WINDOW_SECS: f64 = 900.0;
/// How long they count for a clock that is none of quartz [s].
const POOR_WINDOW_SECS: f64 = 300.0;
const BINS: usize = 900;
/// Weight of what lies above the line; below it, the rest of one.
const ABOVE: f64 = 0.35;
/// How many times the mean distance a point may be above the line before its weight falls.
const FAR: f64 = 1.0;
/// The least spread of delays: a computer's own clock readings [s].
const LEAST_SPREAD: f64 = 1e-6;
/// How many standard errors the 95 % interval is to either side. Errors of a line last for minutes,
/// so that whole sessions must be covered rather than moments.
const ERRORS: f64 = 4.0;
const ITERATIONS: usize = 12;
/// The spread of skews among clocks with a quartz (standard deviation, as a slope).
pub(super) const USUAL_SKEW: f64 = 50e-6;
/// The spread of skews among clocks that have shown to be poor.
const POOR_SKEW: f64 = 0.03;

/// One packet: device time since the epoch began [s], and the arrival less it [s].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub device: f64,
    pub delay: f64,
}

/// A line under the points, with what is known of how good it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    /// Where the line's delay is given [s of device time].
    pub device: f64,
    /// The delay there [s].
    pub delay: f64,
    /// How the delay grows with device time.
    pub slope: f64,
    /// Standard error of the slope.
    pub slope_error: f64,
    /// Mean device time of the points, by their weights [s].
    centre: f64,
    /// Standard error of the delay at the centre [s].
    centre_error: f64,
}

impl Fit {
    /// A level line through the first point.
    pub fn level(point: Point) -> Fit {
        Fit {
            device: point.device,
            delay: point.delay,
            slope: 0.0,
            slope_error: USUAL_SKEW,
            centre: point.device,
            centre_error: 0.0,
        }
    }

    /// The line's delay at a device time [s].
    pub fn at(&self, device: f64) -> f64 {
        self.delay + self.slope * (device - self.device)
    }

    /// The device time at which what was sent without delay arrives at `arrival` [s].
    pub fn device_at(&self, arrival: f64) -> f64 {
        (arrival - self.delay + self.slope * self.device) / (1.0 + self.slope)
    }

    /// How much faster than the session's clock the device's runs [ppm].
    pub fn ppm(&self) -> f64 {
        -self.slope / (1.0 + self.slope) * 1e6
    }

    /// Half the width of the 95 % interval of the delay at a device time [s].
    pub fn uncertainty_at(&self, device: f64) -> f64 {
        ERRORS * self.centre_error.hypot(self.slope_error * (device - self.centre))
    }
}

/// The smallest delays of the last bins.
#[derive(Clone, Debug)]
pub(super) struct Envelope {
    bins: VecDeque<Point>,
    /// How far slopes spread among clocks of this kind.
    usual_skew: f64,
    poor: bool,
}

impl Envelope {
    /// What it allocates [B].
    pub const BYTES: usize = (BINS + 1) * size_of::<Point>();

    pub fn new(usual_skew: f64) -> Envelope {
        Envelope { bins: VecDeque::with_capacity(BINS + 1), usual_skew, poor: false }
    }

    /// Takes the lowest point of a bin that is over.
    pub fn push(&mut self, lowest: Point) {
        if self.bins.len() == BINS {
            self.bins.pop_front();
        }
        self.bins.push_back(lowest);
        let oldest = lowest.device - WINDOW_SECS;
        while self.bins.front().is_some_and(|bin| bin.device < oldest) {
            self.bins.pop_front();
        }
    }

    /// How many bins there are.
    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Whether the clock runs as no usual one does.
    pub fn is_poor(&self) -> bool {
        self.poor
    }

    /// Lays a line under the bins and the lowest point of the open one, beginning with `guess`.
    ///
    /// A slope that cannot be that of a usual clock widens what is held possible.
    pub fn fit(&mut self, open: Option<Point>, guess: Fit) -> Fit {
        let newest = self.bins.back().map_or(0.0, |bin| bin.device);
        let oldest = if self.poor { newest - POOR_WINDOW_SECS } else { f64::NEG_INFINITY };
        let skipped = self.bins.partition_point(|bin| bin.device < oldest);
        let points = || self.bins.iter().skip(skipped).copied().chain(open);
        let count = points().count();
        if count < 2 {
            return points().next().map_or(guess, Fit::level);
        }
        let device = points().last().map_or(guess.device, |point| point.device);
        let free = line_under(points, device, POOR_SKEW, guess);
        let beyond = free.slope.abs() - 4.0 * free.slope_error;
        self.poor = count >= 4 && (beyond > 6.0 * self.usual_skew || self.poor && beyond > 0.0);
        if self.poor { free } else { line_under(points, device, self.usual_skew, guess) }
    }
}

/// The expectile line under `points`, given at `device` [s]; `skew` is the spread of slopes that is
/// expected beforehand.
fn line_under<I: Iterator<Item = Point>>(
    points: impl Fn() -> I,
    device: f64,
    skew: f64,
    guess: Fit,
) -> Fit {
    let (mut delay, mut slope) = (guess.at(device), guess.slope);
    let mut sums = Sums::default();
    let mut spread = mean_residual(points(), device, (delay, slope));
    for _ in 0..ITERATIONS {
        sums = Sums::default();
        let mut absolute = 0.0;
        for point in points() {
            let x = point.device - device;
            let residual = point.delay - delay - slope * x;
            let above = ABOVE * (FAR * spread / residual.abs()).min(1.0);
            sums.add(if residual > 0.0 { above } else { 1.0 - ABOVE }, x, point.delay, residual);
            absolute += residual.abs();
        }
        spread = (absolute / sums.count).max(LEAST_SPREAD);
        let before = (delay, slope);
        (delay, slope) = sums.solve(skew);
        if (before.0 - delay).abs() < 1e-8 && (before.1 - slope).abs() < 1e-10 {
            break;
        }
    }
    sums.fit(device, (delay, slope), skew)
}

/// The mean distance of points from a line that has the delay and slope `line` at `device` [s].
fn mean_residual(
    points: impl Iterator<Item = Point>,
    device: f64,
    (delay, slope): (f64, f64),
) -> f64 {
    let residual = |point: Point| point.delay - delay - slope * (point.device - device);
    let (count, sum) =
        points.fold((0.0, 0.0), |(count, sum), point| (count + 1.0, sum + residual(point).abs()));
    (sum / count).max(LEAST_SPREAD)
}

/// Weighted sums of a straight line's least squares.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    w: f64,
    x: f64,
    xx: f64,
    y: f64,
    xy: f64,
    /// Sum of the squares of weighted residuals: with it the standard errors hold for any
    /// distribution of delays (Huber's sandwich).
    score: f64,
    count: f64,
}

impl Sums {
    fn add(&mut self, weight: f64, x: f64, y: f64, residual: f64) {
        self.w += weight;
        self.x += weight * x;
        self.xx += weight * x * x;
        self.y += weight * y;
        self.xy += weight * x * y;
        self.score += (weight * residual).powi(2);
        self.count += 1.0;
    }

    /// The variance that a point of weight one has [s²].
    fn variance(&self) -> f64 {
        self.score.max(self.count * (0.1 * LEAST_SPREAD).powi(2)) / self.w
    }

    /// Sum of squares of x around its mean, and what the expected slopes add to it.
    fn squares(&self, skew: f64) -> (f64, f64) {
        let squares = self.xx - self.x * self.x / self.w;
        (squares.max(0.0), self.variance() / (skew * skew))
    }

    /// The line's value at x = 0, and its slope.
    fn solve(&self, skew: f64) -> (f64, f64) {
        let (squares, prior) = self.squares(skew);
        let slope = (self.xy - self.x * self.y / self.w) / (squares + prior);
        ((self.y - slope * self.x) / self.w, slope)
    }

    fn fit(&self, device: f64, (delay, slope): (f64, f64), skew: f64) -> Fit {
        let (squares, prior) = self.squares(skew);
        Fit {
            device,
            delay,
            slope,
            slope_error: (self.variance() / (squares + prior)).sqrt(),
            centre: device + self.x / self.w,
            centre_error: (self.variance() / self.w).sqrt(),
        }
    }
}
