//! The binary frame of a wave.
//!
//! Little-endian: u32 the stream's number, u32 channels, f64 the time of the first sample [s], f64 from one sample to
//! the next [s], then f32 numbers, sample by sample. NaN is a gap.

/// The length of what precedes the samples [bytes].
pub const HEAD_BYTES: usize = 24;

/// A run of samples of a stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Wave {
    /// The stream's number.
    pub stream: u32,
    /// How many numbers a sample has.
    pub channels: u32,
    /// The time of the first sample [s].
    pub start: f64,
    /// From one sample to the next [s].
    pub period: f64,
    /// Sample by sample.
    pub samples: Vec<f32>,
}

impl Wave {
    /// As it is sent.
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

#[cfg(test)]
mod tests {
    use super::*;

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
