//! Hides faces in a picture.

use crate::model::decode::Detection;
use crate::picture::Picture;

/// The number of colours that remain along each side of a hidden part; no eye, mouth or outline of a face remains.
const CELLS: usize = 4;

/// Hides a part of a picture, enlarged on each side by `margin` times its size: only the mean colours of 4 × 4 cells
/// remain, interpolated smoothly. A part whose position is not finite hides the whole picture.
pub fn hide(picture: &mut Picture, part: &Detection, margin: f64) {
    let Some(part) = Part::of(picture, part, margin) else { return };
    let colours = part.colours(picture);
    for row in part.top..part.top + part.height {
        for column in part.left..part.left + part.width {
            let place = (row * picture.width as usize + column) * 3;
            picture.rgb[place..place + 3].copy_from_slice(&part.between(&colours, column, row));
        }
    }
}

/// The pixels of a part, clipped to the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Part {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
}

/// The mean colours of the cells of a part.
type Colours = [[[f64; 3]; CELLS]; CELLS];

impl Part {
    /// Returns `None` if the part is outside the picture or has no pixels.
    fn of(picture: &Picture, part: &Detection, margin: f64) -> Option<Part> {
        let (width, height) = (f64::from(picture.width), f64::from(picture.height));
        let [left, top, across, down] =
            [part.left, part.top, part.width, part.height].map(f64::from);
        let sides = |from: f64, long: f64, most: f64| {
            let (from, to) = (from - margin * long, from + (1.0 + margin) * long);
            (from.floor().clamp(0.0, most) as usize, to.ceil().clamp(0.0, most) as usize)
        };
        let is_known = [left, top, across, down].iter().all(|number| number.is_finite());
        let ((left, right), (top, bottom)) = if is_known {
            (sides(left, across.max(0.0), width), sides(top, down.max(0.0), height))
        } else {
            ((0, width as usize), (0, height as usize))
        };
        let part = Part { left, top, width: right - left, height: bottom - top };
        (part.width > 0 && part.height > 0).then_some(part)
    }

    fn colours(&self, picture: &Picture) -> Colours {
        let mut sums = [[([0_u64; 3], 0_u64); CELLS]; CELLS];
        for row in 0..self.height {
            let first = ((self.top + row) * picture.width as usize + self.left) * 3;
            let pixels = picture.rgb[first..first + 3 * self.width].as_chunks::<3>().0;
            let down = row * CELLS / self.height;
            for (column, pixel) in pixels.iter().enumerate() {
                let (sum, count) = &mut sums[down][column * CELLS / self.width];
                sum.iter_mut().zip(pixel).for_each(|(sum, level)| *sum += u64::from(*level));
                *count += 1;
            }
        }
        // If a part has fewer pixels than cells, some cells are empty.
        let known = sums.iter().flatten().find(|(_, count)| *count > 0).copied();
        let mean = |(sum, count): ([u64; 3], u64)| {
            let (sum, count) = if count > 0 { (sum, count) } else { known.unwrap_or((sum, 1)) };
            sum.map(|sum| sum as f64 / count as f64)
        };
        sums.map(|row| row.map(mean))
    }

    /// The colour at a pixel, interpolated between the centres of the nearest cells.
    fn between(&self, colours: &Colours, column: usize, row: usize) -> [u8; 3] {
        let nearest = |place: usize, from: usize, long: usize| {
            let at = ((place - from) as f64 + 0.5) * CELLS as f64 / long as f64 - 0.5;
            let at = at.clamp(0.0, (CELLS - 1) as f64);
            let first = (at as usize).min(CELLS - 2);
            (first, at - first as f64)
        };
        let (down, below) = nearest(row, self.top, self.height);
        let (across, beside) = nearest(column, self.left, self.width);
        [0, 1, 2].map(|part| {
            let along = |row: &[[f64; 3]; CELLS]| {
                row[across][part] * (1.0 - beside) + row[across + 1][part] * beside
            };
            let level = along(&colours[down]) * (1.0 - below) + along(&colours[down + 1]) * below;
            level.round() as u8
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn face(left: f32, top: f32, width: f32, height: f32) -> Detection {
        Detection { left, top, width, height, score: 1.0, points: Vec::new() }
    }

    /// Alternating black and white columns.
    fn striped(width: u32, height: u32) -> Picture {
        let row = (0..width).flat_map(|column| [(column % 2 * 255) as u8; 3]);
        let rgb = row.collect::<Vec<_>>().repeat(height as usize);
        Picture { width, height, rgb }
    }

    #[test]
    fn what_is_hidden_has_no_detail_and_what_is_beside_it_stays() {
        let mut picture = striped(64, 48);
        hide(&mut picture, &face(20.0, 12.0, 16.0, 16.0), 0.25);
        for (column, row) in [(16, 8), (28, 20), (39, 31)] {
            let [level, ..] = picture.at(column, row).unwrap();
            assert!(level.abs_diff(127) <= 1, "{column} {row}: {level}");
        }
        for (column, row) in [(15, 20), (41, 20), (29, 7), (29, 32)] {
            assert_eq!(picture.at(column, row), striped(64, 48).at(column, row));
        }
    }

    #[test]
    fn a_face_without_a_place_hides_everything() {
        let mut picture = striped(64, 48);
        hide(&mut picture, &face(f32::NAN, 12.0, 16.0, 16.0), 0.25);
        assert!(picture.rgb.iter().all(|level| level.abs_diff(127) <= 1));
    }

    #[test]
    fn a_face_outside_of_the_picture_hides_nothing() {
        let mut picture = striped(64, 48);
        hide(&mut picture, &face(100.0, 12.0, 16.0, 16.0), 0.25);
        assert_eq!(picture, striped(64, 48));
    }

    proptest! {
        #[test]
        fn any_part_of_any_picture_is_hidden(
            left: f32, top: f32, width: f32, height: f32,
            columns in 1_u32..20, rows in 1_u32..20, margin in 0.0..3.0,
        ) {
            let mut picture = striped(columns, rows);
            hide(&mut picture, &face(left, top, width, height), margin);
            prop_assert_eq!(picture.rgb.len(), (columns * rows * 3) as usize);
        }
    }
}
