use super::series::present;

/// The most intervals, all pairs of which are compared.
const MOST: usize = 20_000;

/// Fuzzy entropy of intervals [ms], m = 2: like [`sample_entropy`](super::sample_entropy), but with the mean of each
/// pair and triple removed, and with a graded similarity exp(−d/r).
///
/// r is `tolerance_ms`, d the greatest difference. Chen et al. (2009), doi:10.1016/j.medengphy.2008.04.005,
/// with n = 1; as in NeuroKit2's `entropy_fuzzy`. Window: 5 minutes; steadier than sample entropy with few
/// beats. `None` with fewer than four intervals, more than 20 000, or a tolerance that is not positive.
pub fn fuzzy_entropy(intervals_ms: &[f64], tolerance_ms: f64) -> Option<f64> {
    let nn = present(intervals_ms);
    let fits = (4..=MOST).contains(&nn.len()) && tolerance_ms > 0.0 && tolerance_ms.is_finite();
    let triples = || nn.windows(3);
    let about_mean = |triple: &[f64]| {
        let mean = (triple[0] + triple[1] + triple[2]) / 3.0;
        [triple[0] - mean, triple[1] - mean, triple[2] - mean]
    };
    // With their means removed, pairs differ by half the difference of their steps.
    let halves: Vec<f64> = triples().map(|triple| (triple[1] - triple[0]) / 2.0).collect();
    let triples: Vec<[f64; 3]> = triples().map(about_mean).collect();
    let mut three = 0.0;
    for a in 0..if fits { triples.len() } else { 0 } {
        for b in a + 1..triples.len() {
            let apart = |k: usize| (triples[a][k] - triples[b][k]).abs();
            three += (-apart(0).max(apart(1)).max(apart(2)) / tolerance_ms).exp();
        }
    }
    let entropy = f64::ln(alike(halves, tolerance_ms) / three);
    entropy.is_finite().then_some(entropy)
}

/// The sum of exp(−|a − b| / r) over all pairs. In sorted order, the sum over the values below one is the
/// sum over those below the previous one, scaled by the similarity of these two.
fn alike(mut values: Vec<f64>, r: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let mut below = 0.0;
    let alike_below = |pair: &[f64]| {
        below = (below + 1.0) * ((pair[0] - pair[1]) / r).exp();
        below
    };
    values.windows(2).map(alike_below).sum()
}
