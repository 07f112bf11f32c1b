//! Points as numbers in a row: x, y and others of each, as MediaPipe's landmark models give them.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Decode, DecodeError, Found, Point, Tensor, misshaped, of_points, output};
use crate::model::tensor::sigmoid;

/// The settings of points as numbers in a row.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Points {
    /// The names of the points. The model may give more; those are left out.
    pub names: Vec<String>,
    /// How many numbers a point has; x and y are the first two.
    #[serde(default = "two")]
    pub stride: usize,
    /// Whether x and y are fractions of the input's sides, not pixels.
    #[serde(default)]
    pub is_fraction: bool,
    /// Which number of a point is its score, from 0. Without it, the score is 1.
    #[serde(default)]
    pub score: Option<usize>,
    /// Whether that number becomes a probability by the logistic function.
    #[serde(default)]
    pub is_logistic: bool,
    /// The output's name. Without it, the first.
    #[serde(default)]
    pub output: Option<String>,
}

fn two() -> usize {
    2
}

impl Decode for Points {
    fn decode(&self, outputs: &[Tensor], size: [usize; 2]) -> Result<Found, DecodeError> {
        let tensor = output(outputs, self.output.as_deref(), 0)?;
        let needed = self.names.len() * self.stride;
        if tensor.values.len() < needed || tensor.values.len() % self.stride != 0 {
            return Err(misshaped(tensor, format!("{needed} numbers, {} a point", self.stride)));
        }
        let points = tensor.values.chunks_exact(self.stride).take(self.names.len());
        Ok(Found::Points(points.map(|numbers| self.point(numbers, size)).collect()))
    }

    fn channels(&self) -> Vec<(String, &'static str)> {
        of_points(&self.names)
    }

    fn wrong(&self) -> Option<String> {
        let is_wrong = !(2..=64).contains(&self.stride)
            || self.score.is_some_and(|place| place >= self.stride);
        is_wrong.then(|| "`stride` has to be from 2 to 64, and `score` below it".to_owned())
    }
}

impl Points {
    fn point(&self, numbers: &[f32], size: [usize; 2]) -> Point {
        let place = [0, 1].map(|axis| {
            if self.is_fraction { numbers[axis] * size[axis] as f32 - 0.5 } else { numbers[axis] }
        });
        let score = self.score.map_or(1.0, |place| numbers[place]);
        Point { place, score: if self.is_logistic { sigmoid(score) } else { score } }
    }
}
