use super::distributions::{Alternative, normal_upper};
use super::error::{StatisticsError, checked, differences};
use super::ranks::{average_ranks, tie_sum};

/// Most differences that an exact p-value is computed for: the time grows with their cube.
const MOST_EXACT: usize = 500;

/// Up to so many differences, all different, the answer is exact by default, as in SciPy.
const EXACT_WITHOUT_TIES: usize = 50;

/// Up to so many differences, with ties or zeros, the answer is exact by default, as in SciPy.
const EXACT_WITH_TIES: usize = 13;

/// What becomes of differences of zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Zeros {
    /// They are left out. Wilcoxon (1945), doi:10.2307/3001968.
    #[default]
    LeftOut,
    /// They take part in the ranking, but in neither sum. Pratt (1959),
    /// doi:10.1080/01621459.1959.10501526.
    Ranked,
}

/// How the p-value is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum WilcoxonMethod {
    /// As SciPy chooses: exact up to 50 pairs without ties and zeros and up to 13 with them, else
    /// normal.
    #[default]
    Auto,
    /// From all assignments of signs to the ranks there are, ties included; up to 500 pairs.
    Exact,
    /// From the normal approximation, with the correction for ties.
    Normal,
    /// The same, half a rank closer to the middle.
    NormalWithContinuity,
}

/// Wilcoxon's signed rank test and how it is done; the default is `scipy.stats.wilcoxon`'s.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Wilcoxon {
    /// What is held against "no difference".
    pub alternative: Alternative,
    /// What becomes of differences of zero.
    pub zeros: Zeros,
    /// How the p-value is found.
    pub method: WilcoxonMethod,
}

/// The result of Wilcoxon's signed rank test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedRank {
    /// Sum of the ranks of positive differences.
    pub w_plus: f64,
    /// Sum of the ranks of negative differences. SciPy prints the lesser of the two when two-sided.
    pub w_minus: f64,
    /// How likely such sums are without a difference [0..1].
    pub p: f64,
    /// The normal statistic; `None` when exact.
    pub z: Option<f64>,
    /// Whether `p` is exact.
    pub exact: bool,
    /// How many differences were ranked.
    pub n_ranked: usize,
    /// How many differences were zero.
    pub n_zero: usize,
    /// Matched-pairs rank-biserial correlation, (W₊ − W₋)/(W₊ + W₋) [−1..1]. Kerby (2014),
    /// doi:10.2466/11.IT.3.1.
    pub rank_biserial: f64,
}

impl Wilcoxon {
    /// Tests the differences `first` − `second` of paired values.
    ///
    /// Wilcoxon (1945), doi:10.2307/3001968; as `scipy.stats.wilcoxon` 1.17, but for an exact p asked
    /// for in spite of ties, which is exact here (SciPy rounds the rank sum). Limits: the differences
    /// should be symmetric; in the approximation, at least ten.
    ///
    /// ```
    /// use teampulse_signal::statistics::Wilcoxon;
    /// let (before, after) = ([8.0, 7.0, 6.0, 9.0, 5.0], [6.5, 6.0, 6.5, 7.0, 2.0]);
    /// let result = Wilcoxon::default().paired(&before, &after)?;
    /// assert_eq!((result.w_plus, result.w_minus, result.p), (14.0, 1.0, 0.125));
    /// # Ok::<(), teampulse_signal::statistics::StatisticsError>(())
    /// ```
    pub fn paired(&self, first: &[f64], second: &[f64]) -> Result<SignedRank, StatisticsError> {
        self.differences(&differences(first, second, 1)?)
    }

    /// Tests differences against zero.
    pub fn differences(&self, differences: &[f64]) -> Result<SignedRank, StatisticsError> {
        checked(&[differences], 1, 1)?;
        let sums = Sums::of(differences, self.zeros).ok_or(StatisticsError::NoSpread)?;
        let (exact, continuity) = match self.method {
            WilcoxonMethod::Auto => (sums.worth_exact(differences.len()), 0.0),
            WilcoxonMethod::Exact => (true, 0.0),
            WilcoxonMethod::Normal => (false, 0.0),
            WilcoxonMethod::NormalWithContinuity => (false, 0.5),
        };
        if exact && sums.ranks.len() > MOST_EXACT {
            return Err(StatisticsError::TooMany { got: sums.ranks.len(), most: MOST_EXACT });
        }
        let z = (!exact).then(|| sums.z(continuity, self.alternative));
        let (less, greater) =
            z.map_or_else(|| sums.exact_tails(), |z| (normal_upper(-z), normal_upper(z)));
        Ok(SignedRank {
            w_plus: sums.plus,
            w_minus: sums.minus,
            p: self.alternative.of_tails(less, greater),
            z,
            exact,
            n_ranked: sums.n_ranked,
            n_zero: sums.n_zero,
            rank_biserial: (sums.plus - sums.minus) / (sums.plus + sums.minus),
        })
    }
}

/// The rank sums, and the ranks of what is not zero.
struct Sums {
    plus: f64,
    minus: f64,
    ranks: Vec<f64>,
    ties: f64,
    n_ranked: usize,
    n_zero: usize,
}

impl Sums {
    fn of(differences: &[f64], zeros: Zeros) -> Option<Sums> {
        let is_zero = |difference: f64| difference.abs() == 0.0;
        let kept: Vec<f64> = match zeros {
            Zeros::LeftOut => differences.iter().copied().filter(|&each| !is_zero(each)).collect(),
            Zeros::Ranked => differences.to_vec(),
        };
        let sizes: Vec<f64> = kept.iter().map(|each| each.abs()).collect();
        let all_ranks = average_ranks(&sizes);
        let ranked = || kept.iter().copied().zip(all_ranks.iter().copied());
        let nonzero: Vec<f64> = sizes.iter().copied().filter(|&each| !is_zero(each)).collect();
        let sum =
            |sign: f64| ranked().filter(|(each, _)| each * sign > 0.0).map(|(_, rank)| rank).sum();
        let ranks: Vec<f64> =
            ranked().filter(|&(each, _)| !is_zero(each)).map(|(_, rank)| rank).collect();
        let n_zero = differences.iter().filter(|&&each| is_zero(each)).count();
        let sums = Sums {
            plus: sum(1.0),
            minus: sum(-1.0),
            ranks,
            ties: tie_sum(&nonzero),
            n_ranked: kept.len(),
            n_zero,
        };
        (!sums.ranks.is_empty()).then_some(sums)
    }

    fn worth_exact(&self, n: usize) -> bool {
        let plain = self.ties == 0.0 && self.n_zero == 0;
        n <= if plain { EXACT_WITHOUT_TIES } else { EXACT_WITH_TIES }
    }

    fn z(&self, continuity: f64, alternative: Alternative) -> f64 {
        let ranked_zeros = (self.n_ranked - self.ranks.len()) as f64;
        let middle = |n: f64| n * (n + 1.0) / 4.0;
        let spread = |n: f64| n * (n + 1.0) * (2.0 * n + 1.0);
        let n = self.n_ranked as f64;
        let variance = (spread(n) - spread(ranked_zeros) - self.ties / 2.0) / 24.0;
        let off = self.plus - (middle(n) - middle(ranked_zeros));
        let towards = match alternative {
            Alternative::TwoSided if off == 0.0 => 0.0,
            Alternative::TwoSided => off.signum(),
            Alternative::Less => -1.0,
            Alternative::Greater => 1.0,
        };
        (off - towards * continuity) / variance.sqrt()
    }

    /// P(W₊ ≤ w) and P(W₊ ≥ w) over all signs. Ranks are halves at the finest, so twice a sum is whole.
    fn exact_tails(&self) -> (f64, f64) {
        let doubled: Vec<usize> = self.ranks.iter().map(|rank| (2.0 * rank) as usize).collect();
        let total: usize = doubled.iter().sum();
        let mut share = vec![0.0; total + 1];
        share[0] = 1.0;
        let mut reached = 0;
        for rank in doubled {
            reached += rank;
            for sum in (0..=reached).rev() {
                let with = if sum >= rank { share[sum - rank] } else { 0.0 };
                share[sum] = f64::midpoint(share[sum], with);
            }
        }
        let at = (2.0 * self.plus) as usize;
        (share[..=at].iter().sum(), share[at..].iter().sum())
    }
}
