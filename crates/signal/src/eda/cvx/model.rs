//! The model of a skin conductance in cvxEDA, as sums over samples.

use std::ops::Range;

use super::{FAST_SECS, KNOT_SECS, SLOW_SECS};

/// The number of coefficients of the level at a sample: four splines and the two of a line.
pub(super) const LEVEL: usize = 6;
/// The moving-average part of the discretised Bateman function.
pub(super) const AVERAGE: [f64; 3] = [1.0, 2.0, 1.0];

/// The Bateman function as a filter, cubic splines on equidistant knots, and a line.
///
/// Block b holds the samples from knot b up to the next one, which splines b − 1 to b + 2 overlap.
pub(super) struct Model {
    /// The coefficients that give the driver from the newest three filter states, newest first.
    pub(super) driver: [f64; 3],
    /// The number of samples.
    pub(super) count: usize,
    /// The number of samples between knots.
    knot: usize,
    /// The values of the four splines at each sample of a block.
    splines: Vec<[f64; 4]>,
}

/// The unknowns of the optimisation.
#[derive(Clone)]
pub(super) struct Unknowns {
    /// The state of the Bateman filter at each sample.
    pub(super) states: Vec<f64>,
    /// The coefficient of each spline.
    pub(super) splines: Vec<f64>,
    /// The offset and the total rise of the line.
    pub(super) line: [f64; 2],
}

impl Unknowns {
    /// The coefficients of a block's four splines and of the line.
    pub(super) fn level(&self, block: usize) -> [f64; LEVEL] {
        let spline = |k: usize| block.checked_add(k)?.checked_sub(1);
        let height = |k: usize| spline(k).and_then(|k| self.splines.get(k)).copied().unwrap_or(0.0);
        [height(0), height(1), height(2), height(3), self.line[0], self.line[1]]
    }
}

impl Model {
    /// The model of `count` samples at `rate_hz` [Hz], which must be at least 1 Hz.
    pub(super) fn new(count: usize, rate_hz: f64) -> Model {
        let step_secs = 1.0 / rate_hz;
        let (fast, slow) = (step_secs / FAST_SECS, step_secs / SLOW_SECS);
        let scale = (fast - slow) * step_secs;
        let driver = [
            (fast + 2.0) * (slow + 2.0) / scale,
            (2.0 * fast * slow - 8.0) / scale,
            (fast - 2.0) * (slow - 2.0) / scale,
        ];
        let knot = ((KNOT_SECS * rate_hz).round_ties_even() as usize).max(2);
        Model { driver, count, knot, splines: splines(knot) }
    }

    /// The number of blocks, which is also the number of splines.
    pub(super) fn blocks(&self) -> usize {
        self.count.div_ceil(self.knot)
    }

    /// The samples of a block.
    pub(super) fn samples(&self, block: usize) -> Range<usize> {
        block * self.knot..((block + 1) * self.knot).min(self.count)
    }

    /// The weights of the level's coefficients at a sample of a block.
    pub(super) fn level_weights(&self, block: usize, sample: usize) -> [f64; LEVEL] {
        let [a, b, c, d] = self.splines[sample - block * self.knot];
        let exists = |k: usize| f64::from(u8::from(block + k >= 1 && block + k <= self.blocks()));
        let line = (sample + 1) as f64 / self.count as f64;
        [a * exists(0), b, c * exists(2), d * exists(3), 1.0, line]
    }

    /// All unknowns at zero.
    pub(super) fn zeros(&self) -> Unknowns {
        let splines = vec![0.0; self.blocks()];
        Unknowns { states: vec![0.0; self.count], splines, line: [0.0; 2] }
    }

    /// The driver of each sample; undefined for the first two.
    pub(super) fn drivers(&self, states: &[f64], drivers: &mut [f64]) {
        filtered(states, self.driver, drivers);
    }

    /// The phasic part at each sample; undefined for the first two.
    pub(super) fn responses(states: &[f64], responses: &mut [f64]) {
        filtered(states, AVERAGE, responses);
    }

    /// The tonic part at each sample.
    pub(super) fn levels(&self, unknowns: &Unknowns, levels: &mut [f64]) {
        for block in 0..self.blocks() {
            let heights = unknowns.level(block);
            for sample in self.samples(block) {
                let weights = self.level_weights(block, sample);
                levels[sample] = weights.iter().zip(heights).map(|(w, h)| w * h).sum();
            }
        }
    }

    /// The transpose of [`levels`](Self::levels): the weighted sums of values for each coefficient.
    pub(super) fn level_sums(&self, values: &[f64], sums: &mut Unknowns) {
        sums.splines.fill(0.0);
        sums.line = [0.0; 2];
        for block in 0..self.blocks() {
            let mut here = [0.0; LEVEL];
            for sample in self.samples(block) {
                let weights = self.level_weights(block, sample);
                here.iter_mut().zip(weights).for_each(|(sum, w)| *sum += w * values[sample]);
            }
            for (k, sum) in here[..4].iter().enumerate() {
                let spline = (block + k).checked_sub(1);
                if let Some(spline) = spline.and_then(|spline| sums.splines.get_mut(spline)) {
                    *spline += sum;
                }
            }
            sums.line[0] += here[4];
            sums.line[1] += here[5];
        }
    }
}

fn filtered(values: &[f64], [now, before, earlier]: [f64; 3], filtered: &mut [f64]) {
    for (out, window) in filtered.iter_mut().skip(2).zip(values.windows(3)) {
        *out = now * window[2] + before * window[1] + earlier * window[0];
    }
}

/// The values of four splines at the samples of a block: those of the previous knot, of the block's own knot and of the
/// next two. A spline is a triangle convolved with itself, with a peak of 1.
fn splines(knot: usize) -> Vec<[f64; 4]> {
    let knots = vec![1.0; knot];
    let folded = (0..3).fold(knots, |box_spline, _| moving_sums(&box_spline, knot));
    let peak = folded.len() / 2;
    let value = |at: i64| {
        let place = peak + at.unsigned_abs() as usize;
        folded.get(place).map_or(0.0, |height| height / folded[peak])
    };
    let knot = knot as i64;
    (0..knot).map(|at| [at + knot, at, at - knot, at - 2 * knot].map(value)).collect()
}

/// The full convolution of values with `length` ones.
fn moving_sums(values: &[f64], length: usize) -> Vec<f64> {
    let mut sum = 0.0;
    let sum_at = |place: usize| {
        sum += values.get(place).copied().unwrap_or(0.0);
        sum -= place.checked_sub(length).map_or(0.0, |left| values[left]);
        sum
    };
    (0..values.len() + length - 1).map(sum_at).collect()
}
