use statrs::distribution::{ContinuousCDF, Normal, StudentsT};
use statrs::function::beta::checked_beta_reg;
use statrs::function::erf::erfc;
use statrs::function::gamma::checked_gamma_ur;

/// The alternative hypothesis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Alternative {
    /// A difference in either direction.
    #[default]
    TwoSided,
    /// The first condition is smaller than the second.
    Less,
    /// The first condition is greater than the second.
    Greater,
}

impl Alternative {
    /// The p-value from the two tail probabilities.
    pub(super) fn of_tails(self, less: f64, greater: f64) -> f64 {
        match self {
            Alternative::TwoSided => (2.0 * less.min(greater)).min(1.0),
            Alternative::Less => less,
            Alternative::Greater => greater,
        }
    }
}

/// P(T ≥ t) of Student's distribution; NaN where undefined.
pub(super) fn t_upper(t: f64, df: f64) -> f64 {
    let both = checked_beta_reg(df / 2.0, 0.5, df / (df + t * t)).unwrap_or(f64::NAN);
    if t >= 0.0 { both / 2.0 } else { 1.0 - both / 2.0 }
}

/// The p-value of `t`.
pub(super) fn t_p(t: f64, df: f64, alternative: Alternative) -> f64 {
    alternative.of_tails(t_upper(-t, df), t_upper(t, df))
}

/// The quantile of Student's distribution; NaN where undefined.
pub(super) fn t_quantile(p: f64, df: f64) -> f64 {
    StudentsT::new(0.0, 1.0, df).map_or(f64::NAN, |t| t.inverse_cdf(p))
}

/// P(F ≥ f) of the F distribution; NaN where undefined.
pub(super) fn f_upper(f: f64, df_above: f64, df_below: f64) -> f64 {
    let share = df_below / (df_below + df_above * f);
    checked_beta_reg(df_below / 2.0, df_above / 2.0, share).unwrap_or(f64::NAN)
}

/// P(χ² ≥ x); NaN where undefined.
pub(super) fn chi2_upper(x: f64, df: f64) -> f64 {
    if x <= 0.0 { 1.0 } else { checked_gamma_ur(df / 2.0, x / 2.0).unwrap_or(f64::NAN) }
}

/// P(Z ≥ z) of the standard normal distribution.
pub(super) fn normal_upper(z: f64) -> f64 {
    erfc(z / std::f64::consts::SQRT_2) / 2.0
}

/// The quantile of the standard normal distribution.
pub(super) fn normal_quantile(p: f64) -> f64 {
    Normal::standard().inverse_cdf(p)
}
