//! The median pulse.

use std::ops::Range;

use super::pulse::Pulse;

/// The part of a cycle that is compared, before and after the peak.
const BEFORE_CYCLES: f64 = 0.4;
const AFTER_CYCLES: f64 = 0.6;
/// How much of that must be there.
const LEAST_SHARE: f64 = 0.6;

/// The median pulse of a signal.
pub(super) struct Template {
    before: usize,
    values: Vec<f64>,
}

impl Template {
    /// Of pulses that follow each other after `cycle` samples; empty when none is whole.
    pub(super) fn of(signal: &[f64], pulses: &[Pulse], cycle: f64) -> Template {
        let before = (BEFORE_CYCLES * cycle).round() as usize;
        let length = before + (AFTER_CYCLES * cycle).round() as usize + 1;
        let whole = |pulse: &Pulse| {
            let begin = (pulse.sample.round() as usize).checked_sub(before)?;
            let part = signal.get(begin..begin.saturating_add(length))?;
            let line = Line::through(part);
            Some(part.iter().enumerate().map(move |(k, &value)| line.above(k, value)))
        };
        let mut columns: Vec<Vec<f64>> = vec![Vec::with_capacity(pulses.len()); length];
        for part in pulses.iter().filter_map(whole) {
            columns.iter_mut().zip(part).for_each(|(column, value)| column.push(value));
        }
        let median = |column: &mut Vec<f64>| {
            let middle = column.len() / 2;
            (!column.is_empty()).then(|| *column.select_nth_unstable_by(middle, f64::total_cmp).1)
        };
        Template { before, values: columns.iter_mut().filter_map(median).collect() }
    }

    /// How much the pulse with its peak at a sample looks like it: Pearson's correlation of what
    /// straight lines leave of both; 0 when too little of it is there.
    pub(super) fn likeness(&self, signal: &[f64], peak: f64) -> f64 {
        let begin = (peak.round() as i64).saturating_sub(self.before as i64);
        let inside = begin.saturating_neg().max(0) as usize..self.values.len();
        let from = (begin.max(0) as usize).min(signal.len());
        let part = &signal[from..from.saturating_add(inside.len()).min(signal.len())];
        let inside: Range<usize> = inside.start..inside.start + part.len();
        if self.values.is_empty() || (part.len() as f64) < LEAST_SHARE * self.values.len() as f64 {
            return 0.0;
        }
        correlation(part, &self.values[inside])
    }
}

/// The straight line nearest to values.
pub(super) struct Line {
    middle: f64,
    mean: f64,
    slope: f64,
}

impl Line {
    pub(super) fn through(values: &[f64]) -> Line {
        let count = values.len() as f64;
        let middle = (count - 1.0) / 2.0;
        let mean = values.iter().sum::<f64>() / count;
        let weighted = values.iter().enumerate().map(|(k, value)| (k as f64 - middle) * value);
        let squares = count * (count * count - 1.0) / 12.0;
        let slope = if squares > 0.0 { weighted.sum::<f64>() / squares } else { 0.0 };
        Line { middle, mean, slope }
    }

    pub(super) fn above(&self, place: usize, value: f64) -> f64 {
        value - self.mean - self.slope * (place as f64 - self.middle)
    }
}

fn correlation(left: &[f64], right: &[f64]) -> f64 {
    let (left_line, right_line) = (Line::through(left), Line::through(right));
    let (mut both, mut left_square, mut right_square) = (0.0, 0.0, 0.0);
    for (place, (&left, &right)) in left.iter().zip(right).enumerate() {
        let (left, right) = (left_line.above(place, left), right_line.above(place, right));
        both += left * right;
        left_square += left * left;
        right_square += right * right;
    }
    let scale = (left_square * right_square).sqrt();
    if scale > 0.0 && scale.is_finite() { both / scale } else { 0.0 }
}
