/// The correction of a family of p-values for multiple comparisons.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Correction {
    /// The step-down correction that controls the probability of any false finding; never weaker than Bonferroni. Holm
    /// (1979), <https://www.jstor.org/stable/4615733>.
    #[default]
    Holm,
    /// The p-values multiplied by their number, which controls the probability of any false finding. Dunn (1961),
    /// doi:10.1080/01621459.1961.10482090.
    Bonferroni,
    /// The step-up correction that controls the share of false findings. Benjamini & Hochberg (1995),
    /// doi:10.1111/j.2517-6161.1995.tb02031.x.
    BenjaminiHochberg,
}

/// Corrects the p-values of one family for their number, in the order given [0..1].
///
/// Equals `statsmodels.stats.multitest.multipletests`. A missing p-value (NaN, or outside 0..1) stays NaN and does not
/// count, as in pingouin. Name the family with the result.
///
/// ```
/// use teampulse_signal::statistics::{Correction, corrected};
/// assert_eq!(corrected(&[0.25, 0.01, f64::NAN], Correction::Holm)[..2], [0.25, 0.02]);
/// ```
pub fn corrected(p_values: &[f64], correction: Correction) -> Vec<f64> {
    let is_p = |&index: &usize| (0.0..=1.0).contains(&p_values[index]);
    let mut order: Vec<usize> = (0..p_values.len()).filter(is_p).collect();
    order.sort_by(|&a, &b| p_values[a].total_cmp(&p_values[b]));
    let count = order.len() as f64;
    let mut corrected = vec![f64::NAN; p_values.len()];
    match correction {
        Correction::Bonferroni => {
            for &index in &order {
                corrected[index] = (p_values[index] * count).min(1.0);
            }
        }
        Correction::Holm => {
            let mut greatest: f64 = 0.0;
            for (rank, &index) in order.iter().enumerate() {
                greatest = greatest.max(p_values[index] * (count - rank as f64));
                corrected[index] = greatest.min(1.0);
            }
        }
        Correction::BenjaminiHochberg => {
            let mut least: f64 = 1.0;
            for (rank, &index) in order.iter().enumerate().rev() {
                least = least.min(p_values[index] * (count / (rank as f64 + 1.0)));
                corrected[index] = least;
            }
        }
    }
    corrected
}
