//! Points with their columns and rows classified apart, as RTMPose gives them (Li et al. 2022, SimCC,
//! arXiv:2107.03332): 1 × K × columns and 1 × K × rows, several classes a pixel.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Decode, DecodeError, Found, Point, Tensor, misshaped, of_points, output};

/// The settings of points whose columns and rows are classified.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Simcc {
    /// The names of the points.
    pub names: Vec<String>,
    /// The output of the columns. Without it, the first.
    #[serde(default)]
    pub columns: Option<String>,
    /// The output of the rows. Without it, the second.
    #[serde(default)]
    pub rows: Option<String>,
}

impl Decode for Simcc {
    fn decode(&self, outputs: &[Tensor], size: [usize; 2]) -> Result<Found, DecodeError> {
        let columns = output(outputs, self.columns.as_deref(), 0)?;
        let rows = output(outputs, self.rows.as_deref(), 1)?;
        let (across, down) = (self.along(columns, size[0])?, self.along(rows, size[1])?);
        let point = |((x, in_x), (y, in_y)): ((f32, f32), (f32, f32))| {
            // The less certain of both, as mmpose takes it.
            Point { place: [x, y], score: in_x.min(in_y) }
        };
        Ok(Found::Points(across.into_iter().zip(down).map(point).collect()))
    }

    fn channels(&self) -> Vec<(String, &'static str)> {
        of_points(&self.names)
    }
}

impl Simcc {
    /// The most probable places along one side [px], with their scores.
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
