use super::series::present;

/// Most intervals that are compared, each with each.
const MOST: usize = 20_000;

/// Fuzzy entropy of intervals [ms], m = 2: as [`sample_entropy`](super::sample_entropy), but without
/// each pair's and triple's own mean, and alike by degrees, exp(−d/r).
///
/// r is `tolerance_ms`, d the greatest difference. Chen et al. (2009),
/// doi:10.1016/j.medengphy.2008.04.005, with n = 1; as NeuroKit2's `entropy_fuzzy`. Window: 5 minutes;
/// steadier than sample entropy with few beats. `None` with fewer than four intervals, more than
/// 20 000, or a tolerance that is not positive.
pub fn fuzzy_entropy(intervals_ms: &[f64], tolerance_ms: f64) -> Option<f64> {
    let nn = present(intervals_ms);
    let fits = (4..=MOST).contains(&nn.len()) && tolerance_ms > 0.0 && tolerance_ms.is_finite();
    let triples = || nn.windows(3);
    let about_mean = |triple: &[f64]| {
        let mean = (triple[0] + triple[1] + triple[2]) / 3.0;
        [triple[0] - mean, triple[1] - mean, triple[2] - mean]
    };
    // Without their means, pairs differ by half of what their differences do.
    let halves: Vec<f64> = triples().map(|triple| (triple[1] - triple[0]) / 2.0).collect();
    let triples: Vec<[f64; 3]> = triples().map(about_mean).collect();
    let (mut two, mut three) = (0.0, 0.0);
    for a in 0..if fits { halves.len() } else { 0 } {
        for b in a + 1..halves.len() {
            let apart = |k: usize| (triples[a][k] - triples[b][k]).abs();
            two += (-(halves[a] - halves[b]).abs() / tolerance_ms).exp();
            three += (-apart(0).max(apart(1)).max(apart(2)) / tolerance_ms).exp();
        }
    }
    let entropy = f64::ln(two / three);
    entropy.is_finite().then_some(entropy)
}
