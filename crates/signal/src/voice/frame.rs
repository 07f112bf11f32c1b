/// The features of 10 ms of sound.
///
/// A frame with a missing sample in its window is unknown: all its numbers are NaN, and it is not counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The time of the middle of the frame [ns].
    pub at_ns: i64,
    /// The level over 20 ms [dBFS], at least −120; a full-scale sine has −3 dBFS.
    pub level_dbfs: f64,
    /// The level of the background noise [dBFS].
    pub floor_dbfs: f64,
    /// 1 in speech, otherwise 0.
    pub speech: f64,
    /// The likelihood that the frame is voiced [0..1].
    pub voicing: f64,
    /// The pitch [Hz]; NaN if unvoiced.
    pub pitch_hz: f64,
    /// The spectral tilt over third octaves from 100 Hz to 5 kHz [dB/octave]; NaN if unvoiced.
    pub tilt_db_per_octave: f64,
    /// The share of samples at full scale or beyond [0..1].
    pub clipped: f64,
    /// The number of syllable nuclei that became known with the frame.
    pub nuclei: f64,
    /// The glottal pulses in the frame.
    pub glottal: Glottal,
}

/// Sums over glottal pulses, from which jitter and shimmer are computed for any span.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Glottal {
    /// The number of periods.
    pub periods: f64,
    /// The sum of the periods [ms].
    pub period_ms: f64,
    /// The number of pairs of consecutive periods that differ by less than a factor of 1.3.
    pub period_pairs: f64,
    /// The sum of the differences in these pairs [ms].
    pub period_change_ms: f64,
    /// The sum of the pulses' amplitudes (1 is full scale).
    pub amplitude: f64,
    /// The number of pairs of consecutive amplitudes that differ by less than a factor of 1.6.
    pub amplitude_pairs: f64,
    /// The sum of the differences in these pairs (1 is full scale).
    pub amplitude_change: f64,
}

/// The names and units of a frame's numbers, in the order of [`Frame::numbers`].
pub const CHANNELS: [(&str, &str); 15] = [
    ("level", "dB"),
    ("floor", "dB"),
    ("speech", "1"),
    ("voicing", "1"),
    ("pitch", "Hz"),
    ("tilt", "dB/oct"),
    ("clipped", "1"),
    ("nuclei", "1"),
    ("periods", "1"),
    ("period_sum", "ms"),
    ("period_pairs", "1"),
    ("period_change_sum", "ms"),
    ("amplitude_sum", "1"),
    ("amplitude_pairs", "1"),
    ("amplitude_change_sum", "1"),
];

impl Frame {
    /// A frame without known features.
    pub fn unknown(at_ns: i64) -> Frame {
        let nan = f64::NAN;
        Frame {
            at_ns,
            level_dbfs: nan,
            floor_dbfs: nan,
            speech: nan,
            voicing: nan,
            pitch_hz: nan,
            tilt_db_per_octave: nan,
            clipped: nan,
            nuclei: 0.0,
            glottal: Glottal::default(),
        }
    }

    /// Whether the features of the frame are known.
    pub fn is_known(&self) -> bool {
        self.level_dbfs.is_finite() && self.floor_dbfs.is_finite() && self.speech.is_finite()
    }

    /// Whether the frame is speech.
    pub fn is_speech(&self) -> bool {
        self.speech > 0.5
    }

    /// Whether the frame has a pitch.
    pub fn is_voiced(&self) -> bool {
        self.pitch_hz.is_finite()
    }

    /// The numbers of the frame, in the order of [`CHANNELS`].
    pub fn numbers(&self) -> [f64; CHANNELS.len()] {
        let Glottal { periods, period_ms, period_pairs, period_change_ms, .. } = self.glottal;
        let Glottal { amplitude, amplitude_pairs, amplitude_change, .. } = self.glottal;
        [
            self.level_dbfs,
            self.floor_dbfs,
            self.speech,
            self.voicing,
            self.pitch_hz,
            self.tilt_db_per_octave,
            self.clipped,
            self.nuclei,
            periods,
            period_ms,
            period_pairs,
            period_change_ms,
            amplitude,
            amplitude_pairs,
            amplitude_change,
        ]
    }

    /// The frame with [these numbers](Self::numbers); [unknown](Self::unknown) if its level is not a
    /// number.
    pub fn of_numbers(at_ns: i64, numbers: &[f64]) -> Frame {
        let number = |index: usize| numbers.get(index).copied().unwrap_or(f64::NAN);
        let sum = |index: usize| Some(number(index)).filter(|sum| sum.is_finite()).unwrap_or(0.0);
        let frame = Frame {
            at_ns,
            level_dbfs: number(0),
            floor_dbfs: number(1),
            speech: number(2),
            voicing: number(3),
            pitch_hz: number(4),
            tilt_db_per_octave: number(5),
            clipped: number(6),
            nuclei: sum(7),
            glottal: Glottal {
                periods: sum(8),
                period_ms: sum(9),
                period_pairs: sum(10),
                period_change_ms: sum(11),
                amplitude: sum(12),
                amplitude_pairs: sum(13),
                amplitude_change: sum(14),
            },
        };
        if frame.is_known() { frame } else { Frame::unknown(at_ns) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_its_numbers() {
        let numbers: Vec<f64> = (0..CHANNELS.len()).map(|k| k as f64 + 1.0).collect();
        let frame = Frame::of_numbers(7, &numbers);
        assert_eq!(frame.numbers().to_vec(), numbers);
        assert!(!Frame::of_numbers(7, &[]).is_known());
    }
}
