//! How many offsets would fit as well by chance.
//!
//! The best of many offsets is taken, at which some events agree even if the two recordings have nothing to do with
//! each other: two or three of eight, if each has eight presses in half a minute. If the events of the two are
//! independent, an event of the recording has a partner in a window of width *w* with the probability *q* = 1 −
//! exp(−*w* / *interval*). At each offset that brings one pair together, at least *k* of the recording's other *m*
//! events then also have a partner with a probability of at most exp(−*m* · KL(*k*/*m* ‖ *q*)) (the Chernoff bound).
//! This bound times the number of such offsets bounds the expected number of offsets that fit as well.

use super::line::RobustLine;

/// The window is no narrower than this, since stamps are rounded [s].
const LEAST_WINDOW_SECS: f64 = 0.01;

/// An upper bound on the number of offsets, within the largest allowed, at which the events of unrelated recordings are
/// expected to agree as well as on the line. Both lists are in ascending order [s].
pub(super) fn expected_by_chance(
    session: &[f64],
    recording: &[f64],
    line: &RobustLine,
    max_offset_secs: f64,
) -> f64 {
    // A fitted slope brings a second pair together, whatever the events are.
    let given = if line.has_slope { 2 } else { 1 };
    let others = recording.len().saturating_sub(given);
    let agree = line.count.saturating_sub(given).min(others);
    let meets = -(-line.window.max(LEAST_WINDOW_SECS) / usual_interval(session)).exp_m1();
    let offsets = offsets_with_a_pair(session, recording, max_offset_secs);
    let slopes = (others as f64).powi(given as i32 - 1);
    offsets * slopes * at_least(agree, others, meets)
}

/// The median interval between events [s]; if the events come in groups, that within groups.
fn usual_interval(ascending: &[f64]) -> f64 {
    let mut intervals: Vec<f64> = ascending.windows(2).map(|pair| pair[1] - pair[0]).collect();
    intervals.sort_by(f64::total_cmp);
    intervals.get(intervals.len() / 2).copied().unwrap_or(f64::INFINITY)
}

fn offsets_with_a_pair(session: &[f64], recording: &[f64], max_offset_secs: f64) -> f64 {
    let near = |secs: &f64| {
        let first = session.partition_point(|each| *each < secs - max_offset_secs);
        session.partition_point(|each| *each <= secs + max_offset_secs) - first
    };
    recording.iter().map(near).map(|count| count as f64).sum()
}

/// An upper bound on the probability that at least `agree` of `events` have a partner, if each has one with the
/// probability `each`.
fn at_least(agree: usize, events: usize, each: f64) -> f64 {
    if agree == 0 {
        return 1.0;
    }
    let share = agree as f64 / events as f64;
    if share <= each {
        return 1.0;
    }
    // x · ln(x / y) is 0 for x = 0.
    let term = |of: f64, against: f64| if of > 0.0 { of * (of / against).ln() } else { 0.0 };
    let divergence = term(share, each) + term(1.0 - share, 1.0 - each);
    (-(events as f64) * divergence).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_is_the_product_where_all_agree() {
        assert!((at_least(3, 3, 0.1) - 1e-3).abs() < 1e-12);
        assert!((at_least(0, 3, 0.1) - 1.0).abs() < 1e-12);
        assert!((at_least(1, 10, 0.2) - 1.0).abs() < 1e-12);
        // Exactly: 10 · 0.1 · 0.9⁹ + … = 0.2639 for two of ten.
        let two = at_least(2, 10, 0.1);
        assert!((0.2639..1.0).contains(&two), "{two}");
    }

    #[test]
    fn only_offsets_within_the_largest_one_count() {
        let (session, recording) = ([0.0, 10.0, 20.0], [0.5, 9.0]);
        assert_eq!(offsets_with_a_pair(&session, &recording, 2.0) as usize, 2);
        assert_eq!(offsets_with_a_pair(&session, &recording, f64::INFINITY) as usize, 6);
    }
}
