//! The steps of a sawtooth of delays, at which the true offset of a clock is known.
//!
//! A packet waits for the next event of its link, for at most an interval. So the true offset lies between the lowest
//! delay and one interval below it, and nothing shows where, until the delays step by an interval: there the packet
//! with the lower of the two delays did not wait. These moments are knots; between and after them the clock is taken to
//! run at a nearly constant rate, within the band.

use super::random_walk;
use crate::clock::envelope::USUAL_SKEW;
use crate::clock::fit::{Fit, Point};
use crate::clock::straight::Straight;

/// How close a bin must be to the present tooth, or to a whole step from it, as a fraction of the interval.
const NEAR: f64 = 0.25;
/// The number of consecutive higher bins that make a step: in fewer, all packets may have been
/// retransmitted.
const HIGHER: u32 = 5;
/// The number of lower bins that make a step, and of bins that fit no tooth that end the present one.
const LOWER: u32 = 2;
const NEITHER: u32 = 5;
/// The longest pause over which steps can be counted [s].
const PAUSE_SECS: f64 = 10.0;
/// The time within which a step back undoes the last step [s]: packets sent slightly earlier or later fall
/// on either side of it.
const SAME_SECS: f64 = 60.0;
/// The share of bins off their tooth above which teeth are too short to be followed, and the number of bins
/// over which the share is averaged.
const OFF: f64 = 0.35;
const OFF_BINS: f64 = 30.0;
/// The standard error of a knot in value and in time [s].
const FINE_SECS: f64 = 0.03e-3;
const BIN_SECS: f64 = 1.0;
/// Where delays change steadily between knots, the standard error in value is smaller: `ROUGHNESSES` times the bins'
/// deviation from a steady change, but at least the share `STEADIEST` of `FINE_SECS`. The standard error in time falls
/// likewise, but at least to the share `LEAST_BIN`, as if the knot were anywhere in a bin of two seconds.
const ROUGHNESSES: f64 = 3.0;
const STEADIEST: f64 = 0.2;
const LEAST_BIN: f64 = 0.58;
/// The uncertainty stated where the true offset may be anywhere between two events, as a share of the interval.
const STATED: f64 = 0.52;
/// After the first tooth, which starts at an unknown phase: the assumed rate of the following teeth, as a fraction of
/// the fastest that their length allows, and half the 95 % interval of that fraction. The mean is two thirds, as a step
/// is the likelier to be seen, the faster the rate.
const FASTER: f64 = 2.0 / 3.0;
const ABOUT: f64 = 0.55;
/// How long after a knot the slope of its tooth cannot be estimated [s].
const FLAT_SECS: f64 = 20.0;
/// The largest skew that is assumed [1].
const MOST_SKEW: f64 = 200e-6;
/// The number of standard errors by which a slope must exceed the largest skew.
const SURE_ERRORS: f64 = 3.0;

/// The number of steps that the live model keeps.
const STEPS: usize = 24;
/// The number of standard errors stated after two steps or more.
const ERRORS: f64 = 3.0;
/// How close intervals must be to count as equal [fraction].
const SAME_INTERVAL: f64 = 0.01;

/// A sawtooth, followed bin by bin.
#[derive(Clone, Debug)]
pub(in crate::clock) struct Teeth {
    /// The height of a tooth [s]; 0 if there is none.
    interval: f64,
    /// The last lowest delay of the present tooth; `None` before the first bin.
    level: Option<Point>,
    /// The device time of the newest bin [s].
    newest: f64,
    /// When the present tooth was first seen, and how long the tooth before the last step lasted [s].
    since: f64,
    before: f64,
    higher: u32,
    lower: u32,
    /// The first of the current run of lower bins.
    fallen: Point,
    neither: u32,
    /// The share of bins that are off their tooth.
    off: f64,
    /// The rate at which delays change from bin to bin of a tooth [s/s], NaN before the second bin; and how far bins
    /// deviate from a steady change [s].
    rate: f64,
    rough: f64,
    /// Whether the last step was up (1) or down (-1); 0 after a pause.
    direction: f64,
    /// The points where delays stepped, oldest first.
    knots: Vec<Point>,
    /// The most knots that are kept.
    most: usize,
}

impl Teeth {
    /// The memory that a live model uses for its steps [B].
    pub const LIVE_BYTES: usize = (STEPS + 1) * size_of::<Point>();

    /// Creates a live model, which keeps only the last steps.
    pub fn live() -> Teeth {
        Teeth::keeping(Some(STEPS))
    }

    /// Creates a model that keeps all steps.
    pub fn whole() -> Teeth {
        Teeth::keeping(None)
    }

    fn keeping(most: Option<usize>) -> Teeth {
        let none = Point { device: 0.0, delay: 0.0 };
        Teeth {
            interval: 0.0,
            level: None,
            newest: 0.0,
            since: 0.0,
            before: 0.0,
            higher: 0,
            lower: 0,
            fallen: none,
            neither: 0,
            off: 0.0,
            rate: f64::NAN,
            rough: FINE_SECS,
            direction: 0.0,
            knots: Vec::with_capacity(most.map_or(0, |most| most + 1)),
            most: most.unwrap_or(usize::MAX),
        }
    }

    /// Whether teeth have this height [s].
    pub fn have_height(&self, interval: f64) -> bool {
        (interval - self.interval).abs() <= SAME_INTERVAL * interval
    }

    /// Resets the model to teeth of the height `interval` [s].
    pub fn begin(&mut self, interval: f64) {
        self.knots.clear();
        let knots = std::mem::take(&mut self.knots);
        *self = Teeth { interval, knots, most: self.most, ..Teeth::keeping(None) };
    }

    /// Takes the lowest point of the next bin.
    pub fn push(&mut self, bin: Point) {
        if self.interval <= 0.0 {
            return;
        }
        let Some(level) = self.level.filter(|_| bin.device - self.newest < PAUSE_SECS) else {
            return self.anchor(bin);
        };
        let passed = bin.device - self.newest;
        self.newest = bin.device;
        let steps = (bin.delay - level.delay) / self.interval;
        let is_off = steps.abs() >= NEAR;
        self.off += (f64::from(u8::from(is_off)) - self.off) / OFF_BINS;
        if !is_off {
            self.smooth((bin.delay - level.delay) / (bin.device - level.device), passed);
            self.level = Some(bin);
            (self.higher, self.lower, self.neither) = (0, 0, 0);
        } else if (steps - 1.0).abs() < NEAR {
            self.higher += 1;
            if self.higher >= HIGHER {
                self.step(level, bin, 1.0);
            }
        } else if (steps + 1.0).abs() < NEAR {
            if self.lower == 0 {
                self.fallen = bin;
            }
            self.lower += 1;
            if self.lower >= LOWER {
                self.step(self.fallen, bin, -1.0);
            }
        } else {
            self.neither += 1;
            if self.neither >= NEITHER {
                self.anchor(bin);
            }
        }
    }

    /// Takes the rate at which delays changed over the last bin, of `passed` [s].
    fn smooth(&mut self, rate: f64, passed: f64) {
        let off = (rate - self.rate).abs() * passed / 2.0;
        if off.is_finite() {
            self.rough += (off.min(FINE_SECS) - self.rough) / OFF_BINS;
        }
        self.rate = rate;
    }

    /// Starts from a tooth whose number of steps from the previous one is unknown.
    fn anchor(&mut self, bin: Point) {
        (self.level, self.newest, self.since) = (Some(bin), bin.device, bin.device);
        (self.higher, self.lower, self.neither, self.direction) = (0, 0, 0, 0.0);
    }

    /// Records a step at a knot; `bin` is the present point.
    fn step(&mut self, knot: Point, bin: Point, direction: f64) {
        let last = self.knots.last().copied();
        let is_back = self.direction * direction < 0.0;
        if is_back && last.is_some_and(|last| knot.device - last.device < SAME_SECS) {
            self.knots.pop();
            self.direction = 0.0;
        } else {
            if self.knots.len() == self.most {
                self.knots.remove(0);
            }
            self.knots.push(knot);
            self.direction = direction;
            self.before = knot.device - self.since;
        }
        self.since = knot.device;
        self.level = Some(bin);
        (self.higher, self.lower, self.neither) = (0, 0, 0);
    }

    /// The last point of the present tooth, if the newest bin was on it.
    pub fn level(&self) -> Option<Point> {
        self.level.filter(|level| level.device >= self.newest)
    }

    /// Whether there are teeth that last long enough to be followed.
    pub fn are_followed(&self) -> bool {
        self.interval > 0.0 && self.off <= OFF && self.level.is_some()
    }

    /// The uncertainty of the steps relative to the usual one: 1 if there are too few to show the clock's rate or if
    /// delays change irregularly between them, down to 0.2 if delays change steadily.
    pub fn roughness(&self) -> f64 {
        if self.knots.len() < 2 { 1.0 } else { self.unsteady() }
    }

    /// How irregularly delays change from bin to bin of a tooth, from 0.2 (steadily) to 1.
    fn unsteady(&self) -> f64 {
        (ROUGHNESSES * self.rough / FINE_SECS).clamp(STEADIEST, 1.0)
    }

    /// Whether delays change faster over many teeth than those of any quartz, as may happen with numbered samples whose
    /// rate is hardly known. Teeth that pass so fast show nothing about a clock.
    pub fn pass_too_fast(&self, bins: impl Iterator<Item = Point> + Clone) -> bool {
        let straight = Straight::through(bins, STATED * self.interval);
        straight.slope.abs() - SURE_ERRORS * straight.error > MOST_SKEW
    }

    /// The line at `level`, a point of a tooth, through the known steps before and after it.
    pub fn line(&self, level: Point) -> Fit {
        let Point { device, delay: high } = level;
        let low = high - self.interval;
        let wait = STATED * self.interval;
        let (delay, slope, error, slope_error) = match self.knots[..] {
            [] => (high - self.interval / 2.0, 0.0, wait, USUAL_SKEW),
            [knot] => self.behind(knot, level),
            [first, .., last] => {
                // The change of a wait within one bin.
                let steps = (self.knots.len() - 1) as f64;
                let coarse =
                    BIN_SECS * self.interval * steps / (last.device - first.device).max(BIN_SECS);
                let unsteady = self.unsteady();
                let noise = unsteady * FINE_SECS + unsteady.max(LEAST_BIN) * coarse;
                let found = random_walk::estimate(&self.knots, noise, device);
                (found.delay, found.slope, ERRORS * found.error, found.slope_error)
            }
        };
        let delay = delay.clamp(low, high);
        let within = (high - delay).max(delay - low) + (STATED - 0.5) * self.interval;
        Fit::stated(Point { device, delay }, (slope, slope_error), error.min(within))
    }

    /// The true delay [s], its slope, its uncertainty [s] and the slope's standard error at `level`, after or before
    /// the only knot so far: a tooth cannot pass faster than its duration so far allows.
    fn behind(&self, knot: Point, level: Point) -> (f64, f64, f64, f64) {
        let passed = level.device - knot.device;
        let lasted = passed.abs().max(self.before).max(self.newest - self.since).max(1.0);
        if self.direction == 0.0 {
            return (knot.delay, 0.0, 2.0 * FINE_SECS + MOST_SKEW * passed.abs(), USUAL_SKEW);
        }
        // The slope of the tooth itself shows the difference between the clocks of link and device.
        let is_higher = (passed > 0.0) == (self.direction > 0.0);
        let began = knot.delay + if is_higher { self.interval } else { 0.0 };
        let flat = if passed.abs() > FLAT_SECS { (level.delay - began) / passed } else { 0.0 };
        let steepest = flat + self.direction * self.interval / lasted;
        let (flat, steepest) =
            (flat.clamp(-MOST_SKEW, MOST_SKEW), steepest.clamp(-MOST_SKEW, MOST_SKEW));
        let slope = flat + FASTER * (steepest - flat);
        let spread = ABOUT * (steepest - flat).abs();
        let coarse = BIN_SECS * (steepest - flat).abs();
        let error = 2.0 * FINE_SECS + coarse + spread * passed.abs();
        (knot.delay + slope * passed, slope, error, spread / 2.0)
    }
}
