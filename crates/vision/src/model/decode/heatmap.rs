//! Keypoints as heatmaps: 1 × K × rows × columns. A point is the centroid of the values around the maximum.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Decode, DecodeError, Found, Point, Tensor, misshaped, of_points, output};

/// The settings of heatmaps.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Heatmap {
    /// The names of the points.
    pub names: Vec<String>,
    /// The radius around the maximum within which values are included [cells].
    #[serde(default = "radius")]
    pub radius: usize,
    /// The name of the output. By default the first one.
    #[serde(default)]
    pub output: Option<String>,
}

fn radius() -> usize {
    2
}

impl Decode for Heatmap {
    fn decode(&self, outputs: &[Tensor], size: [usize; 2]) -> Result<Found, DecodeError> {
        let tensor = output(outputs, self.output.as_deref(), 0)?;
        let sides: &[usize] = match tensor.shape.as_slice() {
            [1, sides @ ..] if sides.len() == 3 => sides,
            sides => sides,
        };
        let &[count, rows, columns] = sides else {
            return Err(misshaped(tensor, "1 × points × rows × columns"));
        };
        if count != self.names.len() || rows * columns == 0 {
            return Err(misshaped(tensor, format!("1 × {} × rows × columns", self.names.len())));
        }
        let cells = [size[0] as f32 / columns as f32, size[1] as f32 / rows as f32];
        let maps = tensor.values.chunks_exact(rows * columns);
        Ok(Found::Points(maps.map(|map| self.point(map, columns, cells)).collect()))
    }

    fn channels(&self) -> Vec<(String, &'static str)> {
        of_points(&self.names)
    }
}

impl Heatmap {
    /// Returns the point of a map with cells of this size [px].
    fn point(&self, map: &[f32], columns: usize, cells: [f32; 2]) -> Point {
        let finite = map.iter().enumerate().filter(|(_, value)| value.is_finite());
        let Some((highest, score)) = finite.max_by(|a, b| a.1.total_cmp(b.1)) else {
            return Point { place: [f32::NAN; 2], score: f32::NAN };
        };
        let (row, column) = (highest / columns, highest % columns);
        let around = |place: usize, end: usize| {
            place.saturating_sub(self.radius)..place.saturating_add(self.radius + 1).min(end)
        };
        let (mut sum, mut x, mut y) = (0.0, 0.0, 0.0);
        for each in around(row, map.len() / columns) {
            for other in around(column, columns) {
                let value = map[each * columns + other].max(0.0);
                if value.is_finite() {
                    sum += value;
                    x += value * other as f32;
                    y += value * each as f32;
                }
            }
        }
        let centre = if sum > 0.0 { [x / sum, y / sum] } else { [column as f32, row as f32] };
        let place = [0, 1].map(|axis| (centre[axis] + 0.5) * cells[axis] - 0.5);
        Point { place, score: *score }
    }
}
