//! The straight segment between two samples.

/// The straight segment between two neighbouring samples of one channel, for the rows between them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    before: i64,
    pub after: i64,
    gap_nanos: f64,
    begin: f64,
    rise: f64,
}

impl Segment {
    /// An empty segment, which contains no row.
    pub const NOWHERE: Segment =
        Segment { before: i64::MAX, after: i64::MIN, gap_nanos: 0.0, begin: 0.0, rise: 0.0 };

    /// The segment from one time and value to another; `None` if the gap between them is longer than allowed.
    #[inline]
    pub fn between(
        [(before, begin), (after, end)]: [(i64, f64); 2],
        max_gap_nanos: i64,
    ) -> Option<Segment> {
        let gap_nanos =
            after.checked_sub(before).filter(|&gap_nanos| gap_nanos <= max_gap_nanos)?;
        Some(Segment { before, after, gap_nanos: gap_nanos as f64, begin, rise: end - begin })
    }

    /// Whether a row lies between its ends.
    #[inline]
    pub fn has(&self, row: i64) -> bool {
        self.before < row && row < self.after
    }

    /// The value at a row between its ends.
    #[inline]
    pub fn at(&self, row: i64) -> f64 {
        let share = (row - self.before) as f64 / self.gap_nanos;
        self.begin + share * self.rise
    }
}
