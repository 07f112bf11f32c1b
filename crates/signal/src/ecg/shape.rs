//! The waveform of a candidate, independent of its amplitude.

use super::history::History;

/// The range of the waveform before and after the main deflection [s], and its number of points, 5 ms apart.
const REACH_SECS: f64 = 0.08;
const PLACES: usize = 33;

/// The ECG around a deflection, detrended and of unit norm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape([f32; PLACES]);

impl Shape {
    /// The empty shape, similar to nothing.
    pub(super) const NONE: Shape = Shape([0.0; PLACES]);

    /// The shape around a position in a signal at the working rate, as far as it is held.
    pub(super) fn around(middle: f64, signal: &History, rate_hz: f64) -> Shape {
        let step = 2.0 * REACH_SECS / (PLACES - 1) as f64 * rate_hz;
        let first = middle - REACH_SECS * rate_hz;
        let begin = first.floor() as i64;
        let end = (middle + REACH_SECS * rate_hz).ceil() as i64 + 2;
        let samples = signal.at(begin..end);
        if samples.len() < 4 {
            return Shape::NONE;
        }
        let mut values = [0.0; PLACES];
        for (index, value) in values.iter_mut().enumerate() {
            let place = first - begin as f64 + index as f64 * step;
            let left = (place as usize).min(samples.len() - 1);
            let right = (left + 1).min(samples.len() - 1);
            *value = samples[left] + (samples[right] - samples[left]) * place.fract();
        }
        Shape::of(values)
    }

    fn of(mut values: [f64; PLACES]) -> Shape {
        let middle = (PLACES - 1) as f64 / 2.0;
        let mean = values.iter().sum::<f64>() / PLACES as f64;
        let places = || (0..PLACES).map(|index| index as f64 - middle);
        let tilt: f64 = places().zip(&values).map(|(place, value)| place * value).sum();
        let slope = tilt / places().map(|place| place * place).sum::<f64>();
        places().zip(&mut values).for_each(|(place, value)| *value -= mean + slope * place);
        let size = values.iter().map(|value| value * value).sum::<f64>().sqrt();
        let scale = if size > 0.0 && size.is_finite() { 1.0 / size } else { 0.0 };
        Shape(values.map(|value| (value * scale) as f32))
    }

    /// The correlation with another shape: 1 for the same.
    pub(super) fn likeness(&self, other: &Shape) -> f64 {
        f64::from(self.0.iter().zip(&other.0).map(|(left, right)| left * right).sum::<f32>())
    }
}

/// The third-highest similarity to the given beats, since several morphologies may alternate; 0 with fewer
/// than three.
pub(super) fn alike<'a>(shape: &Shape, beats: impl Iterator<Item = &'a Shape>) -> f64 {
    let mut best = [0.0; 3];
    for beat in beats {
        let mut value = shape.likeness(beat);
        for each in &mut best {
            if value > *each {
                std::mem::swap(each, &mut value);
            }
        }
    }
    best[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(height: f64, width: f64) -> History {
        let mut history = History::new(100);
        for k in 0..100 {
            let secs = (f64::from(k) - 50.0) / 250.0;
            history.push(height * (-(secs / width).powi(2) / 2.0).exp() + 0.02 * f64::from(k));
        }
        history
    }

    #[test]
    fn a_form_is_the_same_at_any_height_and_on_any_slope() {
        let beats: Vec<Shape> =
            (1..4).map(|k| Shape::around(50.0, &history(f64::from(k), 0.01), 250.0)).collect();
        let low = Shape::around(50.0, &history(0.2, 0.01), 250.0);
        let wide = Shape::around(50.0, &history(1.0, 0.045), 250.0);
        assert!(alike(&low, beats.iter()) > 0.99);
        assert!(alike(&wide, beats.iter()) < 0.8);
        assert!(alike(&low, beats[..2].iter()).abs() < 1e-9);
        assert!(alike(&Shape::NONE, beats.iter()).abs() < 1e-9);
    }
}
