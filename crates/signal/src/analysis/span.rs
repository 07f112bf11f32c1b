/// A half-open span of time [ns]: the end is excluded.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub struct Span {
    /// The first instant of the span [ns].
    pub begin_ns: i64,
    /// The first instant after the span [ns].
    pub end_ns: i64,
}

impl Span {
    /// The duration of the span [s]; 0 when it ends before it begins.
    pub fn secs(self) -> f64 {
        self.end_ns.saturating_sub(self.begin_ns).max(0) as f64 / 1e9
    }

    /// Whether the span contains a time [ns].
    pub fn holds(self, at_ns: i64) -> bool {
        (self.begin_ns..self.end_ns).contains(&at_ns)
    }

    /// The span extended by `secs` [s] at its start.
    #[must_use]
    pub fn with_before(self, secs: f64) -> Span {
        Span { begin_ns: self.begin_ns.saturating_sub((secs * 1e9) as i64), ..self }
    }
}
