//! Keypoints as a flat array of numbers: x, y and others for each, as in MediaPipe's landmark models.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Decode, DecodeError, Found, Point, Tensor, misshaped, of_points, output};
use crate::model::tensor::sigmoid;

/// The settings of keypoints as a flat array.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Points {
    /// The names of the points. Further points in the output are ignored.
    pub names: Vec<String>,
    /// The number of values per point; x and y are the first two.
    #[serde(default = "two")]
    pub stride: usize,
    /// Whether x and y are fractions of the input's sides, not pixels.
    #[serde(default)]
    pub is_fraction: bool,
    /// The index of the score among the values of a point, from 0. By default the score is 1.
    #[serde(default)]
    pub score: Option<usize>,
    /// Whether the logistic function converts the score to a probability.
    #[serde(default)]
    pub is_logistic: bool,
    /// The name of the output. By default the first one.
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
            return Err(misshaped(tensor, format!("{needed} numbers, {} per point", self.stride)));
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
        is_wrong.then(|| "`stride` must be from 2 to 64, and `score` below it".to_owned())
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
