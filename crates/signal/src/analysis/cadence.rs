/// A step longer than this many sample intervals means that samples are missing.
const HOLE: f64 = 1.5;

/// Counts the missing samples from the times of those that arrived.
#[derive(Clone, Debug)]
pub struct Cadence {
    rate_hz: f64,
    last_ns: Option<i64>,
}

impl Cadence {
    /// Creates a cadence for a rate [Hz]; at 0, samples are irregular and never count as missing.
    pub fn new(rate_hz: f64) -> Cadence {
        Cadence { rate_hz, last_ns: None }
    }

    /// The number of samples missing between the last one and `at_ns` [ns]; `None` when `at_ns` is not after the last
    /// one, in which case the sample is dropped.
    ///
    /// A step of up to one and a half intervals misses nothing, because clocks are imperfect.
    pub fn missing_before(&mut self, at_ns: i64) -> Option<usize> {
        let Some(last_ns) = self.last_ns.replace(at_ns) else { return Some(0) };
        if at_ns <= last_ns {
            self.last_ns = Some(last_ns);
            return None;
        }
        let steps = at_ns.saturating_sub(last_ns) as f64 / 1e9 * self.rate_hz;
        Some(if steps > HOLE { steps.round() as usize - 1 } else { 0 })
    }

    /// The time [ns] of the `number`-th (from 1) of `missing` samples, spaced evenly between the sample at
    /// `from_ns` and the one at `at_ns`.
    pub(super) fn missing_ns(from_ns: i64, at_ns: i64, number: usize, missing: usize) -> i64 {
        let step_ns = at_ns.saturating_sub(from_ns) as f64 / (missing + 1) as f64;
        from_ns.saturating_add((step_ns * number as f64).round() as i64)
    }

    /// The time of the last sample [ns].
    pub fn last_ns(&self) -> Option<i64> {
        self.last_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_samples_are_counted_by_the_times() {
        let mut cadence = Cadence::new(10.0);
        let times_ms = [0, 100, 210, 500, 500, 400, 600];
        let missing = times_ms.map(|ms| cadence.missing_before(ms * 1_000_000));
        assert_eq!(missing, [Some(0), Some(0), Some(0), Some(2), None, None, Some(0)]);
    }

    #[test]
    fn times_at_both_ends_of_all_time_do_no_harm() {
        let mut cadence = Cadence::new(1e6);
        assert_eq!(cadence.missing_before(i64::MIN), Some(0));
        assert!(cadence.missing_before(i64::MAX).is_some());
        assert_eq!(cadence.missing_before(i64::MIN), None);
    }
}
