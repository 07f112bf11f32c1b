//! A low line through points, with an estimate of its error.

/// The stated drift of the skew [1/s].
const STATED_DRIFT: f64 = 1e-8;
/// The initial additional drift of the skew during warm-up [1/s], and the duration of the warm-up [s].
const WARM_UP_DRIFT: f64 = 1e-7;
const WARM_UP_SECS: f64 = 350.0;
/// The weight of points above the line; those below weigh one minus this.
const ABOVE: f64 = 0.35;
/// The distance above the line beyond which weights fall, as a multiple of the mean distance.
const FAR: f64 = 1.0;
/// The minimum spread of delays: the resolution of a computer's own clock readings [s].
pub(super) const LEAST_SPREAD: f64 = 1e-6;
/// The number of standard errors stated: twice those of a 95 % interval, as errors last for minutes and the
/// statistics contain only as many of these as fit into the memory.
const ERRORS: f64 = 2.0;
/// The correlation time of residuals, as a fraction of the memory.
const CORRELATED: f64 = 0.5;
/// The most that a residual contributes to the next spread, in spreads.
const OUTLYING: f64 = 4.0;
/// How much wider the standard error of few stretches is stated.
const FEW_STRETCHES: f64 = 0.75;
const ITERATIONS: usize = 12;
/// Widens the variance found from `n` points by the factor (n + `FEW`) / (n − 2).
const FEW: f64 = 4.0;

/// The prior of a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expected {
    /// The standard deviation of slopes.
    pub skew: f64,
    /// The mean slope.
    pub slope: f64,
    /// The minimum scatter of points [s].
    pub scatter: f64,
}

/// One packet: device time since the epoch began [s], and its delay, arrival minus device time [s].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub device: f64,
    pub delay: f64,
}

/// A line under the points, with an estimate of its error.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    /// The device time at which `delay` is given [s].
    pub device: f64,
    /// The delay at `device` [s].
    pub delay: f64,
    /// The slope of the delay over device time.
    pub slope: f64,
    /// The mean distance of the points from the line [s].
    pub spread: f64,
    /// The standard error of the delay at `device` [s].
    error: f64,
    /// The standard error of the slope.
    slope_error: f64,
    /// The standard error of the delay at `device` if residuals were independent and of size one.
    independent: f64,
    /// The effect of a skew that drifts by 1/s on the delay at `device` [s²].
    bend: f64,
    /// The number of stretches with independent residuals that would make the delay at `device` as certain.
    pub stretches: f64,
    /// How far the line may be off its usual level without its residuals showing it [s].
    off_level: f64,
}

impl Fit {
    /// Creates a line of slope zero through a point.
    pub fn level(point: Point) -> Fit {
        Fit {
            device: point.device,
            delay: point.delay,
            slope: 0.0,
            spread: LEAST_SPREAD,
            error: 0.0,
            slope_error: super::envelope::USUAL_SKEW,
            independent: 0.0,
            bend: 0.0,
            stretches: 1.0,
            off_level: 0.0,
        }
    }

    /// Creates a line through a point, with a 95 % interval of half-width `stated` there [s], and a slope with its
    /// standard error.
    pub fn stated(point: Point, (slope, slope_error): (f64, f64), stated: f64) -> Fit {
        Fit { slope, slope_error, error: stated / ERRORS, ..Fit::level(point) }
    }

    /// The line's delay at a device time [s].
    pub fn at(&self, device: f64) -> f64 {
        self.delay + self.slope * (device - self.device)
    }

    /// The device time at which a packet sent without delay arrives at `arrival` [s].
    pub fn device_at(&self, arrival: f64) -> f64 {
        (arrival - self.delay + self.slope * self.device) / (1.0 + self.slope)
    }

    /// The clock's rate error relative to the session's clock [ppm].
    pub fn ppm(&self) -> f64 {
        -self.slope / (1.0 + self.slope) * 1e6
    }

    /// The effect of a skew that drifts by `drift` [1/s] on the delay [s].
    pub fn bend_secs(&self, drift: f64) -> f64 {
        drift * self.bend
    }

    /// Half the width of the 95 % interval of the delay at a device time [s].
    ///
    /// `age` is the minimum time that the device has been running [s]: the skew drifts more while a device warms up.
    pub fn uncertainty_at(&self, device: f64, age: f64) -> f64 {
        let drift = STATED_DRIFT + WARM_UP_DRIFT * (-age / WARM_UP_SECS).exp();
        let beyond = (device - self.device).abs();
        let bend = self.bend + beyond * beyond / 2.0 + beyond * (2.0 * self.bend).sqrt();
        let error = ERRORS * self.error.hypot(self.slope_error * beyond);
        error.max(self.off_level) + drift * bend
    }

    /// The size of independent residuals that would give the line its standard error [s].
    pub fn residual(&self) -> f64 {
        if self.independent > 0.0 { self.error / self.independent } else { 0.0 }
    }

    /// The same line with at least the standard error that residuals of size `residual` [s] would give it.
    pub fn no_surer_than_by(self, residual: f64) -> Fit {
        self.no_surer(residual * self.independent)
    }

    /// The same line, which may be off its usual level by `off_level` [s].
    pub fn off_by(self, off_level: f64) -> Fit {
        Fit { off_level, ..self }
    }

    /// The same line with a wider standard error if that was estimated from fewer than `many` independent stretches.
    pub fn of_few_stretches(self, many: f64) -> Fit {
        let few = 1.0 + FEW_STRETCHES * (1.0 / self.stretches - 1.0 / many).max(0.0);
        Fit { error: few * self.error, ..self }
    }

    /// The same line with a standard error of at least `error` [s].
    pub fn no_surer(self, error: f64) -> Fit {
        Fit { error: self.error.max(error), ..self }
    }
}

/// Fits the line under `points` around a device time [s], weighted by a memory to both sides [s].
pub(super) fn line_around(
    points: &[Point],
    device: f64,
    memory: f64,
    skew: f64,
    guess: Fit,
) -> Fit {
    let expected = Expected { skew, slope: 0.0, scatter: 0.0 };
    line_under(|| points.iter().copied(), device, memory, expected, guess)
}

/// Fits the expectile line under `points`, given at `device` [s].
pub(super) fn line_under<I: Iterator<Item = Point>>(
    points: impl Fn() -> I,
    device: f64,
    memory: f64,
    expected: Expected,
    guess: Fit,
) -> Fit {
    let base = guess.at(device);
    let (mut delay, mut slope) = (base, guess.slope);
    let mut sums = Sums::default();
    let mut spread = mean_residual(points(), device, (delay, slope));
    let weight = |residual: f64, x: f64, spread: f64| {
        let above = ABOVE * (FAR * spread / residual.abs()).min(1.0);
        let side = if residual > 0.0 { above } else { 1.0 - ABOVE };
        side * (-x.abs() / memory).exp()
    };
    let mut used = spread;
    for _ in 0..ITERATIONS {
        sums = Sums::default();
        used = spread;
        let (mut absolute, mut count) = (0.0, 0.0);
        for point in points() {
            let x = point.device - device;
            let residual = point.delay - delay - slope * x;
            let age = (-x.abs() / memory).exp();
            sums.add(weight(residual, x, spread), x, point.delay - base);
            absolute += age * residual.abs().min(OUTLYING * spread);
            count += age;
        }
        spread = (absolute / count).max(LEAST_SPREAD);
        let before = (delay, slope);
        (delay, slope) = sums.solve(expected);
        delay += base;
        if (before.0 - delay).abs() < 1e-8 && (before.1 - slope).abs() < 1e-10 {
            break;
        }
    }
    let mut errors = Errors::new(CORRELATED * memory);
    let line = sums.line(expected);
    let (mut square, mut bend) = (0.0, 0.0);
    for point in points() {
        let x = point.device - device;
        let residual = point.delay - delay - slope * x;
        let w = weight(residual, x, used);
        let share = w * line.share(x);
        square += share * share;
        errors.push(x, share, (share * residual, w * line.slope_share(x) * residual));
        bend += share * x * x;
    }
    let stretches = errors.stretches();
    let (error, slope_error) = errors.standard();
    let finest = 0.1 * LEAST_SPREAD / sums.count.sqrt();
    Fit {
        device,
        delay,
        slope,
        spread,
        error: error.max(finest),
        slope_error: slope_error.max(1e-7).min(expected.skew.max(1e-7)),
        independent: square.sqrt(),
        bend: bend.abs() / 2.0,
        stretches,
        off_level: 0.0,
    }
}

/// The mean distance of points from the line with the delay and slope `line` at `device` [s].
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

/// Sums of the influence of residuals on the line, over stretches: neighbours are correlated (Bartlett's
/// kernel).
#[derive(Clone, Copy, Debug)]
struct Errors {
    stretch: f64,
    began: f64,
    sum: (f64, f64),
    before: (f64, f64),
    /// The influence of the present stretch on the delay, and the sum of the squared influences of earlier stretches.
    share: f64,
    shares: f64,
    squares: (f64, f64),
    /// The sums of squares over single residuals, as those over a few stretches may be small by chance.
    alone: (f64, f64),
}

impl Errors {
    fn new(stretch: f64) -> Errors {
        let none = (0.0, 0.0);
        let began = f64::NEG_INFINITY;
        let (share, shares) = (0.0, 0.0);
        Errors {
            stretch,
            began,
            sum: none,
            before: none,
            share,
            shares,
            squares: none,
            alone: none,
        }
    }

    fn push(&mut self, x: f64, share: f64, (delay, slope): (f64, f64)) {
        if x - self.began > self.stretch {
            self.end();
            self.began = x;
        }
        self.share += share;
        self.sum.0 += delay;
        self.sum.1 += slope;
        self.alone.0 += delay * delay;
        self.alone.1 += slope * slope;
    }

    fn end(&mut self) {
        let square = |sum: f64, before: f64| sum * sum + sum * before;
        self.squares.0 += square(self.sum.0, self.before.0);
        self.squares.1 += square(self.sum.1, self.before.1);
        self.before = std::mem::take(&mut self.sum);
        self.shares += self.share * self.share;
        self.share = 0.0;
    }

    /// The number of stretches of equal influence on the delay that would have the same variance.
    fn stretches(&self) -> f64 {
        let shares = self.shares + self.share * self.share;
        if shares > 0.0 { 1.0 / shares } else { 1.0 }
    }

    fn standard(mut self) -> (f64, f64) {
        self.end();
        let error = |squares: f64, alone: f64| (2.0 * squares.max(0.0) + alone).sqrt();
        (error(self.squares.0, self.alone.0), error(self.squares.1, self.alone.1))
    }
}

/// The influence of a point on a line.
#[derive(Clone, Copy, Debug)]
struct Shares {
    w: f64,
    centre: f64,
    squares: f64,
}

impl Shares {
    /// The influence on the value at x = 0, for a weight of one.
    fn share(&self, x: f64) -> f64 {
        1.0 / self.w - self.centre * self.slope_share(x)
    }

    /// The influence on the slope.
    fn slope_share(&self, x: f64) -> f64 {
        (x - self.centre) / self.squares
    }
}

/// The weighted sums of a linear least-squares fit.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    w: f64,
    x: f64,
    xx: f64,
    y: f64,
    xy: f64,
    yy: f64,
    count: f64,
}

impl Sums {
    fn add(&mut self, weight: f64, x: f64, y: f64) {
        self.w += weight;
        self.x += weight * x;
        self.xx += weight * x * x;
        self.y += weight * y;
        self.xy += weight * x * y;
        self.yy += weight * y * y;
        self.count += 1.0;
    }

    /// The variance of points around their own unregularised line [s²]; around the regularised one it would
    /// reinforce the prior.
    fn variance(&self, expected: Expected) -> f64 {
        let squares = (self.xx - self.x * self.x / self.w).max(f64::MIN_POSITIVE);
        let product = self.xy - self.x * self.y / self.w;
        let rest = self.yy - self.y * self.y / self.w - product * product / squares;
        let few = (self.count + FEW) / (self.count - 2.0).max(1.0);
        let least = expected.scatter.max(0.1 * LEAST_SPREAD);
        0.5 * (few * rest.max(0.0) / self.w).max(least * least)
    }

    fn line(&self, expected: Expected) -> Shares {
        let squares = (self.xx - self.x * self.x / self.w).max(0.0);
        let prior = self.variance(expected) / (expected.skew * expected.skew);
        Shares { w: self.w, centre: self.x / self.w, squares: squares + prior }
    }

    /// The line's value at x = 0, and its slope.
    fn solve(&self, expected: Expected) -> (f64, f64) {
        let line = self.line(expected);
        let prior = line.squares - (self.xx - self.x * self.x / self.w).max(0.0);
        let slope = (self.xy - self.x * self.y / self.w + prior * expected.slope) / line.squares;
        ((self.y - slope * self.x) / self.w, slope)
    }
}
