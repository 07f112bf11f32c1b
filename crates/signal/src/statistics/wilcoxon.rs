use super::distributions::{Alternative, normal_upper};
use super::error::{StatisticsError, checked, differences};
use super::ranks::{average_ranks, tie_sum};

/// The most differences for an exact p-value, whose time is cubic.
const MOST_EXACT: usize = 500;

/// The most distinct differences for which `Auto` is exact, as in SciPy.
const EXACT_WITHOUT_TIES: usize = 50;

/// The most differences with ties or zeros for which `Auto` is exact, as in SciPy.
const EXACT_WITH_TIES: usize = 13;

/// The treatment of zero differences.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Zeros {
    /// Zeros are left out. Wilcoxon (1945), doi:10.2307/3001968.
    #[default]
    LeftOut,
    /// Zeros are ranked, but are part of neither sum. Pratt (1959), doi:10.1080/01621459.1959.10501526.
    Ranked,
}

/// The computation of the p-value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum WilcoxonMethod {
    /// The method that SciPy chooses: exact up to 50 pairs without ties and zeros and up to 13 with them, else normal.
    #[default]
    Auto,
    /// Exact, from all assignments of signs to the ranks, ties included; up to 500 pairs.
    Exact,
    /// The normal approximation, corrected for ties.
    Normal,
    /// The normal approximation with continuity correction.
    NormalWithContinuity,
}

/// Settings of Wilcoxon's signed-rank test; the default is that of `scipy.stats.wilcoxon`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Wilcoxon {
    /// The alternative hypothesis.
    pub alternative: Alternative,
    /// The treatment of zero differences.
    pub zeros: Zeros,
    /// The computation of the p-value.
    pub method: WilcoxonMethod,
}

/// The result of Wilcoxon's signed rank test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedRank {
    /// The sum of the ranks of positive differences.
    pub w_plus: f64,
    /// The sum of the ranks of negative differences. SciPy prints the smaller of the two when two-sided.
    pub w_minus: f64,
    /// The p-value [0..1].
    pub p: f64,
    /// The normal statistic; `None` when exact.
    pub z: Option<f64>,
    /// Whether `p` is exact.
    pub exact: bool,
    /// The number of differences ranked.
    pub n_ranked: usize,
    /// The number of zero differences.
    pub n_zero: usize,
    /// The matched-pairs rank-biserial correlation, (W₊ − W₋)/(W₊ + W₋) [−1..1]. Kerby (2014), doi:10.2466/11.IT.3.1.
    pub rank_biserial: f64,
}

impl Wilcoxon {
    /// Tests the differences `first` − `second` of paired values.
    ///
    /// Wilcoxon (1945), doi:10.2307/3001968; as `scipy.stats.wilcoxon` 1.17, except for an exact p
    /// requested with ties, which is exact here (SciPy rounds the rank sum). Limits: the differences should
    /// be symmetric; the approximation needs at least ten.
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

/// The rank sums, and the ranks of the non-zero differences.
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

    /// P(W₊ ≤ w) and P(W₊ ≥ w) over all signs. Ranks are multiples of ½, so twice a sum is an integer.
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
