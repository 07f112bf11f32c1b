/// A span of time [ns]: from its beginning up to, and without, its end.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub struct Span {
    /// Its first instant [ns].
    pub begin_ns: i64,
    /// The first instant after it [ns].
    pub end_ns: i64,
}

impl Span {
    /// How long it is [s]; 0 when it ends before it begins.
    pub fn secs(self) -> f64 {
        self.end_ns.saturating_sub(self.begin_ns).max(0) as f64 / 1e9
    }

    /// Whether an instant [ns] lies in it.
    pub fn holds(self, at_ns: i64) -> bool {
        (self.begin_ns..self.end_ns).contains(&at_ns)
    }

    /// The same span with `secs` [s] more before it.
    #[must_use]
    pub fn with_before(self, secs: f64) -> Span {
        Span { begin_ns: self.begin_ns.saturating_sub((secs * 1e9) as i64), ..self }
    }
}
