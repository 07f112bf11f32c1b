/// Ranks from 1, with ties sharing the mean of their ranks, as `scipy.stats.rankdata`.
///
/// Expects numbers; NaN ranks as `f64::total_cmp` orders it.
///
/// ```
/// use teampulse_signal::statistics::average_ranks;
/// assert_eq!(average_ranks(&[30.0, 10.0, 30.0, 20.0]), [3.5, 1.0, 3.5, 2.0]);
/// ```
pub fn average_ranks(values: &[f64]) -> Vec<f64> {
    let mut ranks = vec![0.0; values.len()];
    for tie in ties(values) {
        let shared = tie.first_rank as f64 + (tie.members.len() as f64 - 1.0) / 2.0;
        for member in tie.members {
            ranks[member] = shared;
        }
    }
    ranks
}

/// Σ (t³ − t) over the groups of t equal values.
pub(super) fn tie_sum(values: &[f64]) -> f64 {
    ties(values).iter().map(|tie| tie.members.len() as f64).map(|t| t.powi(3) - t).sum()
}

struct Tie {
    first_rank: usize,
    members: Vec<usize>,
}

fn ties(values: &[f64]) -> Vec<Tie> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    // −0 equals 0: adding 0 makes them one.
    let key = |index: usize| values[index] + 0.0;
    order.sort_by(|&a, &b| key(a).total_cmp(&key(b)));
    let groups = order.chunk_by(|&a, &b| key(a).total_cmp(&key(b)).is_eq());
    let mut first_rank = 1;
    let tie = |members: &[usize]| {
        let tie = Tie { first_rank, members: members.to_vec() };
        first_rank += members.len();
        tie
    };
    groups.map(tie).collect()
}
