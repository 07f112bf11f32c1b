//! The part of a picture that a model processes, as its input tensor.

use super::decode::Detection;
use super::descriptor::{Colour, Input, Layout, Resize};
use super::tensor::Tensor;
use crate::picture::Picture;

/// The five points of an aligned face in a picture of 112 × 112 pixels, as face models expect them [px]: the eyes, the
/// tip of the nose, and the corners of the mouth, pairs from left to right (Deng et al. 2019, `ArcFace`,
/// doi:10.1109/CVPR.2019.00482).
const FACE_112: [[f64; 2]; 5] = [
    [38.2946, 51.6963],
    [73.5318, 51.5014],
    [56.0252, 71.7366],
    [41.5493, 92.3655],
    [70.7299, 92.2041],
];

/// How far the middle of a hand is above the middle of its palm, as a share of the palm's height: the fingers are above
/// it.
const PALM_TO_HAND: f64 = 0.4;

/// The similarity transform from a model's input to a picture. The origin of both is the centre of the first pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// The step in the picture for one input pixel to the right [px].
    right: [f64; 2],
    /// The step in the picture for one input pixel down [px].
    down: [f64; 2],
    /// The position of the first input pixel in the picture [px].
    origin: [f64; 2],
}

impl Placement {
    /// Returns the placement of the whole picture.
    pub fn of_picture(input: &Input, picture: &Picture) -> Placement {
        let size = [f64::from(picture.width), f64::from(picture.height)];
        Placement::of_rectangle(input, [-0.5, -0.5], size)
    }

    /// Returns the placement of a part of a picture with its margin; `None` if its area is zero.
    pub fn of_part(input: &Input, part: &Detection) -> Option<Placement> {
        let corner = [part.left, part.top].map(f64::from);
        let size = [part.width, part.height].map(f64::from);
        let is_area = size.iter().all(|side| side.is_finite() && *side >= 1.0)
            && corner.iter().all(|place| place.is_finite());
        let grown = size.map(|side| side * (1.0 + input.margin));
        let corner = [0, 1].map(|axis| corner[axis] - (grown[axis] - size[axis]) / 2.0);
        is_area.then(|| Placement::of_rectangle(input, corner, grown))
    }

    /// Returns the placement of a face aligned by its five points (the least squares of Umeyama 1991,
    /// doi:10.1109/34.88573); `None` with fewer than five points, or if they coincide.
    pub fn aligned(input: &Input, points: &[[f32; 2]]) -> Option<Placement> {
        let found: &[[f32; 2]; 5] = points.first_chunk()?;
        let found = found.map(|point| point.map(f64::from));
        let scale = input.size.map(|side| side as f64 / 112.0);
        let wanted = FACE_112.map(|[x, y]| [x * scale[0], y * scale[1]]);
        let mean = |points: &[[f64; 2]; 5], axis: usize| {
            points.iter().map(|point| point[axis]).sum::<f64>() / 5.0
        };
        let (from, to) =
            ([0, 1].map(|axis| mean(&wanted, axis)), [0, 1].map(|axis| mean(&found, axis)));
        let (mut along, mut across, mut spread) = (0.0, 0.0, 0.0);
        for (wanted, found) in wanted.iter().zip(&found) {
            let ([u, v], [x, y]) =
                ([wanted[0] - from[0], wanted[1] - from[1]], [found[0] - to[0], found[1] - to[1]]);
            along += u * x + v * y;
            across += u * y - v * x;
            spread += u * u + v * v;
        }
        let (cosine, sine) = (along / spread, across / spread);
        let is_face = cosine.hypot(sine) > 1e-3;
        let (right, down) = ([cosine, sine], [-sine, cosine]);
        let origin = [0, 1].map(|axis| to[axis] - right[axis] * from[0] - down[axis] * from[1]);
        is_face.then_some(Placement { right, down, origin })
    }

    /// Returns the placement of a hand: a square around the points of its palm, enlarged by the margin and rotated so
    /// that the direction from the wrist (the first point) to the root of the middle finger (the third) is up. A hand
    /// without points is placed like any other part. `None` if the points have no extent.
    pub fn of_hand(input: &Input, part: &Detection) -> Option<Placement> {
        let &[wrist, _, middle, ..] = part.points.as_slice() else {
            return Placement::of_part(input, part);
        };
        let way = [0, 1].map(|axis| f64::from(wrist[axis]) - f64::from(middle[axis]));
        let length = way[0].hypot(way[1]);
        let down = way.map(|part| part / length);
        let right = [down[1], -down[0]];
        let along = |axis: [f64; 2]| {
            let places = part.points.iter();
            let places = places.map(|[x, y]| axis[0] * f64::from(*x) + axis[1] * f64::from(*y));
            let ends = (f64::INFINITY, f64::NEG_INFINITY);
            places.fold(ends, |(least, most), place| (least.min(place), most.max(place)))
        };
        let ((left, end), (top, bottom)) = (along(right), along(down));
        let side = (end - left).max(bottom - top) * (1.0 + input.margin);
        let is_hand = length > 1e-3 && (1.0..=1e6).contains(&side);
        let above = PALM_TO_HAND * (bottom - top);
        let middle = [f64::midpoint(left, end), f64::midpoint(top, bottom) - above];
        let step = side / input.size[0].min(input.size[1]) as f64;
        let from = [0, 1].map(|axis| middle[axis] - step * (input.size[axis] as f64 - 1.0) / 2.0);
        let origin = [0, 1].map(|axis| right[axis] * from[0] + down[axis] * from[1]);
        let (right, down) = (right.map(|part| part * step), down.map(|part| part * step));
        is_hand.then_some(Placement { right, down, origin })
    }

    /// Returns the placement of a rectangle of a picture, from the corner of its first pixel.
    fn of_rectangle(input: &Input, corner: [f64; 2], size: [f64; 2]) -> Placement {
        let mut step = [0, 1].map(|axis| size[axis] / input.size[axis] as f64);
        match input.resize {
            Resize::Stretch => {}
            Resize::Letterbox => step = [step[0].max(step[1]); 2],
            Resize::Crop => step = [step[0].min(step[1]); 2],
        }
        // The middles of the part and of the input coincide.
        let origin = [0, 1].map(|axis| {
            let side = input.size[axis] as f64 * step[axis];
            corner[axis] + (size[axis] - side) / 2.0 + step[axis] / 2.0
        });
        Placement { right: [step[0], 0.0], down: [0.0, step[1]], origin }
    }

    /// Converts a position in the input to a position in the picture [px].
    pub fn in_picture(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let (u, v) = (f64::from(u), f64::from(v));
        [0, 1].map(|axis| (self.origin[axis] + self.right[axis] * u + self.down[axis] * v) as f32)
    }

    /// The length of one input pixel in the picture, along each side [px].
    pub fn scale(&self) -> [f32; 2] {
        [self.right, self.down].map(|[x, y]| x.hypot(y) as f32)
    }
}

/// Returns the input tensor of a model for a picture.
pub fn tensor(input: &Input, picture: &Picture, placement: &Placement) -> Tensor {
    let [width, height] = input.size;
    let mut tensor = Tensor::zeros(input.shape());
    let upright = Upright::new(input, picture, placement);
    let mut colours = vec![[input.fill; 3]; width];
    for row in 0..height {
        match &upright {
            Some(upright) => upright.row(picture, row, input.fill, &mut colours),
            None => turned(picture, placement, row, input.fill, &mut colours),
        }
        write_row(input, row, &colours, &mut tensor.values);
    }
    tensor
}

/// Writes a row of colours into the input tensor, in the model's order and scale.
fn write_row(input: &Input, row: usize, colours: &[[f32; 3]], values: &mut [f32]) {
    let [width, height] = input.size;
    for part in 0..3 {
        let from = if input.color == Colour::Bgr { 2 - part } else { part };
        let (scale, mean, std) = (input.scale, input.mean[part], input.std[part]);
        let numbers = colours.iter().map(|colour| (colour[from] * scale - mean) / std);
        match input.layout {
            Layout::Nchw => {
                let plane = &mut values[(part * height + row) * width..][..width];
                plane.iter_mut().zip(numbers).for_each(|(value, number)| *value = number);
            }
            Layout::Nhwc => {
                let pixels = values[row * width * 3..][..width * 3].as_chunks_mut::<3>().0;
                pixels.iter_mut().zip(numbers).for_each(|(pixel, number)| pixel[part] = number);
            }
        }
    }
}

/// The two pixels next to a position along one side of a picture, and the weight of the second (0 to 1).
#[derive(Clone, Copy)]
struct Between {
    near: usize,
    far: usize,
    share: f32,
}

impl Between {
    /// Returns `None` outside the picture.
    fn new(place: f32, count: u32) -> Option<Between> {
        let length = count as f32;
        let is_inside = place >= -0.5 && place < length - 0.5;
        let place = place.clamp(0.0, (length - 1.0).max(0.0));
        let near = place.floor();
        let share = place - near;
        let near = near as usize;
        let far = (near + 1).min((count as usize).saturating_sub(1));
        is_inside.then_some(Between { near, far, share })
    }

    fn mix(self, near: f32, far: f32) -> f32 {
        near + (far - near) * self.share
    }
}

/// The neighbours of each column and row for an input that is not rotated, shared by all its pixels.
struct Upright {
    columns: Vec<Option<Between>>,
    rows: Vec<Option<Between>>,
}

impl Upright {
    /// Returns `None` for a rotated placement.
    fn new(input: &Input, picture: &Picture, placement: &Placement) -> Option<Upright> {
        let is_upright = placement.right[1] == 0.0 && placement.down[0] == 0.0;
        let column = |at| Between::new(placement.in_picture([at as f32, 0.0])[0], picture.width);
        let row = |at| Between::new(placement.in_picture([0.0, at as f32])[1], picture.height);
        is_upright.then(|| Upright {
            columns: (0..input.size[0]).map(column).collect(),
            rows: (0..input.size[1]).map(row).collect(),
        })
    }

    fn row(&self, picture: &Picture, row: usize, fill: f32, colours: &mut [[f32; 3]]) {
        let Some(row) = self.rows[row] else { return colours.fill([fill; 3]) };
        let (above, below) = (pixels(picture, row.near), pixels(picture, row.far));
        for (colour, column) in colours.iter_mut().zip(&self.columns) {
            *colour = match column {
                Some(column) => mixed(above, below, *column, row),
                None => [fill; 3],
            };
        }
    }
}

/// Returns a row of a rotated input.
fn turned(
    picture: &Picture,
    placement: &Placement,
    row: usize,
    fill: f32,
    colours: &mut [[f32; 3]],
) {
    for (at, colour) in colours.iter_mut().enumerate() {
        let [x, y] = placement.in_picture([at as f32, row as f32]);
        let place = Between::new(x, picture.width).zip(Between::new(y, picture.height));
        *colour = place.map_or([fill; 3], |(column, row)| {
            mixed(pixels(picture, row.near), pixels(picture, row.far), column, row)
        });
    }
}

/// Returns the pixels of a row of a picture.
fn pixels(picture: &Picture, row: usize) -> &[[u8; 3]] {
    let width = picture.width as usize;
    let pixels: &[[u8; 3]] = picture.rgb.as_chunks().0;
    pixels.get(row * width..(row + 1) * width).unwrap_or_default()
}

/// Returns the colour between four pixels (bilinear interpolation).
fn mixed(above: &[[u8; 3]], below: &[[u8; 3]], column: Between, row: Between) -> [f32; 3] {
    let pair =
        |pixels: &[[u8; 3]]| (pixels.get(column.near).copied(), pixels.get(column.far).copied());
    let ((Some(left), Some(right)), (Some(last_left), Some(last_right))) =
        (pair(above), pair(below))
    else {
        return [0.0; 3];
    };
    let mut colour = [0.0; 3];
    for part in 0..3 {
        let above = column.mix(f32::from(left[part]), f32::from(right[part]));
        let below = column.mix(f32::from(last_left[part]), f32::from(last_right[part]));
        colour[part] = above * (1.0 - row.share) + below * row.share;
    }
    colour
}

#[cfg(test)]
mod tests;
