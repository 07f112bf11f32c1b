//! Keypoints with their columns and rows classified separately, as RTMPose outputs them (Li et al. 2022, SimCC,
//! arXiv:2107.03332): 1 × K × columns and 1 × K × rows, several classes per pixel.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Decode, DecodeError, Found, Point, Tensor, misshaped, of_points, output};

/// The settings of SimCC keypoints.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Simcc {
    /// The names of the points.
    pub names: Vec<String>,
    /// The name of the output for columns. By default the first one.
    #[serde(default)]
    pub columns: Option<String>,
    /// The name of the output for rows. By default the second one.
    #[serde(default)]
    pub rows: Option<String>,
}

impl Decode for Simcc {
    fn decode(&self, outputs: &[Tensor], size: [usize; 2]) -> Result<Found, DecodeError> {
        let columns = output(outputs, self.columns.as_deref(), 0)?;
        let rows = output(outputs, self.rows.as_deref(), 1)?;
        let (across, down) = (self.along(columns, size[0])?, self.along(rows, size[1])?);
        let point = |((x, in_x), (y, in_y)): ((f32, f32), (f32, f32))| {
            // The lower of the two scores, as in mmpose.
            Point { place: [x, y], score: in_x.min(in_y) }
        };
        Ok(Found::Points(across.into_iter().zip(down).map(point).collect()))
    }

    fn channels(&self) -> Vec<(String, &'static str)> {
        of_points(&self.names)
    }
}

impl Simcc {
    /// Returns the most probable positions along one side [px], with their scores.
    fn along(&self, tensor: &Tensor, side: usize) -> Result<Vec<(f32, f32)>, DecodeError> {
        let count = self.names.len();
        let bins = match tensor.shape.as_slice() {
            [1, points, bins] if *points == count && *bins > 0 => *bins,
            _ => return Err(misshaped(tensor, format!("1 × {count} × classes"))),
        };
        let bin = side as f32 / bins as f32;
        let place = |scores: &[f32]| {
            let highest = scores.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
            highest.map_or((f32::NAN, f32::NAN), |(place, score)| (place as f32 * bin, *score))
        };
        Ok(tensor.values.chunks_exact(bins).map(place).collect())
    }
}
