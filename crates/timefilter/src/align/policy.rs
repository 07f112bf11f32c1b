//! How a stream's value at a given time is computed from its samples.

use std::fmt;
use std::str::FromStr;

use super::error::AlignError;

/// The longest duration in a policy or in the settings of a source: one day [ns].
pub const LONGEST_NANOS: i64 = 86_400 * SECOND_NANOS;
const SECOND_NANOS: i64 = 1_000_000_000;
const MILLISECOND_NANOS: i64 = 1_000_000;

/// How a stream's value at a given time is computed from its samples.
///
/// In settings and command lines: `exact`, `nearest:20ms`, `hold:2s`, `linear:0.5s`, `mean:1s`, and `min`,
/// `max`, `last`, `count` like `mean`.
///
/// ```
/// use teampulse_timefilter::align::Policy;
///
/// let policy: Policy = "linear:0.5s".parse()?;
/// assert_eq!(policy, Policy::Linear { max_gap_nanos: 500_000_000 });
/// assert_eq!(policy.to_string(), "linear:500ms");
/// let error = "spline:1s".parse::<Policy>().unwrap_err();
/// assert!(error.to_string().contains("got `spline:1s`"));
/// # Ok::<(), teampulse_timefilter::align::AlignError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Policy {
    /// The sample measured at exactly this nanosecond.
    Exact,
    /// The sample measured closest to this time, the earlier one of a tie.
    Nearest {
        /// The largest distance [ns, 0 to a day].
        tolerance_nanos: i64,
    },
    /// The last sample measured at or before this time.
    Hold {
        /// The largest age at which it is held rather than stale [ns, 0 to a day].
        max_age_nanos: i64,
    },
    /// Linear interpolation between the samples before and after.
    Linear {
        /// The longest gap between those [ns, 0 to a day].
        max_gap_nanos: i64,
    },
    /// An aggregate of all samples in the window that ends at this time: those measured in (t − length, t].
    Window {
        /// The length of the window [ns, 1 to a day].
        length_nanos: i64,
        /// The aggregate.
        aggregate: Aggregate,
    },
}

/// The aggregate of a window, channel by channel; NaN values are skipped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Aggregate {
    /// The arithmetic mean.
    Mean,
    /// The smallest value.
    Min,
    /// The largest value.
    Max,
    /// The newest value.
    Last,
    /// The number of values; zero is a valid result.
    Count,
}

impl Policy {
    /// Checks that the durations of the policy are in range.
    pub(super) fn checked(self) -> Result<Policy, AlignError> {
        let (least_nanos, got_nanos) = match self {
            Policy::Exact => return Ok(self),
            Policy::Nearest { tolerance_nanos } => (0, tolerance_nanos),
            Policy::Hold { max_age_nanos } => (0, max_age_nanos),
            Policy::Linear { max_gap_nanos } => (0, max_gap_nanos),
            Policy::Window { length_nanos, .. } => (1, length_nanos),
        };
        let in_range = (least_nanos..=LONGEST_NANOS).contains(&got_nanos);
        if in_range {
            Ok(self)
        } else {
            Err(AlignError::Time { what: "policy", least_nanos, got_nanos })
        }
    }

    fn word(self) -> &'static str {
        match self {
            Policy::Exact => "exact",
            Policy::Nearest { .. } => "nearest",
            Policy::Hold { .. } => "hold",
            Policy::Linear { .. } => "linear",
            Policy::Window { aggregate: Aggregate::Mean, .. } => "mean",
            Policy::Window { aggregate: Aggregate::Min, .. } => "min",
            Policy::Window { aggregate: Aggregate::Max, .. } => "max",
            Policy::Window { aggregate: Aggregate::Last, .. } => "last",
            Policy::Window { aggregate: Aggregate::Count, .. } => "count",
        }
    }

    fn nanos(self) -> Option<i64> {
        match self {
            Policy::Exact => None,
            Policy::Nearest { tolerance_nanos: nanos }
            | Policy::Hold { max_age_nanos: nanos }
            | Policy::Linear { max_gap_nanos: nanos }
            | Policy::Window { length_nanos: nanos, .. } => Some(nanos),
        }
    }
}

impl fmt::Display for Policy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())?;
        match self.nanos() {
            None => Ok(()),
            Some(nanos) if nanos % SECOND_NANOS == 0 => write!(f, ":{}s", nanos / SECOND_NANOS),
            Some(nanos) => write!(f, ":{}ms", nanos as f64 / MILLISECOND_NANOS as f64),
        }
    }
}

impl FromStr for Policy {
    type Err = AlignError;

    fn from_str(text: &str) -> Result<Policy, AlignError> {
        let unknown = || AlignError::Policy { got: text.chars().take(64).collect() };
        if text == "exact" {
            return Ok(Policy::Exact);
        }
        let (word, time) = text.split_once(':').ok_or_else(unknown)?;
        let nanos = nanos_from(time).ok_or_else(unknown)?;
        let window = |aggregate| Policy::Window { length_nanos: nanos, aggregate };
        let policy = match word {
            "nearest" => Policy::Nearest { tolerance_nanos: nanos },
            "hold" => Policy::Hold { max_age_nanos: nanos },
            "linear" => Policy::Linear { max_gap_nanos: nanos },
            "mean" => window(Aggregate::Mean),
            "min" => window(Aggregate::Min),
            "max" => window(Aggregate::Max),
            "last" => window(Aggregate::Last),
            "count" => window(Aggregate::Count),
            _ => return Err(unknown()),
        };
        policy.checked()
    }
}

/// Parses a duration such as `0.5s` or `20ms` [ns].
fn nanos_from(text: &str) -> Option<i64> {
    let (number, unit_nanos) = match text.strip_suffix("ms") {
        Some(number) => (number, MILLISECOND_NANOS),
        None => (text.strip_suffix('s')?, SECOND_NANOS),
    };
    let number: f64 = number.parse().ok()?;
    number.is_finite().then_some((number * unit_nanos as f64).round() as i64)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const WORDS: [&str; 8] = ["nearest", "hold", "linear", "mean", "min", "max", "last", "count"];

    #[test]
    fn an_invalid_policy_is_reported_with_the_expected_form() {
        for text in ["", "exact:1s", "linear", "linear:", "linear:1", "linear:xs", "hold:infs"] {
            let error = text.parse::<Policy>().expect_err(text).to_string();
            assert!(error.contains("expected") && error.contains(text), "{error}");
        }
        for text in ["hold:-1s", "mean:0s", "linear:2000000s"] {
            let error = text.parse::<Policy>().expect_err(text).to_string();
            assert!(error.contains("at most one day"), "{error}");
        }
    }

    proptest! {
        #[test]
        fn a_policy_reads_back_as_it_was_written(
            word in prop::sample::select(&WORDS[..]),
            nanos in 1..=LONGEST_NANOS,
        ) {
            let policy: Policy = format!("{word}:{}ms", nanos as f64 / 1e6).parse()?;
            prop_assert_eq!(policy.nanos(), Some(nanos));
            prop_assert_eq!(policy.to_string().parse::<Policy>()?, policy);
        }

        #[test]
        fn no_text_makes_it_panic(text in any::<String>(), word in prop::sample::select(&WORDS[..])) {
            drop(text.parse::<Policy>());
            drop(format!("{word}:{text}s").parse::<Policy>());
        }
    }
}
