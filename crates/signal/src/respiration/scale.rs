//! The usual range of a signal.

use crate::error::SignalError;
use crate::robust::median;
use crate::sliding::{SlidingExtremes, SlidingQuantiles};

/// The threshold of a turning point, as a share of the usual range.
const TURN_SHARE: f64 = 0.25;
/// The time over which the range of the middle 80 % is taken [s].
const RANGE_SECS: f64 = 30.0;
const RANGE_SHARES: (f64, f64) = (0.1, 0.9);
/// The time after which the range is known [s].
const LEARNING_SECS: f64 = 5.0;
/// The rate at which the range is updated [Hz].
const STEPS_HZ: f64 = 5.0;
/// The longer time over which the usual range is taken [s].
const USUAL_SECS: f64 = 300.0;
/// The smallest share of the usual range that the range may shrink to: a pause is not breathing.
const LEAST_SHARE: f64 = 1.0 / 3.0;
/// A range below this share of the largest sample is a rounding error.
const LEAST_RANGE: f64 = 1e-9;

/// The usual range of the newest samples.
#[derive(Clone, Debug)]
pub(super) struct Scale {
    step: usize,
    until_step: usize,
    steps: usize,
    recent: SlidingQuantiles,
    levels: SlidingExtremes,
    usual: SlidingQuantiles,
    threshold: f64,
}

impl Scale {
    pub(super) fn new(rate_hz: f64) -> Result<Scale, SignalError> {
        let window = (RANGE_SECS * STEPS_HZ) as usize;
        Ok(Scale {
            step: (rate_hz / STEPS_HZ).round().max(1.0) as usize,
            until_step: 0,
            steps: 0,
            recent: SlidingQuantiles::new(window)?,
            levels: SlidingExtremes::new(window)?,
            usual: SlidingQuantiles::new(USUAL_SECS as usize)?,
            threshold: f64::INFINITY,
        })
    }

    /// Takes in the next sample, raw and filtered, and returns the threshold of turning points; infinite
    /// while unknown.
    pub(super) fn push(&mut self, raw: f64, filtered: f64) -> f64 {
        if self.until_step > 0 {
            self.until_step -= 1;
            return self.threshold;
        }
        self.until_step = self.step - 1;
        self.recent.push(filtered);
        self.levels.push(raw);
        self.steps += 1;
        if self.steps as f64 >= LEARNING_SECS * STEPS_HZ {
            let range = range(&self.recent);
            if self.steps.is_multiple_of(STEPS_HZ as usize) {
                self.usual.push(range);
            }
            let least = LEAST_SHARE * self.usual.median().unwrap_or(0.0);
            self.threshold = threshold(range.max(least), level(&self.levels));
        }
        self.threshold
    }
}

/// The threshold of turning points at each sample of a whole signal, from the range in the time around it.
pub(super) fn thresholds(
    raw: &[f64],
    filtered: &[f64],
    rate_hz: f64,
) -> Result<Vec<f64>, SignalError> {
    let step = (rate_hz / STEPS_HZ).round().max(1.0) as usize;
    let window = (RANGE_SECS * STEPS_HZ) as usize;
    let mut recent = SlidingQuantiles::new(window)?;
    let beyond = std::iter::repeat_n(f64::NAN, window / 2);
    let ranges = filtered.iter().copied().step_by(step).chain(beyond).map(|sample| {
        recent.push(sample);
        range(&recent)
    });
    let ranges: Vec<f64> = ranges.skip(window / 2).collect();
    let least = LEAST_SHARE * median(&ranges).unwrap_or(0.0);
    let level = raw.iter().fold(0.0f64, |level, sample| level.max(sample.abs()));
    let at = |place: usize| threshold(ranges[place / step].max(least), level);
    Ok((0..filtered.len()).map(at).collect())
}

fn range(values: &SlidingQuantiles) -> f64 {
    let [low, high] = [RANGE_SHARES.0, RANGE_SHARES.1].map(|share| values.quantile(share));
    high.zip(low).map_or(0.0, |(high, low)| high - low)
}

/// The largest absolute sample.
fn level(levels: &SlidingExtremes) -> f64 {
    let [least, greatest] = [levels.least(), levels.greatest()];
    least.map_or(0.0, f64::abs).max(greatest.map_or(0.0, f64::abs))
}

fn threshold(range: f64, level: f64) -> f64 {
    if range > LEAST_RANGE * level { TURN_SHARE * range } else { f64::INFINITY }
}
