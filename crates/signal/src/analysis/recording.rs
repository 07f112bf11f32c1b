use super::Span;

/// A recording at a constant rate.
#[derive(Clone, Copy, Debug)]
pub struct Recording<'a> {
    /// The sampling rate [Hz].
    pub rate_hz: f64,
    /// The time of the first sample [ns].
    pub begin_ns: i64,
    /// The samples of each channel, all of the same length; NaN where one is missing.
    pub channels: &'a [Vec<f64>],
}

impl Recording<'_> {
    /// The number of samples of the shortest channel.
    pub fn len(&self) -> usize {
        self.channels.iter().map(Vec::len).min().unwrap_or(0)
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The time of a (fractional) sample position [ns].
    pub fn time_ns(&self, sample: f64) -> i64 {
        let ns = sample / self.rate_hz * 1e9;
        // Rounded without `f64::round`, which is a function call where the processor may lack SSE4.1.
        let (whole_ns, rest) = (ns as i64, ns - (ns as i64) as f64);
        let carry = i64::from(rest >= 0.5) - i64::from(rest <= -0.5);
        self.begin_ns.saturating_add(whole_ns.saturating_add(carry))
    }

    /// The whole recording.
    pub fn span(&self) -> Span {
        Span { begin_ns: self.begin_ns, end_ns: self.time_ns(self.len() as f64) }
    }
}
