//! The share of a span of time that has data.

use crate::robust::median;

/// A gap longer than this many usual intervals is a hole; one lost sample and some jitter are tolerated.
const USUAL_INTERVALS: f64 = 3.0;

/// The share of the span from `begin_ns` to `end_ns` [ns] that has data [0..1].
///
/// Each interval between successive times counts in full, but a hole of more than three times the usual
/// (median) interval counts only as one usual interval; so do the intervals to both ends of the span.
/// Expects ascending times inside the span; 0 with fewer than two.
///
/// ```
/// use teampulse_signal::coverage::coverage;
/// // Once a second, but silent from 4 s to 10 s: the gap counts as 1 s of 6.
/// let times_ns = [1, 2, 3, 4, 10].map(|secs| secs * 1_000_000_000);
/// assert_eq!(coverage(&times_ns, 0, 10_000_000_000), 0.5);
/// ```
pub fn coverage(times_ns: &[i64], begin_ns: i64, end_ns: i64) -> f64 {
    let inner: Vec<f64> = times_ns.windows(2).map(|pair| since(pair[0], pair[1])).collect();
    let span_ns = since(begin_ns, end_ns);
    let (Some(usual_ns), [first_ns, .., last_ns]) = (median(&inner), times_ns) else { return 0.0 };
    let outer = [since(begin_ns, *first_ns), since(*last_ns, end_ns)];
    let is_hole = |gap_ns: f64| gap_ns > USUAL_INTERVALS * usual_ns;
    let counted = |&gap_ns: &f64| if is_hole(gap_ns) { usual_ns } else { gap_ns.max(0.0) };
    let covered_ns: f64 = inner.iter().chain(&outer).map(counted).sum();
    if span_ns > 0.0 { (covered_ns / span_ns).clamp(0.0, 1.0) } else { 0.0 }
}

fn since(earlier_ns: i64, later_ns: i64) -> f64 {
    later_ns.saturating_sub(earlier_ns) as f64
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_regular_stream_covers_its_span_at_any_rate() {
        for period_ns in [1, 7, 50] {
            let times_ns: Vec<i64> = (0..200).step_by(period_ns).collect();
            assert_eq!(coverage(&times_ns, 0, 200), 1.0);
        }
    }

    #[test]
    fn one_lost_sample_is_no_hole() {
        assert_eq!(coverage(&[0, 10, 20, 40, 50], 0, 50), 1.0);
    }

    #[test]
    fn nothing_covers_nothing() {
        assert_eq!(coverage(&[], 0, 100), 0.0);
        assert_eq!(coverage(&[50], 0, 100), 0.0);
    }

    proptest! {
        #[test]
        fn a_share_is_a_share(
            mut times_ns in prop::collection::vec(any::<i64>(), 0..50),
            begin_ns in any::<i64>(),
            end_ns in any::<i64>(),
        ) {
            times_ns.sort_unstable();
            prop_assert!((0.0..=1.0).contains(&coverage(&times_ns, begin_ns, end_ns)));
        }
    }
}
