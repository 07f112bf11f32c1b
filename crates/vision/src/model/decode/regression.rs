//! Plain numbers: valence and arousal, intensities of action units, a heart rate.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Decode, DecodeError, Found, Tensor, misshaped, output};

/// The settings of plain numbers.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Regression {
    /// The names of the numbers.
    pub names: Vec<String>,
    /// The index of the first of these numbers in the output, from 0; those before and after are ignored.
    #[serde(default)]
    pub first: usize,
    /// The name of the output. By default the first one.
    #[serde(default)]
    pub output: Option<String>,
}

impl Decode for Regression {
    fn decode(&self, outputs: &[Tensor], _: [usize; 2]) -> Result<Found, DecodeError> {
        let tensor = output(outputs, self.output.as_deref(), 0)?;
        let wanted = tensor.values.iter().skip(self.first).take(self.names.len());
        let values: Vec<f64> = wanted.map(|value| f64::from(*value)).collect();
        if values.len() != self.names.len() {
            let needed = self.first.saturating_add(self.names.len());
            return Err(misshaped(tensor, format!("at least {needed} numbers")));
        }
        Ok(Found::Values(values))
    }

    fn channels(&self) -> Vec<(String, &'static str)> {
        self.names.iter().map(|name| (name.clone(), "1")).collect()
    }
}
