//! Statistics of a group (paired comparisons, several conditions, trends, and confidence intervals), and of
//! one participant against the baseline.
//!
//! For a group, every function takes one value per participant and condition, never the samples within:
//! those depend on each other, and thousands of them make any difference "significant". Participants with
//! missing values are left out with [`complete_rows`], which reports how many; the tests themselves accept
//! finite numbers only. Each agrees with SciPy 1.17, pingouin 0.7 or statsmodels 0.15 to 1e-9, as named in
//! its documentation.

mod error;
mod complete;
mod ranks;
mod distributions;
mod mean_interval;
mod baseline;
mod comparison;
mod t_test;
mod wilcoxon;
mod effect_size;
mod bootstrap;
mod normality;
mod friedman;
mod repeated_measures;
mod page;
mod pairwise;
mod multiple;
mod correlation;

pub use baseline::{
    BaselineChange, StandardisedDifference, baseline_change, effective_count,
    standardised_difference,
};
pub use bootstrap::{Bootstrap, BootstrapInterval, bootstrap};
pub use comparison::Comparison;
pub use complete::{CompleteRows, complete_rows};
pub use correlation::{Correlation, pearson, spearman};
pub use distributions::Alternative;
pub use effect_size::{cohen_d_average, cohen_dz, hedges_correction, hedges_gz};
pub use error::StatisticsError;
pub use friedman::{Friedman, friedman};
pub use mean_interval::{Interval, mean_interval};
pub use multiple::{Correction, corrected};
pub use normality::{ShapiroWilk, shapiro_wilk};
pub use page::{Page, PageMethod, page_trend};
pub use pairwise::{Pair, pairwise_t, pairwise_wilcoxon};
pub use ranks::average_ranks;
pub use repeated_measures::{Mauchly, RepeatedMeasures, repeated_measures};
pub use t_test::{TTest, one_sample_t, paired_t};
pub use wilcoxon::{SignedRank, Wilcoxon, WilcoxonMethod, Zeros};
