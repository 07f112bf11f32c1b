//! The lower envelope of delays: what arrival less device time is when nothing held a packet up.
//!
//! Bluetooth, Wi-Fi and USB only ever add to the shortest delay. So the smallest `arrival - device`
//! of each two seconds is kept, for half an hour, and a line is laid low through these by asymmetric
//! least squares (an expectile; Newey & Powell 1987, doi:10.2307/1911031), iteratively reweighted;
//! what lies far above counts by its sign alone (Huber). Its slope is the clock's skew, which quartz
//! keeps within about 100 ppm.
//!
//! How long points are remembered is weighed: the more their noise, the longer; and the longer, the
//! more a skew that drifts with temperature bends away from the line. What is stated is both: the
//! standard error of the line's end with the correlation that residuals have (Newey & West 1987,
//! doi:10.2307/1913610), and what a drift of the skew would do to it.
//!
//! All constants were chosen on seeds 1 to 100 of the links of `bench/timefilter`.

use std::collections::VecDeque;

use super::fit::{Expected, Fit, Point, line_under};
use super::straight::Straight;

/// How long a bin is [ns].
pub(super) const BIN_NANOS: i64 = 2_000_000_000;
/// How long bins are kept [s].
pub(super) const WINDOW_SECS: f64 = 1800.0;
const BINS: usize = 900;
/// The drift of skew for which noise is traded: with a memory of τ it is `DRIFT · τ²` of error
/// [1/s].
const DRIFT: f64 = 3e-8;
/// How long points are remembered at least and at most (to a weight of 1/e) [s].
const MEMORY_SECS: (f64, f64) = (60.0, 600.0);
/// After so many times the memory a point counts no more.
const FORGOTTEN: f64 = 4.0;
/// The spread of skews among clocks with a quartz (standard deviation, as a slope).
pub(super) const USUAL_SKEW: f64 = 50e-6;
/// How many times that a clock must be off to be called poor.
const POOR: f64 = 6.0;
/// The spread of skews among clocks that have shown to be poor.
pub(super) const POOR_SKEW: f64 = 0.03;
/// No clock is that poor: delays that change as fast are those of a link that is slow.
pub(super) const INCREDIBLE: f64 = 0.05;
/// By how many standard errors its slope must show it.
const POOR_ERRORS: f64 = 3.0;
/// With fewer bins since a silence, and more than so many before it, it runs as it did, but for what temperature may
/// have done to it (standard deviation, as a slope).
const SEEN: usize = 16;
const KNOWN: usize = 32;
const SILENT_SKEW: f64 = 4e-6;
/// How many bins it takes to say so, at the beginning of a clock and after it was seen wrong.
const POOR_BINS: (usize, usize) = (6, 30);

/// The smallest delays of the last bins.
#[derive(Clone, Debug)]
pub(super) struct Envelope {
    bins: VecDeque<Point>,
    /// How far slopes spread among clocks of this kind.
    usual_skew: f64,
    poor: bool,
    /// How many bins it takes to say so.
    poor_bins: usize,
    /// The spread of points when there were enough of them [s].
    spread: f64,
}

impl Envelope {
    /// What it allocates [B].
    pub const BYTES: usize = (BINS + 1) * size_of::<Point>();

    pub fn new(usual_skew: f64) -> Envelope {
        let bins = VecDeque::with_capacity(BINS + 1);
        Envelope { bins, usual_skew, poor: false, poor_bins: POOR_BINS.0, spread: 0.0 }
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

    /// Forgets all bins but the last ones.
    pub fn keep(&mut self, last: usize) {
        let old = self.bins.len().saturating_sub(last);
        self.bins.drain(..old);
        self.poor_bins = POOR_BINS.1;
    }

    /// The lowest points of bins, oldest first.
    pub fn bins(&self) -> impl Iterator<Item = Point> {
        self.bins.iter().copied()
    }

    /// How many bins there are.
    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Whether the clock runs as no usual one does.
    pub fn is_poor(&self) -> bool {
        self.poor
    }

    /// Lays a line under the bins and the lowest point of the open one, beginning with `guess`; points
    /// scatter by `scatter` at least [s].
    ///
    /// A slope that cannot be that of a usual clock widens what is held possible. One that cannot be that of
    /// any clock is the link's: the clock is then taken to run as it should, from its fastest packet.
    pub fn fit(&mut self, open: Option<Point>, guess: Fit, scatter: f64) -> Fit {
        let points = || self.bins.iter().copied().chain(open);
        let count = points().count();
        if count < 2 {
            return points().next().map_or(guess, Fit::level);
        }
        let device = points().last().map_or(guess.device, |point| point.device);
        let memory = memory_secs(guess.spread);
        let from = self.bins.partition_point(|bin| bin.device < device - FORGOTTEN * memory);
        let points = || self.bins.iter().skip(from).copied().chain(open);
        let seen = points().count();
        if seen < SEEN && count > KNOWN {
            // After a silence nothing but the clock's own course is known of how fast it runs.
            let expected = Expected { skew: SILENT_SKEW, slope: guess.slope, scatter };
            let fit = line_under(points, device, memory, expected, guess);
            return fit.no_surer(self.spread / (seen as f64).sqrt());
        }
        let usual = POOR * self.usual_skew;
        let straight = Straight::through(points(), scatter);
        let excess = straight.slope.abs() - POOR_ERRORS * straight.error;
        if count >= self.poor_bins && excess > INCREDIBLE.max(2.0 * usual) {
            let fastest = points().min_by(|a, b| a.delay.total_cmp(&b.delay));
            return fastest.map_or(guess, Fit::level);
        }
        let shown = count >= self.poor_bins && excess > usual;
        let within = |skew: f64| {
            line_under(points, device, memory, Expected { skew, slope: 0.0, scatter }, guess)
        };
        if shown || self.poor {
            let free = within(POOR_SKEW.max(usual));
            self.poor = shown || free.slope.abs() > usual;
            if self.poor {
                return free;
            }
        }
        let fit = within(self.usual_skew);
        if seen >= SEEN {
            self.spread = fit.spread;
        }
        fit
    }
}

/// How long points are remembered whose mean distance from their line is this [s].
pub(super) fn memory_secs(spread: f64) -> f64 {
    (spread / DRIFT).sqrt().clamp(MEMORY_SECS.0, MEMORY_SECS.1)
}
