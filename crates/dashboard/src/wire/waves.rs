//! The binary frame of a wave.
//!
//! Little-endian: u32 stream number, u32 channels, f64 time of the first sample [s], f64 sampling period [s], then
//! f32 values, sample by sample. NaN is a gap.

/// The length of the header [bytes].
pub const HEAD_BYTES: usize = 24;

/// A run of samples of a stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Wave {
    /// The stream's number.
    pub stream: u32,
    /// The number of values per sample.
    pub channels: u32,
    /// The time of the first sample [s].
    pub start: f64,
    /// The sampling period [s].
    pub period: f64,
    /// The values, sample by sample.
    pub samples: Vec<f32>,
}

impl Wave {
    /// Encodes the wave as a binary frame.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEAD_BYTES + 4 * self.samples.len());
        bytes.extend(self.stream.to_le_bytes());
        bytes.extend(self.channels.to_le_bytes());
        bytes.extend(self.start.to_le_bytes());
        bytes.extend(self.period.to_le_bytes());
        bytes.extend(self.samples.iter().flat_map(|sample| sample.to_le_bytes()));
        bytes
    }
}

impl Wave {
    /// Returns the wave with fewer samples if it has more than `points_per_sec`: the minimum and the maximum of each
    /// channel over every few samples, in the order in which they occur. 0 leaves it unchanged.
    #[must_use]
    pub fn thinned(&self, points_per_sec: f64) -> Wave {
        let width = self.channels.max(1) as usize;
        let pairs = (2.0 / (points_per_sec * self.period)).ceil();
        if !(pairs >= 3.0 && pairs.is_finite()) {
            return self.clone();
        }
        let count = self.samples.len() / width;
        let merged = (pairs as usize).min(count.max(1));
        let mut samples = Vec::with_capacity(2 * width * count.div_ceil(merged));
        for few in self.samples[..count * width].chunks(merged * width) {
            let extremes: Vec<(f32, f32)> =
                (0..width).map(|channel| extremes(few, channel, width)).collect();
            samples.extend(extremes.iter().map(|(earlier, _)| earlier));
            samples.extend(extremes.iter().map(|(_, later)| later));
        }
        let pairs = count.div_ceil(merged).max(1);
        let period = self.period * count as f64 / (2 * pairs) as f64;
        Wave { period, samples, ..*self }
    }
}

/// Returns the minimum and the maximum of a channel, in the order in which they occur.
fn extremes(samples: &[f32], channel: usize, width: usize) -> (f32, f32) {
    let (mut min, mut max) = ((0, f32::NAN), (0, f32::NAN));
    for (place, number) in samples.iter().skip(channel).step_by(width).enumerate() {
        if min.1.is_nan() || *number < min.1 {
            min = (place, *number);
        }
        if max.1.is_nan() || *number > max.1 {
            max = (place, *number);
        }
    }
    if min.0 <= max.0 { (min.1, max.1) } else { (max.1, min.1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thinned_wave_keeps_its_peaks_and_its_length() {
        let mut samples = vec![0.0; 100];
        samples[33] = 9.0;
        let wave = Wave { stream: 1, channels: 1, start: 0.0, period: 0.002, samples };
        let thin = wave.thinned(100.0);
        assert_eq!(thin.samples.len(), 20);
        assert!(thin.samples.contains(&9.0) && (thin.period - 0.01).abs() < 1e-12);
        assert_eq!((wave.thinned(0.0), wave.thinned(1e9)), (wave.clone(), wave.clone()));
        let gap = Wave { samples: vec![f32::NAN; 100], ..wave };
        assert!(gap.thinned(1.0).samples.iter().all(|number| number.is_nan()));
    }

    #[test]
    fn a_wave_is_laid_out_as_documented() {
        let wave =
            Wave { stream: 7, channels: 2, start: 1.5, period: 0.25, samples: vec![1.0, -2.0] };
        let bytes = wave.encode();
        assert_eq!(bytes.len(), HEAD_BYTES + 8);
        assert_eq!(bytes[..8], [7, 0, 0, 0, 2, 0, 0, 0]);
        assert_eq!(bytes[8..16], 1.5_f64.to_le_bytes());
        assert_eq!(bytes[16..24], 0.25_f64.to_le_bytes());
        assert_eq!(bytes[24..], [1.0_f32.to_le_bytes(), (-2.0_f32).to_le_bytes()].concat());
    }
}
