use super::Span;

/// A recording at an even rate.
#[derive(Clone, Copy, Debug)]
pub struct Recording<'a> {
    /// Samples a second [Hz].
    pub rate_hz: f64,
    /// When the first sample was measured [ns].
    pub begin_ns: i64,
    /// Samples of each channel, as many of one as of the others; NaN where one is missing.
    pub channels: &'a [Vec<f64>],
}

impl Recording<'_> {
    /// How many samples each channel has: as many as the shortest.
    pub fn len(&self) -> usize {
        self.channels.iter().map(Vec::len).min().unwrap_or(0)
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// When a sample, or what lies between samples, was measured [ns].
    pub fn time_ns(&self, sample: f64) -> i64 {
        self.begin_ns.saturating_add((sample / self.rate_hz * 1e9).round() as i64)
    }

    /// The whole recording.
    pub fn span(&self) -> Span {
        Span { begin_ns: self.begin_ns, end_ns: self.time_ns(self.len() as f64) }
    }
}
