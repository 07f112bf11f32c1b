//! Class probabilities: 1 × C.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Decode, DecodeError, Found, Tensor, misshaped, output};

/// The settings of classes.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Classes {
    /// The names of the classes.
    pub labels: Vec<String>,
    /// Whether the output already holds probabilities. If not, softmax is applied.
    #[serde(default)]
    pub is_probability: bool,
    /// The name of the output. By default the first one.
    #[serde(default)]
    pub output: Option<String>,
}

impl Decode for Classes {
    fn decode(&self, outputs: &[Tensor], _: [usize; 2]) -> Result<Found, DecodeError> {
        let tensor = output(outputs, self.output.as_deref(), 0)?;
        if tensor.values.len() != self.labels.len() {
            return Err(misshaped(tensor, format!("1 × {}", self.labels.len())));
        }
        let scores = tensor.values.iter().map(|score| f64::from(*score));
        Ok(Found::Values(if self.is_probability {
            scores.collect()
        } else {
            softmax(scores.collect())
        }))
    }

    fn channels(&self) -> Vec<(String, &'static str)> {
        self.labels.iter().map(|label| (label.clone(), "1")).collect()
    }
}

/// Returns the softmax of scores.
fn softmax(scores: Vec<f64>) -> Vec<f64> {
    let highest = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let powers: Vec<f64> = scores.into_iter().map(|score| (score - highest).exp()).collect();
    let sum: f64 = powers.iter().sum();
    powers.into_iter().map(|power| power / sum).collect()
}
