use std::fmt;
use std::str::FromStr;

use super::FieldError;

/// The path from a message to one of its values: `status[0].values[2].value`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Path(Vec<Step>);

/// A step of a path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// The field.
    pub field: String,
    /// The index of the value, starting at 0; `None` for a field with a single value.
    pub index: Option<u64>,
}

impl Path {
    /// The steps, from the outermost inwards; there is at least one.
    pub fn steps(&self) -> &[Step] {
        &self.0
    }
}

impl FromStr for Path {
    type Err = FieldError;

    fn from_str(text: &str) -> Result<Path, FieldError> {
        let steps = text.split('.').map(step).collect::<Option<Vec<_>>>();
        steps.map(Path).ok_or_else(|| FieldError::Path(text.to_owned()))
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, Step { field, index }) in self.0.iter().enumerate() {
            let dot = if k == 0 { "" } else { "." };
            write!(f, "{dot}{field}")?;
            if let Some(index) = index {
                write!(f, "[{index}]")?;
            }
        }
        Ok(())
    }
}

fn step(text: &str) -> Option<Step> {
    let (field, index) = match text.strip_suffix(']').map(|rest| rest.split_once('[')) {
        Some(bracket) => bracket.map(|(field, index)| (field, Some(index)))?,
        None => (text, None),
    };
    let index = match index {
        Some(digits) if digits.bytes().all(|byte| byte.is_ascii_digit()) => {
            Some(digits.parse().ok()?)
        }
        Some(_) => return None,
        None => None,
    };
    let is_name = !field.is_empty() && field.chars().all(|c| c.is_alphanumeric() || c == '_');
    is_name.then(|| Step { field: field.to_owned(), index })
}
