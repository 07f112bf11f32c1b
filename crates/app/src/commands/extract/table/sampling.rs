//! The rate of samples, from the stamps of their rows.

use super::grid::Grid;

/// How the rows of a table are sampled, and how exact their stamps are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Samples a second [Hz].
    pub rate_hz: f64,
    /// The standard deviation of the stamps from even times [periods].
    pub jitter: f64,
    /// The number of rows that share a stamp; 1 where each has its own.
    pub shared: f64,
    /// The unit of the stamps [periods].
    pub unit: f64,
    /// Whether nearly all steps between stamps are about a period long, or so long that rows are missing.
    pub is_even: bool,
}

/// Stamps are coarse if more than this share of rows has the stamp of the row before.
const SHARED: f64 = 0.25;
/// Rows that share a stamp are spread evenly if there are more stamps than this, and rows deviate from an even line by
/// less than this share of the time between two stamps.
const FEWEST_TIMES: f64 = 10.0;
const STEADY: f64 = 0.5;
/// A step longer than this many usual steps ends a segment.
const GAP: f64 = 2.5;
/// The share of steps that are no longer than a usual step.
const USUAL: f64 = 0.9;
/// The numbers of rows that a span may have; the longest spans that occur often enough are compared.
const SPANS: [usize; 4] = [64, 16, 4, 1];
/// The span from which the jitter is estimated [rows].
const SHORT_SPAN: usize = 8;
/// The most rows in which a period is searched from which some rows are missing, and the rows of a block.
const SEARCHED: usize = 4096;
const BLOCK: usize = 256;
/// The minimum coherence of stamps with a period, from 0 to 1, at which the period is trusted.
const COHERENT: f64 = 0.25;
/// The largest share of steps that may deviate from the period, by at least the second share of it, in even stamps; at
/// a given rate, stamps stay even if it differs from their own by less than the third share.
const UNEVEN: f64 = 0.01;
const EVEN_STEP: f64 = 0.5;
const SAME_RATE: f64 = 0.05;
/// The rate is rounded to a whole number if that changes it by less than this share, and by less than half a sample
/// over all rows.
const WHOLE: f64 = 1e-3;

impl Sampling {
    /// Sampling at a known rate [Hz], without stamps.
    pub fn even(rate_hz: f64) -> Sampling {
        Sampling { rate_hz, jitter: 0.0, shared: 1.0, unit: 0.0, is_even: false }
    }

    /// Estimates the sampling of rows with these stamps [ns]; `None` if they never increase.
    ///
    /// Between gaps, the rate follows from the duration of spans of many rows: rounding and jitter of single stamps
    /// hardly change it. Where such spans vary more than short ones, single rows are missing, and the period is the one
    /// of which all steps are multiples. A line through all rows then refines it.
    pub fn of(stamps_ns: &[i64]) -> Option<Sampling> {
        let stamps = Stamps::new(stamps_ns)?;
        let mut sampling = stamps.estimated();
        for _ in 0..2 {
            sampling = refined(stamps_ns, sampling);
        }
        let whole_hz = sampling.rate_hz.round();
        let off = (sampling.rate_hz / whole_hz - 1.0).abs();
        let is_whole = whole_hz > 0.0 && off < WHOLE && off * (stamps_ns.len() as f64) < 0.5;
        let sampling = if is_whole { Sampling { rate_hz: whole_hz, ..sampling } } else { sampling };
        Some(Sampling { is_even: sampling.shared <= 1.0 && stamps.are_even(sampling), ..sampling })
    }

    /// Whether rows that share stamps arrive steadily: they have several different stamps, and none deviates from its
    /// stamp by as much as half the time to the next.
    pub fn is_steady(&self, rows: usize) -> bool {
        let times = rows as f64 / self.shared;
        self.jitter < STEADY * self.shared && times > FEWEST_TIMES
    }

    /// Returns a note on rows that share the times in a column.
    pub fn note(&self, column: &str) -> Option<String> {
        (self.shared > 1.0).then(|| {
            format!(
                "several rows share each time in column {column}: they are spread evenly from that time on, at {} Hz",
                (self.rate_hz * 1e3).round() / 1e3
            )
        })
    }

    /// Estimates the sampling of rows with these stamps [ns] at another rate [Hz].
    pub fn at(stamps_ns: &[i64], rate_hz: f64) -> Sampling {
        match Sampling::of(stamps_ns) {
            Some(own) => {
                let periods = rate_hz / own.rate_hz;
                let is_shared = own.shared > 1.0;
                let shared = if is_shared { own.shared * periods } else { 1.0 };
                let (jitter, unit) = (own.jitter * periods, own.unit * periods);
                let is_even = own.is_even && (periods - 1.0).abs() < SAME_RATE;
                Sampling { rate_hz, jitter, shared, unit, is_even }
            }
            None => Sampling::even(rate_hz),
        }
    }
}

/// Stamps, split at gaps into segments.
struct Stamps<'a> {
    segments: Vec<&'a [i64]>,
    /// The median of the usual positive steps, and the share of all steps that are zero.
    usual_step_ns: f64,
    shared: f64,
    rows: usize,
}

impl Stamps<'_> {
    fn new(stamps_ns: &[i64]) -> Option<Stamps<'_>> {
        let step_ns = |pair: &[i64]| pair[1].saturating_sub(pair[0]);
        let mut steps_ns: Vec<i64> =
            stamps_ns.windows(2).map(step_ns).filter(|step_ns| *step_ns > 0).collect();
        steps_ns.sort_unstable();
        let last = steps_ns.len().checked_sub(1)?;
        let usual_ns = steps_ns[(last as f64 * USUAL) as usize];
        let gap_ns = (usual_ns as f64 * GAP) as i64;
        let is_together =
            |a: &i64, b: &i64| b.saturating_sub(*a) <= gap_ns && a.saturating_sub(*b) <= gap_ns;
        let zeros = stamps_ns.windows(2).filter(|pair| pair[0] == pair[1]).count();
        Some(Stamps {
            segments: stamps_ns.chunk_by(is_together).collect(),
            usual_step_ns: steps_ns[steps_ns.len() / 2] as f64,
            shared: zeros as f64 / (stamps_ns.len() - 1) as f64,
            rows: stamps_ns.len(),
        })
    }

    /// Returns the durations of all spans of this many steps [ns], sorted.
    fn spans_ns(&self, steps: usize) -> Vec<f64> {
        let in_segment = |segment: &&[i64]| {
            let ends = segment.iter().skip(steps).copied();
            ends.zip(segment.iter().copied()).collect::<Vec<_>>()
        };
        let spans = self.segments.iter().flat_map(in_segment);
        let mut spans_ns: Vec<f64> =
            spans.map(|(end_ns, begin_ns)| end_ns.saturating_sub(begin_ns) as f64).collect();
        spans_ns.sort_unstable_by(f64::total_cmp);
        spans_ns
    }

    /// Whether only few steps within segments differ from a period by half a period or more.
    fn are_even(&self, sampling: Sampling) -> bool {
        let steps = self.segments.iter().flat_map(|segment| segment.windows(2));
        let periods =
            |pair: &[i64]| pair[1].saturating_sub(pair[0]) as f64 * sampling.rate_hz / 1e9;
        let uneven = steps.filter(|pair| (periods(pair) - 1.0).abs() >= EVEN_STEP).count();
        uneven as f64 <= UNEVEN * self.rows as f64
    }

    fn estimated(&self) -> Sampling {
        let spans = SPANS.iter().map(|steps| (*steps, self.spans_ns(*steps)));
        let enough =
            |(steps, spans): &(usize, Vec<f64>)| *steps == 1 || 4 * spans.len() >= self.rows;
        let (steps, spans_ns) = { spans }.find(enough).unwrap_or((1, vec![self.usual_step_ns]));
        let usual_ns = self.usual_span_ns(&spans_ns, steps) / steps as f64;
        let period_ns = if usual_ns > 0.0 { usual_ns } else { self.usual_step_ns };
        let shared = (self.usual_step_ns / period_ns).max(1.0);
        let shared = if self.shared > SHARED { shared } else { 1.0 };
        let variance = |spans_ns: &[f64]| variance(spans_ns) / (period_ns * period_ns);
        let short = variance(&self.spans_ns(SHORT_SPAN.min(steps)));
        let (jitter, unit) = ((0.5 * short).sqrt(), self.unit_ns() / period_ns);
        let sampling = Sampling { rate_hz: 1e9 / period_ns, jitter, shared, unit, is_even: false };
        let grown = variance(&spans_ns) - short;
        if shared > 1.0 || steps < SPANS[0] || grown < 0.1 + 0.5 * short {
            return sampling;
        }
        // The number of missing rows in a span varies with a standard deviation of its square root.
        let missing = grown / (steps - SHORT_SPAN) as f64;
        self.with_missing(sampling, missing)
    }

    /// The mean of the spans close to the median [ns]: close enough for the next unit of the stamps to count, but not
    /// for a missing row.
    fn usual_span_ns(&self, spans_ns: &[f64], steps: usize) -> f64 {
        let median_ns = spans_ns.get(spans_ns.len() / 2).copied().unwrap_or(0.0);
        let unit_ns = if self.shared > 0.0 { 1.01 * self.usual_step_ns } else { 0.0 };
        let near_ns = unit_ns.max(0.75 * median_ns / steps as f64);
        let near = spans_ns.iter().filter(|span_ns| (**span_ns - median_ns).abs() <= near_ns);
        let (sum_ns, count) = near.fold((0.0, 0.0), |(sum, count), each| (sum + each, count + 1.0));
        if count > 0.0 { sum_ns / count } else { median_ns }
    }

    /// Corrects the sampling where single rows are missing.
    fn with_missing(&self, seen: Sampling, missing: f64) -> Sampling {
        let (coherence, period_ns) = self.coherent(1e9 / seen.rate_hz);
        if coherence > COHERENT {
            let jitter = (-2.0 * coherence.min(1.0).ln()).max(0.0).sqrt() / std::f64::consts::TAU;
            return Sampling { rate_hz: 1e9 / period_ns, jitter, ..seen };
        }
        let spans_ns = self.spans_ns(SPANS[0]);
        let mean_ns = spans_ns.iter().sum::<f64>() / (spans_ns.len() * SPANS[0]) as f64;
        if mean_ns <= 0.0 {
            // The clock was set back again and again.
            return seen;
        }
        let steps_ns = self.spans_ns(1);
        let long = steps_ns.iter().filter(|step_ns| **step_ns > 1.4 * mean_ns).count();
        let missing = missing.min(long as f64 / steps_ns.len() as f64);
        Sampling { rate_hz: 1e9 * (1.0 + missing) / mean_ns, ..seen }
    }

    /// Finds the longest period up to this one [ns] that fits the stamps, which are multiples of it; returns their
    /// coherence and the period.
    fn coherent(&self, longest_ns: f64) -> (f64, f64) {
        let blocks: Vec<&[i64]> = {
            let blocks = self.segments.iter().flat_map(|segment| segment.chunks(BLOCK));
            let mut rows = 0;
            let until = blocks.take_while(|block| {
                rows += block.len();
                rows <= SEARCHED
            });
            until.filter(|block| block.len() >= BLOCK / 4).collect()
        };
        let rows: usize = blocks.iter().map(|block| block.len()).sum();
        let coherence = |period_ns: f64| {
            let of = |block: &&[i64]| phase_sum(block, period_ns);
            blocks.iter().map(of).sum::<f64>() / rows.max(1) as f64
        };
        let per_sample = 0.25 / BLOCK as f64;
        let count = (0.8 / per_sample) as usize;
        let tried = (0..count).map(|each| {
            let period_ns = longest_ns * 1.01 / (1.0 + each as f64 * per_sample * 1.5);
            (coherence(period_ns), period_ns)
        });
        let unit_ns = self.unit_ns();
        let is_usual = (self.usual_step_ns / unit_ns - 1.0).abs() < 0.01 && unit_ns < longest_ns;
        let is_of_unit = |period_ns: f64| {
            let number = (unit_ns / period_ns).round();
            let is_part = number > 0.5 && (unit_ns / period_ns - number).abs() < 0.05;
            is_part && !(is_usual && number < 1.5)
        };
        let tried: Vec<(f64, f64)> =
            tried.filter(|(_, period_ns)| !is_of_unit(*period_ns)).collect();
        let best = tried.iter().map(|(coherence, _)| *coherence).fold(0.0, f64::max);
        let first = tried.iter().position(|(coherence, _)| *coherence >= 0.85 * best);
        // The first value near a peak; the top of the peak follows.
        let peak = first.map_or(&[][..], |first| &tried[first..(first + 4).min(tried.len())]);
        peak.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, longest_ns))
    }

    /// The unit of the stamps [ns]: all steps are multiples of it.
    fn unit_ns(&self) -> f64 {
        let steps = self.segments.iter().flat_map(|segment| segment.windows(2));
        let steps_ns = steps.map(|pair| pair[1].abs_diff(pair[0]));
        steps_ns.fold(0, greatest_common_divisor) as f64
    }
}

fn greatest_common_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

/// The magnitude of the sum of unit vectors with the stamps' phases within a period.
fn phase_sum(stamps_ns: &[i64], period_ns: f64) -> f64 {
    let phases = stamps_ns.iter().map(|stamp_ns| {
        let since_ns = stamp_ns.saturating_sub(stamps_ns[0]) as f64;
        (std::f64::consts::TAU * since_ns / period_ns).sin_cos()
    });
    let (sin, cos) = phases.fold((0.0, 0.0), |sum, (sin, cos)| (sum.0 + sin, sum.1 + cos));
    f64::hypot(sin, cos)
}

/// The variance of numbers around their mean.
fn variance(numbers: &[f64]) -> f64 {
    let count = numbers.len().max(1) as f64;
    let mean = numbers.iter().sum::<f64>() / count;
    numbers.iter().map(|number| (number - mean).powi(2)).sum::<f64>() / count
}

/// Refines the rate by lines through the places of all rows, and the jitter by the deviations from these lines.
fn refined(stamps_ns: &[i64], sampling: Sampling) -> Sampling {
    let mut grid = Grid::new(sampling);
    let (mut lines, mut place) = (vec![RegressionLine::default()], 0.0);
    for (row, &stamp_ns) in stamps_ns.iter().enumerate() {
        let following = &stamps_ns[row + 1..];
        let placed = grid.place(stamp_ns, &following[..following.len().min(256)]);
        if placed.is_apart {
            lines.push(RegressionLine::default());
            place = 0.0;
        }
        place += placed.steps.round().max(0.0);
        let line = lines.last_mut().expect("there is one from the start");
        line.take(place, stamp_ns);
    }
    let sum = |of: fn(&RegressionLine) -> f64| lines.iter().map(of).sum::<f64>();
    let (places, both, stamps, rows) = (
        sum(RegressionLine::of_places),
        sum(RegressionLine::of_both),
        sum(RegressionLine::of_stamps),
        sum(|line| line.rows),
    );
    if places <= 0.0 || both <= 0.0 {
        return sampling;
    }
    let period_ns = both / places;
    let left_ns2 = (stamps - both * period_ns).max(0.0) / rows.max(1.0);
    Sampling { rate_hz: 1e9 / period_ns, jitter: left_ns2.sqrt() / period_ns, ..sampling }
}

/// Running sums for the regression of stamps on places.
#[derive(Default)]
struct RegressionLine {
    rows: f64,
    first_ns: i64,
    place: f64,
    stamp: f64,
    place2: f64,
    both: f64,
    stamp2: f64,
}

impl RegressionLine {
    fn take(&mut self, place: f64, stamp_ns: i64) {
        if self.rows < 0.5 {
            self.first_ns = stamp_ns;
        }
        let stamp = stamp_ns.saturating_sub(self.first_ns) as f64;
        self.rows += 1.0;
        // Running means by Welford's method: sums of squares of large numbers would be inexact.
        let (off_place, off_stamp) = (place - self.place, stamp - self.stamp);
        self.place += off_place / self.rows;
        self.stamp += off_stamp / self.rows;
        self.place2 += off_place * (place - self.place);
        self.both += off_place * (stamp - self.stamp);
        self.stamp2 += off_stamp * (stamp - self.stamp);
    }

    fn of_places(&self) -> f64 {
        self.place2
    }

    fn of_both(&self) -> f64 {
        self.both
    }

    fn of_stamps(&self) -> f64 {
        self.stamp2
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Numbers from 0 to 1 that look random.
    fn shuffled(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    /// How rows are stamped.
    #[derive(Clone, Copy, Debug)]
    struct Stamped {
        /// Rows a second [Hz].
        hz: f64,
        /// The resolution of stamps [s]; 0 for nanoseconds.
        unit_secs: f64,
        /// The standard deviation of their jitter [periods].
        jitter: f64,
        /// The share of rows that is missing.
        missing: f64,
        /// A pause after each this many rows, of 2.77 s; 0 for none.
        pause: usize,
    }

    const EVEN: Stamped =
        Stamped { hz: 250.0, unit_secs: 0.0, jitter: 0.0, missing: 0.0, pause: 0 };

    impl Stamped {
        /// Each row's number, counted in periods, and its stamp [ns].
        fn rows(self, count: usize) -> Vec<(f64, i64)> {
            let mut random = shuffled(7);
            let row = |row: usize| {
                let pause_secs =
                    row.checked_div(self.pause).map_or(0.0, |pauses| pauses as f64 * 2.77);
                let true_secs = row as f64 / self.hz + pause_secs;
                // Twelve numbers have the variance 1.
                let normal = (0..12).map(|_| random()).sum::<f64>() - 6.0;
                let secs = true_secs + normal * self.jitter / self.hz;
                let rounded = match self.unit_secs {
                    unit_secs if unit_secs > 0.0 => (secs / unit_secs).floor() * unit_secs,
                    _ => secs,
                };
                let is_there = random() >= self.missing;
                is_there.then(|| (true_secs * self.hz, (rounded * 1e9).round() as i64))
            };
            (0..count).filter_map(row).collect()
        }

        /// The sampling of its stamps, and the time of each of its rows [periods].
        fn placed(self, count: usize) -> (Sampling, Vec<(f64, f64)>) {
            let rows = self.rows(count);
            let stamps: Vec<i64> = rows.iter().map(|(_, stamp_ns)| *stamp_ns).collect();
            let sampling = Sampling::of(&stamps[..stamps.len().min(20_000)]).unwrap();
            let mut grid = Grid::new(sampling);
            let placed = rows.iter().enumerate().map(|(row, (place, stamp_ns))| {
                let following = &stamps[row + 1..];
                let needed = grid.needs(*stamp_ns).min(following.len());
                let at_ns = grid.place(*stamp_ns, &following[..needed]).at_ns;
                (*place, at_ns as f64 / 1e9 * self.hz)
            });
            let placed = placed.collect();
            (sampling, placed)
        }

        /// The error of the rate, and how many rows too many or too few lie before the last one.
        fn errors(self, count: usize) -> (f64, f64) {
            let (sampling, placed) = self.placed(count);
            let missing = |times: &mut dyn Iterator<Item = f64>| {
                let times: Vec<f64> = times.collect();
                let steps = times.windows(2).map(|pair| pair[1] - pair[0]);
                steps.map(|step| if step > 1.5 { step.round() - 1.0 } else { 0.0 }).sum::<f64>()
            };
            let found = missing(&mut placed.iter().map(|(_, at)| *at));
            let truly = missing(&mut placed.iter().map(|(place, _)| *place));
            ((sampling.rate_hz / self.hz - 1.0).abs(), (found - truly).abs())
        }
    }

    #[test]
    fn a_rounded_stamp_changes_neither_rate_nor_rows() {
        for hz in [50.0, 64.0, 128.0, 249.3, 400.0, 512.0, 1000.0, 2048.0] {
            for unit_secs in [1e-3, 1e-2, 1.0 / 64.0] {
                let (rate, rows) = Stamped { hz, unit_secs, ..EVEN }.errors(20_000);
                assert!(rate < 1e-4 && rows < 0.5, "{hz} Hz in {unit_secs} s: {rate}, {rows}");
            }
        }
    }

    #[test]
    fn jitter_changes_neither_rate_nor_rows() {
        for hz in [4.0, 130.0, 250.0, 1000.0] {
            for jitter in [0.05, 0.25, 0.5] {
                let (rate, rows) = Stamped { hz, jitter, ..EVEN }.errors(20_000);
                assert!(rate < 1e-4 && rows < 0.5, "{hz} Hz with {jitter}: {rate}, {rows}");
            }
        }
    }

    #[test]
    fn missing_rows_and_pauses_are_found_with_and_without_jitter() {
        for (jitter, unit_secs) in [(0.0, 0.0), (0.15, 0.0), (0.0, 1e-3)] {
            for (missing, pause) in [(0.01, 0), (0.0, 3000), (0.01, 5000)] {
                let stamped = Stamped { unit_secs, jitter, missing, pause, ..EVEN };
                let (rate, rows) = stamped.errors(20_000);
                assert!(rate < 1e-3 && rows < 40.0, "{stamped:?}: {rate}, {rows}");
            }
        }
        let (rate, rows) = Stamped { missing: 0.3, ..EVEN }.errors(10_000);
        assert!(rate < 1e-9 && rows < 0.5, "{rate}, {rows}");
    }

    #[test]
    fn an_hour_does_not_drift() {
        for stamped in [
            Stamped { hz: 512.0, unit_secs: 1e-3, ..EVEN },
            Stamped { hz: 130.0, jitter: 0.26, ..EVEN },
        ] {
            let (_, placed) = stamped.placed((3600.0 * stamped.hz) as usize);
            let furthest = placed.iter().map(|(place, at)| (place - at).abs()).fold(0.0, f64::max);
            assert!(furthest < 1.0, "{stamped:?}: {furthest}");
        }
    }

    #[test]
    fn rows_that_share_a_stamp_are_spread_evenly() {
        let stamps: Vec<i64> = (0..5000).map(|row| row / 25 * 100_000_000).collect();
        let sampling = Sampling::of(&stamps).unwrap();
        assert!(
            (sampling.rate_hz - 250.0).abs() < 1e-9 && sampling.is_steady(5000),
            "{sampling:?}"
        );
        let mut grid = Grid::new(sampling);
        for (row, stamp_ns) in stamps.iter().enumerate() {
            let needed = grid.needs(*stamp_ns).min(stamps.len() - row - 1);
            let at_ns = grid.place(*stamp_ns, &stamps[row + 1..row + 1 + needed]).at_ns;
            assert!((at_ns - row as i64 * 4_000_000).abs() < 4_000_000, "{row}: {at_ns}");
        }
    }

    #[test]
    fn a_few_stamps_give_the_rate_of_the_usual_step() {
        let of = |ms: &[i64]| {
            let stamps: Vec<i64> = ms.iter().map(|ms| ms * 1_000_000).collect();
            Sampling::of(&stamps).map(|sampling| sampling.rate_hz)
        };
        let close = |hz: Option<f64>, wanted_hz: f64| {
            hz.is_some_and(|hz| (hz / wanted_hz - 1.0).abs() < 1e-9)
        };
        assert!(close(of(&[0, 16, 31, 47, 62, 5000]), 4.0 / 0.062));
        assert!(close(of(&[0, 250, 500, 10_000]), 4.0));
        assert_eq!(of(&[1]), None);
        assert_eq!(of(&[1, 1]), None);
    }

    proptest! {
        #[test]
        fn any_stamps_are_placed_without_a_panic(stamps in prop::collection::vec(any::<i64>(), 0..300)) {
            if let Some(sampling) = Sampling::of(&stamps) {
                let mut grid = Grid::new(sampling);
                for (row, stamp_ns) in stamps.iter().enumerate() {
                    grid.place(*stamp_ns, &stamps[row + 1..]);
                }
            }
        }
    }
}
