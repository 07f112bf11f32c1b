//! Detrending of segments.

/// What is subtracted from each segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detrend {
    /// The mean of the segment.
    Constant,
    /// The least-squares line of the segment.
    Linear,
    /// Nothing.
    Nothing,
}

impl Detrend {
    /// Detrends a segment in place.
    pub fn apply(self, segment: &mut [f64]) {
        let middle = (segment.len() as f64 - 1.0) / 2.0;
        let mean = segment.iter().sum::<f64>() / segment.len() as f64;
        let slope = if self == Detrend::Linear { slope(segment, middle) } else { 0.0 };
        if self == Detrend::Nothing {
            return;
        }
        for (k, value) in segment.iter_mut().enumerate() {
            *value -= mean + slope * (k as f64 - middle);
        }
    }
}

fn slope(segment: &[f64], middle: f64) -> f64 {
    let offsets = (0..segment.len()).map(|k| k as f64 - middle);
    let products: f64 = offsets.clone().zip(segment).map(|(x, y)| x * y).sum();
    let squares: f64 = offsets.map(|x| x * x).sum();
    if squares > 0.0 { products / squares } else { 0.0 }
}
