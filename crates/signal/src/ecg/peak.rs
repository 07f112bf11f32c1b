//! Locates the main deflection of a QRS complex.

use super::history::History;
use super::kernel::{Kernel, sigma_secs};

/// The frequency at which the main deflection stands out most [Hz].
const DEFLECTION_HZ: f64 = 10.0;
/// The half-width of the kernel [standard deviations of the Gaussian].
const REACH_SIGMAS: f64 = 3.0;
/// The search range around the maximum of the energy [s].
const SEARCH_SECS: f64 = 0.07;
/// A broad complex can have two crests of one deflection, of which the steeper one stands out more when smoothed. Its
/// time is therefore that of the highest sample within this time of the found crest [s].
const CREST_SECS: f64 = 0.06;
/// The highest sample is searched for as long as the signal stays above this share of the crest's height, which is
/// measured from the lower of the two samples `CREST_BASE_SECS` before and after it.
const CREST_SHARE: f64 = 0.8;
/// Another crest must be higher by this share of that height: the edges of a clipped beat have equal heights.
const CREST_GAIN: f64 = 0.05;
const CREST_BASE_SECS: f64 = 0.1;
/// The search range for the highest sample around the maximum of the smoothed deflection [s].
const SNAP_SECS: f64 = 0.012;
/// The distance of the outer points of the parabola that interpolates the peak [s].
const PARABOLA_SECS: f64 = 0.004;
/// The length of the mean in which a peak is located [s]: a period of mains of 50 Hz.
const MEAN_SECS: f64 = 0.02;
/// The factor by which the opposite deflection must be higher in a channel with a clear polarity.
const PREFERENCE: f64 = 1.25;
/// The factor where beats have always been marked on the other side: noise must not switch between two equally high
/// deflections from beat to beat.
const HABIT: f64 = 1.35;
/// The habit applies while the mean logarithm of the ratio of up to down is this close to 0, and its deviation is this
/// small.
const EQUAL: f64 = 0.12;
/// The mean log ratio of up to down at which the polarity is clear.
const CLEAR_DIRECTION: f64 = 0.3;
/// The number of beats over which the polarity is averaged.
const DIRECTION_BEATS: f64 = 16.0;
/// The fewest beats for a clear polarity.
const FIRST_BEATS: f64 = 4.0;

/// The main deflection of a QRS complex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deflection {
    /// The time [samples from the first one].
    pub(super) sample: f64,
    pub(super) upright: bool,
}

/// Locates main deflections; learns the polarity of the channel, because the two deflections of a broad
/// complex can be equally high.
#[derive(Clone, Debug)]
pub(super) struct PeakFinder {
    group: i64,
    kernel: Kernel,
    search: i64,
    crest: usize,
    crest_base: usize,
    snap: i64,
    shoulder: i64,
    /// Half the length of the mean around a sample, without the sample itself [samples].
    mean_reach: f64,
    /// The mean log ratio of upward to downward deflections.
    direction: f64,
    /// The mean side on which beats were marked so far: 1 always upward, −1 always downward.
    habit: f64,
    /// The usual deviation of a beat from the mean log ratio.
    spread: f64,
    usual_strength: f64,
    /// The number of beats over which these are averaged, up to [`DIRECTION_BEATS`].
    learnt_beats: f64,
    heights: Vec<f64>,
}

impl PeakFinder {
    pub(super) fn new(working_hz: f64, group: usize) -> PeakFinder {
        let rate_hz = working_hz * group as f64;
        let half = (REACH_SIGMAS * sigma_secs(2, DEFLECTION_HZ) * working_hz).ceil() as usize;
        let search = (SEARCH_SECS * working_hz).round() as usize;
        PeakFinder {
            group: group as i64,
            kernel: Kernel::even(DEFLECTION_HZ, half, working_hz),
            search: search as i64,
            crest: (CREST_SECS * working_hz) as usize,
            crest_base: (CREST_BASE_SECS * working_hz) as usize,
            snap: (SNAP_SECS * rate_hz).round().max(2.0) as i64,
            shoulder: (PARABOLA_SECS * rate_hz).round().max(1.0) as i64,
            mean_reach: (0.5 * MEAN_SECS * rate_hz - 0.5).max(0.0),
            direction: 0.0,
            habit: 0.0,
            spread: 1.0,
            usual_strength: 0.0,
            learnt_beats: 0.0,
            heights: Vec::with_capacity(2 * search + 1),
        }
    }

    /// The raw-signal position of a position at the working rate: the middle of its group.
    pub(super) fn raw_place(&self, place: i64) -> f64 {
        (place * self.group) as f64 + (self.group - 1) as f64 / 2.0
    }

    pub(super) fn find(
        &mut self,
        place: i64,
        strength: f64,
        working: &History,
        raw: &History,
    ) -> Deflection {
        self.smoothed_deflections(place, working);
        let (up, down) = extremes(&self.heights);
        let ratio = (up.1.max(f64::MIN_POSITIVE) / (-down.1).max(f64::MIN_POSITIVE)).ln();
        let bias = (self.direction / CLEAR_DIRECTION).clamp(-1.0, 1.0) * PREFERENCE.ln();
        let are_equal = self.direction.abs() < EQUAL && self.spread < EQUAL;
        let habit = if are_equal { self.habit * HABIT.ln() } else { 0.0 };
        let upright = ratio + bias + habit >= 0.0;
        self.learn_direction(ratio, upright, strength);
        let peak = place - self.search + if upright { up.0 } else { down.0 } as i64;
        let peak = self.highest_crest(peak, upright, working);
        let begin = self.raw_place(peak).round() as i64;
        Deflection { sample: self.true_peak(begin, upright, raw).max(0.0), upright }
    }

    fn smoothed_deflections(&mut self, place: i64, working: &History) {
        let end = place + self.search + self.kernel.half() as i64 + 1;
        let begin = end - 2 * self.search - self.kernel.length() as i64;
        let around = working.at(begin..end);
        let kernel = &self.kernel;
        self.heights.clear();
        self.heights.extend(around.windows(kernel.length()).map(|part| kernel.apply(part)));
    }

    fn learn_direction(&mut self, ratio: f64, upright: bool, strength: f64) {
        // P and T waves do not update the polarity.
        if strength > self.usual_strength / 2.0 {
            // A plain mean at first, so that the polarity is known after a few beats.
            self.learnt_beats = (self.learnt_beats + 1.0).min(DIRECTION_BEATS);
            let beats = self.learnt_beats;
            self.direction += (ratio.clamp(-1.0, 1.0) - self.direction) / beats.max(FIRST_BEATS);
            let off = (ratio.clamp(-1.0, 1.0) - self.direction).abs();
            self.spread += (off - self.spread) / beats;
            let marked = if upright { 1.0 } else { -1.0 };
            self.habit += (marked - self.habit) / beats;
        }
        let weight = if strength > self.usual_strength { 0.3 } else { 0.03 };
        self.usual_strength += weight * (strength - self.usual_strength);
    }

    /// The highest sample of the deflection around `peak`, at the working rate.
    fn highest_crest(&self, peak: i64, upright: bool, working: &History) -> i64 {
        let (sign, base) = (if upright { 1.0 } else { -1.0 }, self.crest_base);
        let around = working.at(peak - base as i64..peak + base as i64 + 1);
        let [first, .., last] = around else { return peak };
        if around.len() != 2 * base + 1 {
            return peak;
        }
        let floor = (sign * first).min(sign * last);
        let height = sign * around[base] - floor;
        let least = floor + CREST_SHARE * height;
        let is_high = |&place: &usize| sign * around[place] > least;
        let begin = (base - self.crest..base).rev().take_while(is_high).last().unwrap_or(base);
        let end = (base + 1..=base + self.crest).take_while(is_high).last().unwrap_or(base);
        let highest = (begin..=end)
            .max_by(|&a, &b| (sign * around[a]).total_cmp(&(sign * around[b])).then(b.cmp(&a)));
        let is_higher = |&place: &usize| sign * around[place] - floor > (1.0 + CREST_GAIN) * height;
        peak + highest.filter(is_higher).unwrap_or(base) as i64 - base as i64
    }

    /// The nearest extremum of the raw signal, or `begin` without one.
    fn true_peak(&self, begin: i64, upright: bool, raw: &History) -> f64 {
        let sign = if upright { 1.0 } else { -1.0 };
        let level = |place: i64| self.level(place, raw);
        let (first, last) = (begin - self.snap, begin + self.snap);
        let heights = (first..=last).filter_map(|place| Some((sign * level(place)?, place)));
        let highest = heights.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
        let inside = highest.filter(|&(_, place)| place > first && place < last);
        let peak = inside.map_or(begin, |(_, place)| place);
        let beside = (level(peak - self.shoulder), level(peak), level(peak + self.shoulder));
        let (Some(left), Some(middle), Some(right)) = beside else { return peak as f64 };
        let (bend, tilt) = (left - 2.0 * middle + right, left - right);
        let shift = 0.5 * tilt / bend;
        let fits = sign * bend < 0.0 && shift.abs() <= 0.5;
        peak as f64 + if fits { shift * self.shoulder as f64 } else { 0.0 }
    }

    /// The mean of the signal around a sample, over a period of the mains.
    fn level(&self, place: i64, raw: &History) -> Option<f64> {
        let reach = self.mean_reach.floor() as i64;
        let around = raw.at(place - reach - 1..place + reach + 2);
        let [first, inner @ .., last] = around else { return None };
        if around.len() as i64 != 2 * reach + 3 {
            return None;
        }
        let edge = self.mean_reach.fract();
        let sum = inner.iter().sum::<f64>() + edge * (first + last);
        Some(sum / (inner.len() as f64 + 2.0 * edge))
    }
}

/// Index and value of the maximum and the minimum.
fn extremes(values: &[f64]) -> ((usize, f64), (usize, f64)) {
    let first = (values.len() / 2, values.get(values.len() / 2).copied().unwrap_or(0.0));
    values.iter().enumerate().fold((first, first), |(up, down), (index, &value)| {
        let new = (index, value);
        (if value > up.1 { new } else { up }, if value < down.1 { new } else { down })
    })
}
