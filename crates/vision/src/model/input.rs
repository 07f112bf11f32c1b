//! The part of a picture that a model looks at, as the numbers that it expects.

use super::decode::Detection;
use super::descriptor::{Colour, Input, Layout, Resize};
use super::tensor::Tensor;
use crate::picture::Picture;

/// Where the five points of a face are in a picture of 112 × 112 pixels that models of aligned faces expect [px]: the
/// eyes, the tip of the nose, and the corners of the mouth, each from the left (Deng et al. 2019, `ArcFace`,
/// doi:10.1109/CVPR.2019.00482).
const FACE_112: [[f64; 2]; 5] = [
    [38.2946, 51.6963],
    [73.5318, 51.5014],
    [56.0252, 71.7366],
    [41.5493, 92.3655],
    [70.7299, 92.2041],
];

/// How far above the middle of a palm that of its hand is, as a part of the palm's height: the fingers are above it.
const PALM_TO_HAND: f64 = 0.4;

/// Where the pixels of a model's input are in a picture: turned, scaled and moved. The centre of the first pixel is the
/// origin of both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// What a step to the right in the input is in the picture [px].
    right: [f64; 2],
    /// What a step down in the input is in the picture [px].
    down: [f64; 2],
    /// Where the first pixel of the input is in the picture [px].
    origin: [f64; 2],
}

impl Placement {
    /// The whole picture.
    pub fn of_picture(input: &Input, picture: &Picture) -> Placement {
        let size = [f64::from(picture.width), f64::from(picture.height)];
        Placement::of_rectangle(input, [-0.5, -0.5], size)
    }

    /// A part of a picture, with its margin; `None` for one without an area.
    pub fn of_part(input: &Input, part: &Detection) -> Option<Placement> {
        let corner = [part.left, part.top].map(f64::from);
        let size = [part.width, part.height].map(f64::from);
        let is_area = size.iter().all(|side| side.is_finite() && *side >= 1.0)
            && corner.iter().all(|place| place.is_finite());
        let grown = size.map(|side| side * (1.0 + input.margin));
        let corner = [0, 1].map(|axis| corner[axis] - (grown[axis] - size[axis]) / 2.0);
        is_area.then(|| Placement::of_rectangle(input, corner, grown))
    }

    /// A face whose five points are where models of aligned faces expect them (the least squares of Umeyama 1991,
    /// doi:10.1109/34.88573); `None` where there are no five, or all in one place.
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

    /// A hand, as a square around the points of its palm, grown by the margin and turned so that the way from the wrist
    /// (the first point) to the root of the middle finger (the third) is up. A hand without points is placed as any other
    /// part. `None` where the points have no extent.
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

    /// A rectangle of a picture, from the corner of its first pixel.
    fn of_rectangle(input: &Input, corner: [f64; 2], size: [f64; 2]) -> Placement {
        let mut step = [0, 1].map(|axis| size[axis] / input.size[axis] as f64);
        match input.resize {
            Resize::Stretch => {}
            Resize::Letterbox => step = [step[0].max(step[1]); 2],
            Resize::Crop => step = [step[0].min(step[1]); 2],
        }
        // The middle of both is in the same place.
        let origin = [0, 1].map(|axis| {
            let side = input.size[axis] as f64 * step[axis];
            corner[axis] + (size[axis] - side) / 2.0 + step[axis] / 2.0
        });
        Placement { right: [step[0], 0.0], down: [0.0, step[1]], origin }
    }

    /// A place of the input in the picture [px].
    pub fn in_picture(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let (u, v) = (f64::from(u), f64::from(v));
        [0, 1].map(|axis| (self.origin[axis] + self.right[axis] * u + self.down[axis] * v) as f32)
    }

    /// How long a step of the input is in the picture, along each side [px].
    pub fn scale(&self) -> [f32; 2] {
        [self.right, self.down].map(|[x, y]| x.hypot(y) as f32)
    }
}

/// The numbers of a picture that a model expects.
pub fn tensor(input: &Input, picture: &Picture, placement: &Placement) -> Tensor {
    let [width, height] = input.size;
    let mut tensor = Tensor::zeros(input.shape());
    let number =
        |value: f32, part: usize| (value * input.scale - input.mean[part]) / input.std[part];
    for row in 0..height {
        for column in 0..width {
            let place = placement.in_picture([column as f32, row as f32]);
            let mut colour = between(picture, place).unwrap_or([input.fill; 3]);
            if input.color == Colour::Bgr {
                colour.reverse();
            }
            for (part, value) in colour.into_iter().enumerate() {
                let place = match input.layout {
                    Layout::Nchw => (part * height + row) * width + column,
                    Layout::Nhwc => (row * width + column) * 3 + part,
                };
                tensor.values[place] = number(value, part);
            }
        }
    }
    tensor
}

/// The colour between the four pixels around a place (bilinear); `None` outside of the picture.
fn between(picture: &Picture, [x, y]: [f32; 2]) -> Option<[f32; 3]> {
    let (width, height) = (picture.width as f32, picture.height as f32);
    let is_inside = x >= -0.5 && y >= -0.5 && x < width - 0.5 && y < height - 0.5;
    if !is_inside {
        return None;
    }
    let (x, y) = (x.clamp(0.0, width - 1.0), y.clamp(0.0, height - 1.0));
    let (left, top) = (x.floor(), y.floor());
    let (across, down) = (x - left, y - top);
    let (left, top) = (left as u32, top as u32);
    let (right, below) = ((left + 1).min(picture.width - 1), (top + 1).min(picture.height - 1));
    let corners = [(left, top), (right, top), (left, below), (right, below)];
    let corners = corners.map(|(column, row)| picture.at(column, row).unwrap_or_default());
    let mix = |part: usize| {
        let [above, beside, below, last] = corners.map(|corner| f32::from(corner[part]));
        (above + (beside - above) * across) * (1.0 - down)
            + (below + (last - below) * across) * down
    };
    Some([mix(0), mix(1), mix(2)])
}

#[cfg(test)]
mod tests;
