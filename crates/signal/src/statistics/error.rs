use thiserror::Error;

/// Why a statistic could not be computed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StatisticsError {
    /// There are too few values.
    #[error("compute a result from {got} values: at least {need} are needed")]
    TooFew {
        /// The number of values given.
        got: usize,
        /// The number of values needed.
        need: usize,
    },
    /// There are too many values for an exact result.
    #[error("compute an exact result from {got} values: at most {most} are supported")]
    TooMany {
        /// The number of values given.
        got: usize,
        /// The largest number supported.
        most: usize,
    },
    /// Paired columns differ in length.
    #[error("pair {first} values with {other}")]
    UnequalLengths {
        /// The length of the first column.
        first: usize,
        /// The length of a column that differs.
        other: usize,
    },
    /// A value is NaN or infinite.
    #[error("compute with a value that is missing or not finite")]
    NotFinite,
    /// All values are equal, or all differences zero.
    #[error("compare values that do not vary")]
    NoSpread,
    /// The values are so large or so small that the result is not finite.
    #[error("compute with values that are too large or too small")]
    OutOfRange,
    /// A setting is out of range.
    #[error("use {value} as {name}, expected {expected}")]
    Setting {
        /// The name of the setting.
        name: &'static str,
        /// The value given.
        value: f64,
        /// The values allowed.
        expected: &'static str,
    },
}

/// Returns the columns, checked to be finite, of equal length, and at least as many and as long as needed.
pub(super) fn checked<'a, 'b>(
    columns: &'a [&'b [f64]],
    least_columns: usize,
    least_rows: usize,
) -> Result<&'a [&'b [f64]], StatisticsError> {
    if columns.len() < least_columns {
        return Err(StatisticsError::TooFew { got: columns.len(), need: least_columns });
    }
    let first = columns.first().map_or(0, |column| column.len());
    if let Some(odd) = columns.iter().find(|column| column.len() != first) {
        return Err(StatisticsError::UnequalLengths { first, other: odd.len() });
    }
    if first < least_rows {
        return Err(StatisticsError::TooFew { got: first, need: least_rows });
    }
    let all_finite = columns.iter().all(|column| column.iter().all(|value| value.is_finite()));
    if all_finite { Ok(columns) } else { Err(StatisticsError::NotFinite) }
}

/// The differences first − second of two paired columns.
pub(super) fn differences(
    first: &[f64],
    second: &[f64],
    least: usize,
) -> Result<Vec<f64>, StatisticsError> {
    checked(&[first, second], 2, least)?;
    let differences: Vec<f64> = first.iter().zip(second).map(|(a, b)| a - b).collect();
    finite_or(&differences, StatisticsError::OutOfRange)?;
    Ok(differences)
}

/// Returns the error if one of the results is not finite.
pub(super) fn finite_or(results: &[f64], error: StatisticsError) -> Result<(), StatisticsError> {
    if results.iter().all(|each| each.is_finite()) { Ok(()) } else { Err(error) }
}

/// Returns a confidence level, checked to be between 0 and 1.
pub(super) fn checked_level(level: f64) -> Result<f64, StatisticsError> {
    let expected = "more than 0 and less than 1";
    let error = StatisticsError::Setting { name: "level", value: level, expected };
    if level > 0.0 && level < 1.0 { Ok(level) } else { Err(error) }
}
