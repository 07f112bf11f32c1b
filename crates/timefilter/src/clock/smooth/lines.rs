//! Lines under the lowest delays around many moments of a history.

use super::NODE_SECS;
use crate::clock::comb::Comb;
use crate::clock::envelope::{BIN_NANOS, INCREDIBLE, memory_secs};
use crate::clock::fit::{Fit, Point, line_around};
use crate::clock::straight::Straight;

/// The memory with points on both sides, as a fraction of that with points on one side.
const BOTH_SIDES: f64 = 0.4;
/// The multiple of the memory within which points are used.
const REACH: f64 = 4.0;
/// The number of points that suffice for a fit.
const ENOUGH: usize = 16;
/// The quantile of all lines' residuals that limits how certain any line may count.
const USUAL: f64 = 0.8;
/// The stated drift of the skew in addition to that of the live model [1/s]: a fit to points on both sides
/// has little other error.
const DRIFT: f64 = 0.8e-8;
/// The number of independent stretches whose variance is known well enough; fewer are stated more widely.
const MANY: f64 = 7.0;
/// The numbers of bins that a stretch may have, the minimum number of stretches, and the share to which longer
/// stretches must reduce the uncertainty of lines.
const BINS: [usize; 7] = [2, 4, 8, 12, 16, 24, 32];
const STRETCHES: usize = 32;
const SURER: f64 = 0.9;

/// The length of the stretches; lines are fitted under the lowest point of each.
///
/// With few packets in a bin, or where their period is nearly a whole number of events of their link, none of a bin's
/// packets may have been fast. The longer a stretch, the closer its lowest delay is to the shortest possible one, but
/// the fewer there are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretches {
    /// The number of bins in a stretch.
    bins: usize,
    /// How far lines under single bins are above those under stretches [s].
    level: f64,
}

impl Stretches {
    /// Stretches of one bin each.
    pub const SINGLE: Stretches = Stretches { bins: 1, level: 0.0 };

    /// Finds the stretches that make lines most certain.
    pub fn surest(bins: &[Point], prior: Prior) -> Stretches {
        let single = FittedLines::under(bins, Stretches::SINGLE, prior);
        let (mut surest, mut least) = (Stretches::SINGLE, single.stated());
        for count in BINS.into_iter().filter(|count| bins.len() / count >= STRETCHES) {
            let stretches = Stretches { bins: count, level: 0.0 };
            let lines = FittedLines::under(bins, stretches, prior);
            if lines.stated() < SURER * least {
                let level = quantile(0.5, single.heights_above(&lines));
                (surest, least) = (Stretches { level, ..stretches }, lines.stated());
            }
        }
        surest
    }
}

/// What is known in advance about a clock and its link.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prior {
    /// The standard deviation of the skew of clocks of this kind.
    pub skew: f64,
    /// The comb on which the waits of packets lie.
    pub comb: Comb,
}

/// A line around each of many moments [s].
#[derive(Clone, Debug)]
pub(super) struct FittedLines {
    lines: Vec<(f64, Fit)>,
    /// The minimum size of residuals from which a line's uncertainty is stated [s].
    residual: f64,
    /// The number of bins of each point.
    bins: usize,
}

/// The points under which lines are fitted.
#[derive(Clone, Copy, Debug)]
struct Under<'a> {
    points: &'a [Point],
    prior: Prior,
    /// The factor from the residuals of these points to residuals of two-second bins that would make lines equally
    /// certain.
    noise: f64,
    /// The minimum spread of points in the long run [s].
    spread: f64,
}

impl FittedLines {
    /// Fits lines under the lowest points of stretches, shifted to the level of lines under single bins, for which
    /// fixed latencies are known.
    pub fn under(bins: &[Point], stretches: Stretches, prior: Prior) -> FittedLines {
        let moments = moments(bins);
        if stretches.bins == 1 {
            return FittedLines::around(&moments, bins, 1, prior);
        }
        let points = lowest(bins, stretches.bins);
        let mut lines = FittedLines::around(&moments, &points, stretches.bins, prior);
        lines.lines.iter_mut().for_each(|(_, fit)| fit.delay += stretches.level);
        lines
    }

    /// Fits lines under points, each the lowest of `bins` bins.
    fn around(moments: &[f64], points: &[Point], bins: usize, prior: Prior) -> FittedLines {
        let under = Under { points, prior, noise: (bins as f64).sqrt(), spread: 0.0 };
        // A few points may lie on a line by chance, or on one edge of a saw-tooth, so no line counts as more certain
        // than is usual in this course.
        let spread = quantile(0.5, under.around(moments).map(|(_, fit)| fit.spread));
        let lines: Vec<(f64, Fit)> = Under { spread, ..under }.around(moments).collect();
        let residual = quantile(USUAL, lines.iter().map(|(_, fit)| fit.residual()));
        FittedLines { lines, residual, bins }
    }

    /// The number of lines.
    pub fn len(&self) -> usize {
        self.lines.len()
    }

    /// Each line with its moment [s].
    pub fn iter(&self) -> impl Iterator<Item = (f64, Fit)> {
        self.lines.iter().map(|(device, fit)| {
            let fit = fit.no_surer_than_by(self.residual);
            (*device, if self.bins == 1 { fit.of_few_stretches(MANY) } else { fit })
        })
    }

    /// How far the lines are above others at the same moments [s].
    fn heights_above(&self, others: &FittedLines) -> impl Iterator<Item = f64> {
        let pairs = self.lines.iter().zip(&others.lines);
        pairs.map(|((device, line), (_, other))| line.at(*device) - other.at(*device))
    }

    /// The median of the uncertainties stated for the lines [s].
    fn stated(&self) -> f64 {
        let lines =
            self.lines.iter().map(|(device, fit)| (*device, fit.no_surer_than_by(self.residual)));
        quantile(0.5, lines.map(|(device, fit)| stated(&fit, device)))
    }
}

/// Half the width of the 95 % interval of a line at a device time [s].
pub(super) fn stated(fit: &Fit, device: f64) -> f64 {
    fit.uncertainty_at(device, device) + fit.bend_secs(DRIFT)
}

impl Under<'_> {
    /// The line around each moment.
    fn around(self, moments: &[f64]) -> impl Iterator<Item = (f64, Fit)> {
        let none = Point { device: 0.0, delay: 0.0 };
        let mut fit = Fit::level(self.points.first().copied().unwrap_or(none));
        moments.iter().map(move |device| {
            fit = self.line(*device, fit);
            (*device, fit)
        })
    }

    /// Fits a line around a device time to sufficiently many points.
    fn line(self, device: f64, guess: Fit) -> Fit {
        let Under { points, prior: Prior { skew, comb }, .. } = self;
        let within = |secs: f64| {
            let from = points.partition_point(|point| point.device < device - secs);
            let to = points.partition_point(|point| point.device <= device + secs);
            &points[from..to]
        };
        let mut memory = BOTH_SIDES * memory_secs(self.noise * guess.spread.max(self.spread));
        while within(REACH * memory).len() < ENOUGH.min(points.len()) {
            memory *= 2.0;
        }
        let points = within(REACH * memory);
        let straight = Straight::through(points.iter().copied(), 0.0);
        if straight.slope.abs() - straight.error > INCREDIBLE.max(12.0 * skew) {
            let fastest = points.iter().min_by(|a, b| a.delay.total_cmp(&b.delay));
            return fastest.map_or(guess, |point| Fit::level(*point));
        }
        let fit = line_around(points, device, memory, skew, guess);
        fit.off_by(comb.off_level(within(memory).iter().copied(), &fit))
    }
}

/// The moments around which lines are fitted [s]; a long silence has none, and the next one is where timestamps resume.
fn moments(bins: &[Point]) -> Vec<f64> {
    let (Some(first), Some(last)) = (bins.first(), bins.last()) else { return Vec::new() };
    let mut moments = vec![first.device];
    let mut device = first.device;
    while let Some(next) = bins.get(bins.partition_point(|bin| bin.device <= device)) {
        device = (device + NODE_SECS).max(next.device).min(last.device);
        moments.push(device);
    }
    moments
}

/// The lowest point of each stretch of `count` bins, relative to the mean slope.
fn lowest(bins: &[Point], count: usize) -> Vec<Point> {
    let slope = Straight::through(bins.iter().copied(), 0.0).slope;
    let secs = (count as i64 * BIN_NANOS) as f64 / 1e9;
    let stretch = |point: &Point| (point.device / secs).floor() as i64;
    let height = |point: &Point| point.delay - slope * point.device;
    let stretches = bins.chunk_by(|a, b| stretch(a) == stretch(b));
    let lowest =
        |stretch: &[Point]| stretch.iter().copied().min_by(|a, b| height(a).total_cmp(&height(b)));
    stretches.filter_map(lowest).collect()
}

/// The quantile `at` [0..1] of the values; 0 without values.
fn quantile(at: f64, values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get((values.len() as f64 * at) as usize).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::simulated::Device;

    const QUARTZ: Prior = Prior { skew: 50e-6, comb: Comb::NONE };

    /// The lowest points of bins with these delays [ms].
    fn bins(delay_ms: impl FnMut(i32) -> f64) -> Vec<Point> {
        let delays = (0..1200).map(delay_ms).enumerate();
        delays.map(|(bin, ms)| Point { device: 2.0 * bin as f64, delay: ms / 1e3 }).collect()
    }

    #[test]
    fn under_a_sawtooth_that_passes_within_stretches_lines_are_surer() {
        let mut device = Device::new(1.0);
        let bins = bins(|bin| f64::from(bin % 7 * 7) + device.uniform());
        let (single, stretches) = (Stretches::SINGLE, Stretches::surest(&bins, QUARTZ));
        let [single, longer] = [single, stretches].map(|of| FittedLines::under(&bins, of, QUARTZ));
        assert!(stretches.bins >= 8, "{stretches:?}");
        assert!(3.0 * longer.stated() < single.stated(), "{} {}", longer.stated(), single.stated());
        let height = quantile(0.5, single.heights_above(&longer));
        assert!(stretches.level > 0.01 && height.abs() < 1e-6, "{stretches:?}, {height} s higher");
    }

    #[test]
    fn a_line_over_few_stretches_is_stated_more_widely() {
        let mut device = Device::new(1.0);
        let whole = bins(|_| device.uniform());
        // Only a minute of every six is left.
        let gaps: Vec<Point> =
            whole.iter().copied().filter(|point| point.device % 360.0 < 60.0).collect();
        let fits = |bins: &[Point]| {
            let lines = FittedLines::under(bins, Stretches::SINGLE, QUARTZ);
            lines.lines.iter().map(|(_, fit)| *fit).collect::<Vec<Fit>>()
        };
        let wider = |fit: &Fit| {
            let device = fit.device;
            fit.of_few_stretches(MANY).uncertainty_at(device, device)
                / fit.uncertainty_at(device, device)
        };
        let middle = |fits: &[Fit]| quantile(0.5, fits.iter().map(wider));
        let (few, many) = (middle(&fits(&gaps)), middle(&fits(&whole)));
        assert!(few > 1.05 && many < 1.02, "{few}, {many}");
    }

    #[test]
    fn where_longer_stretches_are_no_surer_each_bin_counts() {
        let mut device = Device::new(1.0);
        let bins = bins(|_| (0..12).map(|_| device.uniform()).sum());
        assert_eq!(Stretches::surest(&bins, QUARTZ).bins, 1);
    }
}
