use super::distributions::normal_upper;
use super::error::{StatisticsError, checked};
use super::friedman::{rank_sums, rows};

/// The most conditions for an exact p-value, which enumerates their orders.
const MOST_CONDITIONS: usize = 8;

/// The most cells for an exact p-value.
const MOST_EXACT: usize = 2000;

/// The computation of the p-value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum PageMethod {
    /// The method that SciPy chooses: exact with up to eight conditions and 12 participants (20 with three conditions),
    /// else normal.
    #[default]
    Auto,
    /// Exact, from all orders of the ranks, for up to eight conditions; conservative with ties.
    Exact,
    /// From the normal approximation.
    Normal,
}

/// The result of Page's test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Page {
    /// Page's L: the sum of position times rank sum over the conditions.
    pub l: f64,
    /// The one-sided p-value [0..1].
    pub p: f64,
    /// Whether `p` is exact.
    pub exact: bool,
}

/// Page's test of a trend: whether values rise along the conditions (columns, one row per participant).
///
/// For falling values reverse the columns. Page (1963), doi:10.1080/01621459.1963.10500843; as
/// `scipy.stats.page_trend_test`. Limits: the order must be predicted, not taken from the data.
///
/// ```
/// use teampulse_signal::statistics::{PageMethod, page_trend};
/// let heart_rates: [&[f64]; 3] = [&[61.0, 70.0, 66.0], &[64.0, 72.0, 65.0], &[70.0, 80.0, 71.0]];
/// assert_eq!(page_trend(&heart_rates, PageMethod::Auto)?.l, 41.0);
/// # Ok::<(), teampulse_signal::statistics::StatisticsError>(())
/// ```
pub fn page_trend(conditions: &[&[f64]], method: PageMethod) -> Result<Page, StatisticsError> {
    checked(conditions, 3, 2)?;
    let (n, k) = (conditions[0].len(), conditions.len());
    let sums = rank_sums(&rows(conditions));
    let l = sums.iter().zip(1..).map(|(sum, place)| sum * f64::from(place)).sum();
    let exact = match method {
        PageMethod::Auto => k <= MOST_CONDITIONS && n <= if k == 3 { 20 } else { 12 },
        PageMethod::Exact => true,
        PageMethod::Normal => false,
    };
    if exact && k > MOST_CONDITIONS {
        return Err(StatisticsError::TooMany { got: k, most: MOST_CONDITIONS });
    }
    if exact && n * k > MOST_EXACT {
        return Err(StatisticsError::TooMany { got: n * k, most: MOST_EXACT });
    }
    let p = if exact { exact_upper(l, n, k) } else { normal_upper(z(l, n as f64, k as f64)) };
    Ok(Page { l, p, exact })
}

fn z(l: f64, n: f64, k: f64) -> f64 {
    let middle = n * k * (k + 1.0).powi(2) / 4.0;
    let variance = n * k * k * (k + 1.0) * (k * k - 1.0) / 144.0;
    (l - middle) / variance.sqrt()
}

/// P(L ≥ l), by convolving the distribution of one participant `n` times.
fn exact_upper(l: f64, n: usize, k: usize) -> f64 {
    let one = one_participant(k);
    let mut all = vec![1.0];
    for _ in 0..n {
        let mut next = vec![0.0; all.len() + one.len() - 1];
        for (at, share) in all.iter().enumerate() {
            for (slot, of_one) in next[at..].iter_mut().zip(&one) {
                *slot += share * of_one;
            }
        }
        all = next;
    }
    let above_least = (l.floor() as usize).saturating_sub(n * least(k));
    all.iter().skip(above_least).sum::<f64>().min(1.0)
}

/// The smallest L of one participant, with all ranks reversed.
fn least(k: usize) -> usize {
    k * (k + 1) * (k + 2) / 6
}

/// The distribution of one participant's L, from the smallest.
fn one_participant(k: usize) -> Vec<f64> {
    let greatest = k * (k + 1) * (2 * k + 1) / 6;
    let mut counts = vec![0.0; greatest - least(k) + 1];
    count_orders(k, &mut vec![false; k], 0, &mut |l| counts[l - least(k)] += 1.0);
    let orders: f64 = counts.iter().sum();
    counts.iter().map(|count| count / orders).collect()
}

/// Reports L for each assignment of the remaining ranks.
fn count_orders(remaining: usize, given: &mut [bool], l: usize, report: &mut impl FnMut(usize)) {
    if remaining == 0 {
        return report(l);
    }
    for rank in 0..given.len() {
        if !given[rank] {
            given[rank] = true;
            count_orders(remaining - 1, given, l + remaining * (rank + 1), report);
            given[rank] = false;
        }
    }
}
