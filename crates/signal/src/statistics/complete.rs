use super::error::StatisticsError;

/// The rows of participants that have every value.
#[derive(Clone, Debug, PartialEq)]
pub struct CompleteRows {
    /// The columns, each with the complete rows only.
    pub columns: Vec<Vec<f64>>,
    /// The indices of the rows (participants) left out because a value was missing.
    pub left_out: Vec<usize>,
}

impl CompleteRows {
    /// The columns as slices, as the tests take them.
    pub fn columns(&self) -> Vec<&[f64]> {
        self.columns.iter().map(Vec::as_slice).collect()
    }
}

/// Selects the participants (rows) that have a finite value in every condition (column).
///
/// Report `left_out` with every result: dropping participants is a choice.
///
/// ```
/// use teampulse_signal::statistics::complete_rows;
/// let complete = complete_rows(&[&[1.0, 2.0, 3.0], &[4.0, f64::NAN, 6.0]])?;
/// assert_eq!(complete.columns, [[1.0, 3.0], [4.0, 6.0]]);
/// assert_eq!(complete.left_out, [1]);
/// # Ok::<(), teampulse_signal::statistics::StatisticsError>(())
/// ```
pub fn complete_rows(columns: &[&[f64]]) -> Result<CompleteRows, StatisticsError> {
    let rows = columns.first().map_or(0, |column| column.len());
    if let Some(odd) = columns.iter().find(|column| column.len() != rows) {
        return Err(StatisticsError::UnequalLengths { first: rows, other: odd.len() });
    }
    let is_complete = |&row: &usize| columns.iter().all(|column| column[row].is_finite());
    let (kept, left_out): (Vec<usize>, Vec<usize>) = (0..rows).partition(is_complete);
    let columns = columns.iter().map(|column| kept.iter().map(|&row| column[row]).collect());
    Ok(CompleteRows { columns: columns.collect(), left_out })
}
