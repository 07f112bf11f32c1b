//! The pulse template.

use super::pulses::Shaped;
use super::smoothed::Part;

/// The part of a cycle compared, before and after the peak.
const BEFORE_CYCLES: f64 = 0.4;
const AFTER_CYCLES: f64 = 0.6;
/// The smallest share of the compared part that must be present.
const LEAST_SHARE: f64 = 0.6;
/// The number of pulses in the template; if there are more, every second, third, … is used.
const ENOUGH: usize = 64;
/// Residuals below this share of the squares are rounding errors.
const ROUNDING: f64 = 1e-12;

/// The median pulse of a signal.
pub(super) struct Template {
    before: usize,
    values: Vec<f64>,
    /// The detrended values.
    bare: Vec<f64>,
    squares: f64,
}

impl Template {
    /// The template of pulses `cycle` samples apart; empty when none is complete.
    pub(super) fn of(signal: &Part<'_>, pulses: &[Shaped], cycle: f64) -> Template {
        let before = (BEFORE_CYCLES * cycle).round() as usize;
        let length = before + (AFTER_CYCLES * cycle).round() as usize + 1;
        let step = pulses.len().div_ceil(ENOUGH).max(1);
        let whole = |shaped: &Shaped| {
            let begin = (shaped.pulse.sample.round() as usize).checked_sub(before)?;
            let part = signal.values(begin..begin.saturating_add(length));
            (part.len() == length).then(|| (part, FittedLine::through(part)))
        };
        let some = pulses.iter().filter(|shaped| shaped.number.is_multiple_of(step));
        let parts: Vec<(&[f64], FittedLine)> = some.filter_map(whole).collect();
        let mut column = Vec::with_capacity(parts.len());
        let mut median = |place: usize| {
            column.clear();
            column.extend(parts.iter().map(|(part, line)| line.above(place, part[place])));
            let middle = column.len() / 2;
            *column.select_nth_unstable_by(middle, f64::total_cmp).1
        };
        let length = if parts.is_empty() { 0 } else { length };
        let values: Vec<f64> = (0..length).map(&mut median).collect();
        let line = FittedLine::through(&values);
        let bare = values.iter().enumerate().map(|(place, &value)| line.above(place, value));
        let bare: Vec<f64> = bare.collect();
        Template { before, squares: bare.iter().map(|each| each * each).sum(), bare, values }
    }

    /// The correlation between the template and the pulse that peaks at a sample, both detrended; 0 if too little of
    /// the pulse is present.
    pub(super) fn likeness(&self, signal: &Part<'_>, peak: f64) -> f64 {
        let begin = (peak.round() as i64).saturating_sub(self.before as i64);
        let place = |at: i64| at.max(0) as usize;
        let end = begin.saturating_add(self.values.len() as i64);
        let part = signal.values(place(begin)..place(end));
        if part.len() == self.values.len() {
            return self.likeness_of_whole(part);
        }
        if (part.len() as f64) < LEAST_SHARE * self.values.len() as f64 {
            return 0.0;
        }
        let inside = (signal.begin as i64).saturating_sub(begin).max(0) as usize;
        correlation(part, &self.values[inside..inside + part.len()])
    }

    /// Computed in one pass, as the pulse's line is orthogonal to the detrended template.
    fn likeness_of_whole(&self, part: &[f64]) -> f64 {
        let Some(&level) = part.first() else { return 0.0 };
        let count = part.len() as f64;
        let middle = (count - 1.0) / 2.0;
        let mut sums = [[0.0; LANES]; 4];
        let chunks = part.chunks(LANES).zip(self.bare.chunks(LANES));
        for (chunk, (values, bare)) in chunks.enumerate() {
            let begin = (chunk * LANES) as f64 - middle;
            for (lane, (value, bare)) in values.iter().zip(bare).enumerate() {
                let value = value - level;
                sums[0][lane] += value;
                sums[1][lane] += value * value;
                sums[2][lane] += value * (begin + lane as f64);
                sums[3][lane] += value * bare;
            }
        }
        let [sum, squares, tilt, both] = sums.map(|lanes| lanes.iter().sum::<f64>());
        let line = sum * sum / count + tilt * tilt / spread(count);
        let left = if squares - line > ROUNDING * squares { squares - line } else { 0.0 };
        over(both, left, self.squares)
    }
}

/// The number of values summed in parallel.
const LANES: usize = 8;

/// The least-squares line.
pub(super) struct FittedLine {
    middle: f64,
    mean: f64,
    slope: f64,
}

impl FittedLine {
    pub(super) fn through(values: &[f64]) -> FittedLine {
        let count = values.len() as f64;
        let middle = (count - 1.0) / 2.0;
        let mean = values.iter().sum::<f64>() / count;
        let weighted = values.iter().enumerate().map(|(k, value)| (k as f64 - middle) * value);
        let squares = spread(count);
        let slope = if squares > 0.0 { weighted.sum::<f64>() / squares } else { 0.0 };
        FittedLine { middle, mean, slope }
    }

    pub(super) fn above(&self, place: usize, value: f64) -> f64 {
        value - self.mean - self.slope * (place as f64 - self.middle)
    }
}

fn correlation(left: &[f64], right: &[f64]) -> f64 {
    let (left_line, right_line) = (FittedLine::through(left), FittedLine::through(right));
    let (mut both, mut left_square, mut right_square) = (0.0, 0.0, 0.0);
    for (place, (&left, &right)) in left.iter().zip(right).enumerate() {
        let (left, right) = (left_line.above(place, left), right_line.above(place, right));
        both += left * right;
        left_square += left * left;
        right_square += right * right;
    }
    over(both, left_square, right_square)
}

/// The sum of squared distances of `count` successive indices from their mean.
fn spread(count: f64) -> f64 {
    count * (count * count - 1.0) / 12.0
}

fn over(both: f64, left_square: f64, right_square: f64) -> f64 {
    let scale = (left_square * right_square).sqrt();
    if scale > 0.0 && scale.is_finite() { both / scale } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_look_at_a_pulse_gives_its_likeness() {
        let wave = |k: usize| (k as f64 / 5.0).sin() + (k * k % 13) as f64 / 20.0;
        let values: Vec<f64> = (0..83).map(wave).collect();
        let line = FittedLine::through(&values);
        let bare: Vec<f64> = (0..83).map(|k| line.above(k, values[k])).collect();
        let squares = bare.iter().map(|each| each * each).sum();
        let template = Template { before: 0, bare, values: values.clone(), squares };
        let part: Vec<f64> =
            (0..83).map(|k| 1e4 + 0.3 * k as f64 + wave(k + 1) + wave(3 * k)).collect();
        let likeness = template.likeness_of_whole(&part);
        assert!((likeness - correlation(&part, &values)).abs() < 1e-9, "{likeness}");
        assert_eq!(template.likeness_of_whole(&[7.0; 83]), 0.0);
    }
}
