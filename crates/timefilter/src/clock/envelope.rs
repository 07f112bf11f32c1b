//! The lower envelope of delays: arrival minus device time of packets that were not delayed.
//!
//! Bluetooth, Wi-Fi and USB only ever add to the shortest delay. So the smallest `arrival - device` of
//! every two seconds is kept for half an hour, and a low line is fitted to these by iteratively reweighted
//! asymmetric least squares (an expectile; Newey & Powell 1987, doi:10.2307/1911031); distant points count
//! by their sign alone (Huber). Its slope is the clock's skew, which for quartz is within about 100 ppm.
//!
//! The memory of the fit is a trade-off: noise calls for a longer one, but over a longer one a skew that
//! drifts with temperature bends the delays away from the line. The stated uncertainty covers both: the
//! standard error at the end of the line with autocorrelated residuals (Newey & West 1987,
//! doi:10.2307/1913610), and the effect of a drift of the skew.
//!
//! All constants were chosen on seeds 1 to 100 of the links of `bench/timefilter`.

use std::collections::VecDeque;

use super::fit::{Expected, Fit, Point, line_under};
use super::straight::Straight;

/// The duration of a bin [ns].
pub(super) const BIN_NANOS: i64 = 2_000_000_000;
/// How long bins are kept [s].
pub(super) const WINDOW_SECS: f64 = 1800.0;
const BINS: usize = 900;
/// The drift of the skew assumed in the trade-off against noise: over a memory of τ it causes an error of `DRIFT · τ²`
/// [1/s].
const DRIFT: f64 = 3e-8;
/// The shortest and the longest memory of points (to a weight of 1/e) [s].
const MEMORY_SECS: (f64, f64) = (60.0, 600.0);
/// The age beyond which a point is ignored, as a multiple of the memory.
const FORGOTTEN: f64 = 4.0;
/// The standard deviation of the skew of quartz clocks [1].
pub(super) const USUAL_SKEW: f64 = 50e-6;
/// The multiple of the usual skew from which a clock counts as poor.
const POOR: f64 = 6.0;
/// The standard deviation of the skew of clocks that have proved to be poor [1].
pub(super) const POOR_SKEW: f64 = 0.03;
/// A skew larger than that of any clock [1]: delays that change this fast come from a slow link.
pub(super) const INCREDIBLE: f64 = 0.05;
/// The number of standard errors by which a slope must exceed the limit.
const POOR_ERRORS: f64 = 3.0;
/// With fewer than `SEEN` bins since a silence, and more than `KNOWN` in all, the clock is taken to run as before,
/// except for the effect of temperature (standard deviation of the skew).
const SEEN: usize = 16;
const KNOWN: usize = 32;
const SILENT_SKEW: f64 = 4e-6;
/// The time over which the usual size of residuals is averaged, and the longest time that a single fit counts for [s].
const USUAL_SECS: f64 = 600.0;
const USUAL_MOST_SECS: f64 = 60.0;
/// The number of bins needed to call a clock poor: at its start, and after a wrong verdict.
const POOR_BINS: (usize, usize) = (6, 30);
/// The number of packets needed to call a clock poor: if delays have changed by more than any wait for a link event, and
/// if not. The waits of few packets may rise or fall steadily, as along one edge of a sawtooth.
const POOR_PACKETS: (f64, f64) = (24.0, 84.0);
/// A change of delays beyond that of waits for link events [s].
const BEYOND_WAITS_SECS: f64 = 0.1;

/// The smallest delays of the last bins.
#[derive(Clone, Debug)]
pub(super) struct Envelope {
    bins: VecDeque<Point>,
    /// The standard deviation of the skew of clocks of this kind.
    usual_skew: f64,
    poor: bool,
    /// The number of bins needed to call the clock poor.
    poor_bins: usize,
    /// The spread of points when there were last enough of them [s].
    spread: f64,
    usual: Usual,
}

/// The usual size of residuals, averaged over the last minutes.
#[derive(Clone, Copy, Debug, Default)]
struct Usual {
    /// The device time of the last fit, and the time that the mean covers [s].
    device: f64,
    secs: f64,
    /// The size of residuals [s].
    residual: f64,
}

impl Usual {
    fn push(&mut self, fit: &Fit) {
        let passed = (fit.device - self.device).clamp(0.0, USUAL_MOST_SECS);
        self.device = self.device.max(fit.device);
        self.secs = (self.secs + passed).min(USUAL_SECS);
        let share = if self.secs > 0.0 { passed / self.secs } else { 0.0 };
        self.residual += (fit.residual() - self.residual) * share;
    }
}

impl Envelope {
    /// The memory that an envelope allocates [B].
    pub const BYTES: usize = (BINS + 1) * size_of::<Point>();

    pub fn new(usual_skew: f64) -> Envelope {
        let bins = VecDeque::with_capacity(BINS + 1);
        Envelope {
            bins,
            usual_skew,
            poor: false,
            poor_bins: POOR_BINS.0,
            spread: 0.0,
            usual: Usual::default(),
        }
    }

    /// Takes the lowest point of a closed bin.
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

    /// Drops all but the `last` newest bins.
    pub fn keep(&mut self, last: usize) {
        let old = self.bins.len().saturating_sub(last);
        self.bins.drain(..old);
        self.poor_bins = POOR_BINS.1;
    }

    /// The lowest points of bins, oldest first.
    pub fn bins(&self) -> impl Iterator<Item = Point> + Clone {
        self.bins.iter().copied()
    }

    /// Whether clocks of this kind are as accurate as quartz.
    pub fn is_of_quartz(&self) -> bool {
        self.usual_skew <= USUAL_SKEW
    }

    /// The lowest points of the bins that a line depends on most.
    pub fn remembered(&self, line: &Fit) -> impl Iterator<Item = Point> {
        let since = line.device - memory_secs(line.spread);
        let from = self.bins.partition_point(|bin| bin.device < since);
        self.bins.iter().skip(from).copied()
    }

    /// The number of bins.
    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Whether the skew is outside the usual range.
    pub fn is_poor(&self) -> bool {
        self.poor
    }

    /// Fits a line under the bins and the lowest point of the open one, starting from `guess`; points
    /// scatter by at least `scatter` [s], and each is the lowest of `in_bin` packets.
    ///
    /// A slope outside the usual range widens the prior. A slope beyond that of any clock is due to the
    /// link: the clock is then taken to run at its nominal rate from its fastest packet on.
    pub fn fit(&mut self, open: Option<Point>, guess: Fit, scatter: f64, in_bin: f64) -> Fit {
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
            // After a silence, the rate is known only from the clock's own history.
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
        let since = points().next().map_or(device, |first| first.device);
        let is_beyond_waits = straight.slope.abs() * (device - since) > BEYOND_WAITS_SECS;
        let packets = if is_beyond_waits { POOR_PACKETS.0 } else { POOR_PACKETS.1 };
        let is_known = count >= self.poor_bins && count as f64 * in_bin >= packets;
        let shown = is_known && excess > usual;
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
            self.usual.push(&fit);
        }
        // A few points may lie on a line by chance, or on one edge of a sawtooth.
        fit.no_surer_than_by(self.usual.residual)
    }
}

/// The memory for points with this mean distance from their line [s].
pub(super) fn memory_secs(spread: f64) -> f64 {
    (spread / DRIFT).sqrt().clamp(MEMORY_SECS.0, MEMORY_SECS.1)
}
