//! The distance of the surface that a point of a picture shows.

use super::Depth;

/// The smallest share of the pixels of a patch that must have a distance.
const LEAST_FILLED: f64 = 0.25;
/// One in this many distances of a patch is left out at each end before their spread is measured.
const TAIL: usize = 10;

/// The pixels around a point whose distances are combined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// The number of columns, and of rows [px].
    pub side: u32,
    /// The largest spread of distances on one surface, without the nearest and the farthest tenth [m].
    pub most_spread_m: f64,
}

/// Why a point has no distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unplaced {
    /// Less than a quarter of the patch has a distance, or the point is outside the picture.
    Hole,
    /// The patch shows two surfaces, or one that is nearly parallel to the line of sight.
    Edge,
}

impl Patch {
    /// Returns the median distance around a place [m].
    pub fn distance(&self, depth: &Depth, place: [f64; 2]) -> Result<f64, Unplaced> {
        let [width, height] = depth.size();
        let is_inside =
            (-0.5..width - 0.5).contains(&place[0]) && (-0.5..height - 0.5).contains(&place[1]);
        if !is_inside {
            return Err(Unplaced::Hole);
        }
        let side = i64::from(self.side.max(1));
        // The middle pixel of an odd patch is the nearest one; in an even patch the point is between the two middle
        // pixels.
        let first = place.map(|at| (at - (side - 1) as f64 / 2.0).round() as i64);
        let pixels = (0..side).flat_map(|row| (0..side).map(move |column| (column, row)));
        let mut distances: Vec<f64> = pixels
            .filter_map(|(column, row)| depth.at(first[0] + column, first[1] + row))
            .collect();
        if distances.is_empty() || (distances.len() as f64) < LEAST_FILLED * (side * side) as f64 {
            return Err(Unplaced::Hole);
        }
        distances.sort_by(f64::total_cmp);
        let (count, tail) = (distances.len(), distances.len() / TAIL);
        if distances[count - 1 - tail] - distances[tail] > self.most_spread_m {
            return Err(Unplaced::Edge);
        }
        Ok(f64::midpoint(distances[(count - 1) / 2], distances[count / 2]))
    }
}
