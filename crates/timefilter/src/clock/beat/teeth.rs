//! What a saw-tooth of delays says of a clock: where it steps, the truth is known.
//!
//! A packet waits for the next event of its link, for an interval at most. So the true offset lies between
//! the lowest delay and an interval below it, and nothing shows where, until the delays step by an
//! interval: there the wait was zero or restarted from zero, whichever delay is the lower. These moments
//! are knots; between and after them the clock runs straight, as far as clocks do, and never leaves the
//! band.

use crate::clock::fit::{Fit, Point};

/// How near to the delay of its tooth a bin is, and to a whole step from it, as a part of the interval.
const NEAR: f64 = 0.25;
/// So many bins in a row that are higher make a step: in fewer, all packets may have failed.
const HIGHER: u32 = 5;
/// So many that are lower do, and that are neither.
const LOWER: u32 = 2;
const NEITHER: u32 = 5;
/// After a longer pause nobody knows how many steps there were [s].
const PAUSE_SECS: f64 = 10.0;
/// A step back so soon after a step is the same one: packets that are sent a little earlier or later are on
/// either side of it [s].
const SAME_SECS: f64 = 60.0;
/// Where more than such a part of bins is off its tooth, teeth are too short to be followed, and how many bins
/// that is the mean of.
const OFF: f64 = 0.35;
const OFF_BINS: f64 = 30.0;
/// How far a knot is from the truth (standard deviation) in value and in time [s].
const FINE_SECS: f64 = 0.03e-3;
const BIN_SECS: f64 = 1.0;
/// The uncertainty stated between two events that do not show where the true offset lies, as a share of the
/// interval.
const STATED: f64 = 0.52;
/// The first tooth begins anywhere. How fast the ones after it are run through, as a part of the fastest that they
/// can be for its length, and half the 95 % interval of that.
const FASTER: f64 = 0.6;
const ABOUT: f64 = 0.5;
/// For so long after a knot nothing shows how its tooth grows [s].
const FLAT_SECS: f64 = 20.0;
/// No device's clock is further off than this (as a slope).
const MOST_SKEW: f64 = 200e-6;

/// How many steps the live model keeps.
const STEPS: usize = 16;
/// How long steps are remembered [s], and the drift of skew that is stated between them, beside that of other
/// lines [1/s].
const LIVE: Memory = Memory { secs: 150.0, drift: 1.5e-8 };
/// The same with steps to both sides.
const HINDSIGHT: Memory = Memory { secs: 100.0, drift: 0.7e-8 };
/// How near to each other intervals are that are one, as a part.
const SAME_INTERVAL: f64 = 0.01;

struct Memory {
    secs: f64,
    drift: f64,
}

/// A saw-tooth that is followed bin by bin.
#[derive(Clone, Debug)]
pub(in crate::clock) struct Teeth {
    /// How high it is [s]; 0 where there is none.
    interval: f64,
    /// The lowest delay of the present tooth, where it was seen last; there is none before the first bin.
    level: Option<Point>,
    /// The newest bin [s].
    newest: f64,
    /// From when on the present tooth was seen [s], and for how long the one before the last step was.
    since: f64,
    before: f64,
    higher: u32,
    lower: u32,
    /// The first of the bins that are lower.
    fallen: Point,
    neither: u32,
    /// The part of bins that are off their tooth.
    off: f64,
    /// Whether the last step was up (1) or down (-1); 0 where there was a pause since.
    direction: f64,
    /// Where it stepped, oldest first.
    knots: Vec<Point>,
    /// How many are kept.
    most: usize,
}

impl Teeth {
    /// What a live model keeps its steps in [B].
    pub const LIVE_BYTES: usize = (STEPS + 1) * size_of::<Point>();

    /// None so far, for a live model: the last steps will be kept.
    pub fn live() -> Teeth {
        Teeth::keeping(Some(STEPS))
    }

    /// None so far; all steps will be kept.
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
            direction: 0.0,
            knots: Vec::with_capacity(most.map_or(0, |most| most + 1)),
            most: most.unwrap_or(usize::MAX),
        }
    }

    /// Whether teeth are so high [s].
    pub fn are_of(&self, interval: f64) -> bool {
        (interval - self.interval).abs() <= SAME_INTERVAL * interval
    }

    /// Forgets all; teeth are so high from now on [s].
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
        self.newest = bin.device;
        let steps = (bin.delay - level.delay) / self.interval;
        let is_off = steps.abs() >= NEAR;
        self.off += (f64::from(u8::from(is_off)) - self.off) / OFF_BINS;
        if !is_off {
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

    /// A tooth is seen of which nobody knows which one it is.
    fn anchor(&mut self, bin: Point) {
        (self.level, self.newest, self.since) = (Some(bin), bin.device, bin.device);
        (self.higher, self.lower, self.neither, self.direction) = (0, 0, 0, 0.0);
    }

    /// It stepped at a knot, and is at `bin` now.
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

    /// The delay of the present tooth, where it was seen just now.
    pub fn level(&self) -> Option<Point> {
        self.level.filter(|level| level.device >= self.newest)
    }

    /// Whether there are teeth, long enough to be followed.
    pub fn are_followed(&self) -> bool {
        self.interval > 0.0 && self.off <= OFF && self.level.is_some()
    }

    /// The line where a tooth is at `level`, through the steps so far.
    pub fn live_line(&self, level: Point) -> Fit {
        self.line(level, &LIVE)
    }

    /// The line where a tooth is at `level`, through the steps to both sides.
    pub fn line_with_hindsight(&self, level: Point) -> Fit {
        self.line(level, &HINDSIGHT)
    }

    fn line(&self, level: Point, memory: &Memory) -> Fit {
        let Point { device, delay: high } = level;
        let low = high - self.interval;
        let wait = STATED * self.interval;
        let (delay, slope, error) = match self.knots[..] {
            [] => (high - self.interval / 2.0, 0.0, wait),
            [knot] => self.behind(knot, level),
            [..] => {
                let fit = Fit::through(&self.knots, device, memory.secs, FINE_SECS, BIN_SECS);
                (
                    fit.delay,
                    fit.slope,
                    fit.uncertainty_at(device, device) + fit.bend_secs(memory.drift),
                )
            }
        };
        let delay = delay.clamp(low, high);
        let within = (high - delay).max(delay - low) + (STATED - 0.5) * self.interval;
        Fit::stated(Point { device, delay }, slope, error.min(within))
    }

    /// The delay where a tooth is at `level` [s], how it grows and how wrong it may be [s], behind the only knot so
    /// far or before it: it is run through no faster than it lasts.
    fn behind(&self, knot: Point, level: Point) -> (f64, f64, f64) {
        let passed = level.device - knot.device;
        let lasted = passed.abs().max(self.before).max(self.newest - self.since).max(1.0);
        if self.direction == 0.0 {
            return (knot.delay, 0.0, 2.0 * FINE_SECS + MOST_SKEW * passed.abs());
        }
        // By how much the link's clock and the device's are apart shows in the tooth itself.
        let is_higher = (passed > 0.0) == (self.direction > 0.0);
        let began = knot.delay + if is_higher { self.interval } else { 0.0 };
        let flat = if passed.abs() > FLAT_SECS { (level.delay - began) / passed } else { 0.0 };
        let steepest = flat + self.direction * self.interval / lasted;
        let (flat, steepest) =
            (flat.clamp(-MOST_SKEW, MOST_SKEW), steepest.clamp(-MOST_SKEW, MOST_SKEW));
        let slope = flat + FASTER * (steepest - flat);
        let spread = ABOUT * (steepest - flat).abs();
        let coarse = BIN_SECS * (steepest - flat).abs();
        (knot.delay + slope * passed, slope, 2.0 * FINE_SECS + coarse + spread * passed.abs())
    }
}
