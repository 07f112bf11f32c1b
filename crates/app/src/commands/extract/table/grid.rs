//! Finds the even times of samples behind the uneven stamps of their rows; even stamps are kept, also where their rate
//! changes.

use super::sampling::Sampling;

/// The share of a row's deviation by which the line of times is corrected: clocks drift slowly.
const TRACKING: f64 = 1e-3;
/// The time of a row differs from its place on the line by at most this much [periods]: a step between two such rows is
/// never so long that a sample would count as missing.
const KEPT: f64 = 0.2;
/// If a stamp and those after it are this far from the line [periods], rows are missing or there are too many.
const ASTRAY: f64 = 0.5;
/// Stamps with less jitter than this are trusted one by one [periods].
const CLEAN: f64 = 0.1;
/// The number of rows that must agree on a gap, at least and at most.
const AGREEING: (f64, f64) = (3.0, 256.0);
/// A gap longer than this starts another line, with its own phase [periods].
const SAME_LINE: f64 = 3.0;
/// A single stamp further from the line than this is a wrong time, not jitter [ns].
const WRONG_NS: f64 = 1.5e9;

/// Places rows on a line of even times. Jitter and rounding of the stamps do not move a row; a gap does, if the stamps
/// after it agree.
#[derive(Clone, Debug)]
pub struct Grid {
    sampling: Sampling,
    period_ns: f64,
    /// The first stamp, from which all other times are counted [ns].
    origin_ns: i64,
    /// The place of the last row on the line [ns].
    line_ns: Option<f64>,
    /// The place of the first row on the line [ns], which is subtracted so that the first sample has the time of the
    /// first stamp.
    ahead_ns: f64,
    latest_ns: f64,
}

/// The place of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// The time of its sample [ns].
    pub at_ns: i64,
    /// The time since the row before it [periods].
    pub steps: f64,
    /// Whether the row starts another line.
    pub is_apart: bool,
}

impl Grid {
    /// Starts a line for rows with this sampling.
    pub fn new(sampling: Sampling) -> Grid {
        let period_ns = 1e9 / sampling.rate_hz;
        Grid { sampling, period_ns, origin_ns: 0, line_ns: None, ahead_ns: 0.0, latest_ns: 0.0 }
    }

    /// The number of following stamps that are needed to place the row with this stamp [ns].
    pub fn needs(&self, stamp_ns: i64) -> usize {
        let count = self.agreeing();
        match self.line_ns {
            None if self.sampling.jitter < CLEAN && self.sampling.shared <= 1.0 => 0,
            None => count,
            Some(line_ns) if self.deviation(stamp_ns, line_ns).abs() > self.usual() => count,
            Some(_) => 0,
        }
    }

    /// Places a row without a stamp one period after the last row [ns].
    pub fn after_last(&mut self) -> Option<i64> {
        let line_ns = self.line_ns.as_mut()?;
        *line_ns += self.period_ns;
        let line_ns = *line_ns;
        Some(self.absolute(line_ns))
    }

    /// Places the row with this stamp, given the stamps of the rows after it [ns].
    pub fn place(&mut self, stamp_ns: i64, following_ns: &[i64]) -> Placed {
        let Some(last_ns) = self.line_ns else { return self.begin(stamp_ns, following_ns) };
        let own = self.deviation(stamp_ns, last_ns);
        let since_ns = stamp_ns.saturating_sub(self.origin_ns) as f64;
        let is_latest = since_ns > self.latest_ns;
        let mut line_ns = last_ns + self.period_ns;
        let mut is_kept = false;
        if self.sampling.is_even && own.abs() < ASTRAY {
            self.latest_ns = self.latest_ns.max(since_ns);
            self.line_ns = Some(since_ns);
            return Placed { at_ns: stamp_ns, steps: 1.0 + own, is_apart: false };
        }
        if own.abs() <= self.usual() {
            line_ns += TRACKING * own * self.period_ns;
        } else {
            let common = self.common(stamp_ns, following_ns, last_ns);
            let enough = ASTRAY + 0.25 * self.coarse();
            if own > 0.0 && common > enough {
                let gap = if common < SAME_LINE { common.round().max(1.0) } else { common };
                line_ns += gap * self.period_ns;
            } else if own < 0.0 && common < -enough {
                // Rows come faster than the rate, or their clock was set back.
                is_kept = true;
                line_ns = if is_latest { since_ns } else { last_ns };
            } else {
                is_kept = own.abs() * self.period_ns > WRONG_NS;
            }
        }
        self.latest_ns = self.latest_ns.max(since_ns);
        self.line_ns = Some(line_ns);
        let steps = (line_ns - last_ns) / self.period_ns;
        let at_ns = if is_kept { stamp_ns } else { self.near(since_ns, line_ns) };
        Placed { at_ns, steps, is_apart: is_kept || steps > SAME_LINE }
    }

    fn begin(&mut self, stamp_ns: i64, following_ns: &[i64]) -> Placed {
        self.origin_ns = stamp_ns;
        let even = if self.sampling.is_even { 0.0 } else { 1.0 };
        let common = even * self.common(stamp_ns, following_ns, -self.period_ns);
        let line_ns = common.clamp(-self.usual(), self.usual()) * self.period_ns;
        self.line_ns = Some(line_ns);
        self.ahead_ns = line_ns;
        Placed { at_ns: stamp_ns, steps: 0.0, is_apart: true }
    }

    /// The time of a row: its stamp, limited to within [`KEPT`] of its place on the line; that place if rows share
    /// stamps.
    fn near(&self, since_ns: f64, line_ns: f64) -> i64 {
        if self.sampling.shared > 1.0 {
            return self.absolute(line_ns);
        }
        let (kept_ns, even_ns) = (KEPT * self.period_ns, line_ns - self.ahead_ns);
        let near_ns = since_ns.clamp(even_ns - kept_ns, even_ns + kept_ns);
        self.origin_ns.saturating_add(near_ns.round() as i64)
    }

    fn absolute(&self, line_ns: f64) -> i64 {
        self.origin_ns.saturating_add((line_ns - self.ahead_ns).round() as i64)
    }

    /// How far a stamp lies after the place that follows the last one [periods].
    fn deviation(&self, stamp_ns: i64, last_ns: f64) -> f64 {
        let since_ns = stamp_ns.saturating_sub(self.origin_ns) as f64;
        (since_ns - last_ns) / self.period_ns - 1.0
    }

    /// The deviation that a row and those after it have in common [periods]: for clean stamps, the one closest to the
    /// line, so that other gaps among them do not count; otherwise their mean up to the next gap.
    fn common(&self, stamp_ns: i64, following_ns: &[i64], last_ns: f64) -> f64 {
        let own = self.deviation(stamp_ns, last_ns);
        let count = self.agreeing() - 1;
        let following = following_ns.iter().take(count).enumerate();
        let deviations = following
            .map(|(place, stamp_ns)| self.deviation(*stamp_ns, last_ns) - (place + 1) as f64);
        if self.sampling.jitter < CLEAN && self.sampling.shared <= 1.0 {
            let closest = |a: f64, b: f64| if b.abs() < a.abs() { b } else { a };
            return deviations.fold(own, closest);
        }
        let far = 2.0 * self.usual() + 6.0 * self.sampling.jitter;
        let (mut sum, mut count, mut last) = (own, 1.0, own);
        for deviation in deviations.take_while(|deviation| {
            let is_near = (deviation - last).abs() < far;
            last = *deviation;
            is_near
        }) {
            sum += deviation;
            count += 1.0;
        }
        sum / count
    }

    /// The largest deviation that is treated as jitter [periods].
    fn usual(&self) -> f64 {
        ASTRAY + 0.5 * self.coarse()
    }

    /// The range over which the stamps of even times are rounded [periods]: the unit of the stamps, unless even times
    /// are multiples of it.
    fn coarse(&self) -> f64 {
        let Sampling { shared, unit, jitter, .. } = self.sampling;
        // Numbers spread evenly over a range have a standard deviation of its length divided by the root of 12.
        if shared > 1.0 { shared } else { unit.min(12.0_f64.sqrt() * jitter) }
    }

    fn agreeing(&self) -> usize {
        let of_jitter = (10.0 * self.sampling.jitter).powi(2);
        let count = of_jitter.max(4.0 * self.coarse());
        count.clamp(AGREEING.0, AGREEING.1).ceil() as usize
    }
}
