//! Keypoints as MoveNet outputs them: 1 × 1 × K × 3, each with y and x as fractions of the sides, and a score.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Decode, DecodeError, Found, Point, Tensor, misshaped, of_points, output};

/// The settings of MoveNet's points.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Movenet {
    /// The names of the points.
    pub names: Vec<String>,
}

impl Decode for Movenet {
    fn decode(&self, outputs: &[Tensor], size: [usize; 2]) -> Result<Found, DecodeError> {
        let tensor = output(outputs, None, 0)?;
        let (points, rest) = tensor.values.as_chunks::<3>();
        if points.len() != self.names.len() || !rest.is_empty() {
            return Err(misshaped(tensor, format!("1 × 1 × {} × 3", self.names.len())));
        }
        let point = |[y, x, score]: &[f32; 3]| Point {
            place: [x * size[0] as f32 - 0.5, y * size[1] as f32 - 0.5],
            score: *score,
        };
        Ok(Found::Points(points.iter().map(point).collect()))
    }

    fn channels(&self) -> Vec<(String, &'static str)> {
        of_points(&self.names)
    }
}
