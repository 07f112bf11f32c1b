//! Faces with five points, as YuNet outputs them (Wu et al. 2023, doi:10.1007/s11633-023-1423-y; decoded as in
//! OpenCV's `FaceDetectorYN`): `cls_S`, `obj_S`, `bbox_S` and `kps_S` for strides S of 8, 16 and 32 pixels.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Decode, DecodeError, Detection, Found, Tensor, boxes, misshaped, output};
use crate::model::descriptor::Subject;

/// The cell spacings [px].
const STRIDES: [usize; 3] = [8, 16, 32];
/// The points of a face; left and right are as seen by the person.
const POINTS: [&str; 5] =
    ["right_eye", "left_eye", "nose", "right_mouth_corner", "left_mouth_corner"];

/// The settings of YuNet's faces.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Yunet {
    /// The minimum confidence of a face, 0 to 1.
    #[serde(default = "least_score")]
    pub least_score: f32,
    /// The largest overlap of two faces (intersection over union).
    #[serde(default = "most_overlap")]
    pub most_overlap: f32,
}

fn least_score() -> f32 {
    0.6
}

fn most_overlap() -> f32 {
    0.3
}

impl Decode for Yunet {
    fn decode(&self, outputs: &[Tensor], size: [usize; 2]) -> Result<Found, DecodeError> {
        let mut faces = Vec::new();
        for stride in STRIDES {
            self.of_stride(outputs, size, stride, &mut faces)?;
        }
        Ok(Found::Detections(boxes::apart(faces, self.most_overlap)))
    }

    fn channels(&self) -> Vec<(String, &'static str)> {
        boxes::channels(&POINTS)
    }

    fn finds(&self) -> Option<Subject> {
        Some(Subject::Face)
    }
}

impl Yunet {
    fn of_stride(
        &self,
        outputs: &[Tensor],
        size: [usize; 2],
        stride: usize,
        faces: &mut Vec<Detection>,
    ) -> Result<(), DecodeError> {
        let columns = size[0] / stride;
        let cells = columns * (size[1] / stride);
        let read = |name: &str, width: usize| {
            let tensor = output(outputs, Some(&format!("{name}_{stride}")), 0)?;
            if tensor.values.len() == cells * width {
                Ok(&tensor.values)
            } else {
                Err(misshaped(tensor, format!("1 × {cells} × {width}")))
            }
        };
        let (class, object) = (read("cls", 1)?, read("obj", 1)?);
        let (sides, points) = (read("bbox", 4)?, read("kps", 10)?);
        let (sides, points) = (sides.as_chunks::<4>().0, points.as_chunks::<10>().0);
        for cell in 0..cells {
            let score = (class[cell].clamp(0.0, 1.0) * object[cell].clamp(0.0, 1.0)).sqrt();
            if score >= self.least_score {
                let corner = [(cell % columns) as f32, (cell / columns) as f32];
                faces.push(face(corner, stride as f32, score, sides[cell], points[cell]));
            }
        }
        Ok(())
    }
}

/// Returns the face of a cell: its centre and points are offsets from the cell, its sides are logarithms, all in
/// strides.
fn face(
    cell: [f32; 2],
    stride: f32,
    score: f32,
    [x, y, width, height]: [f32; 4],
    points: [f32; 10],
) -> Detection {
    let (width, height) = (width.exp() * stride, height.exp() * stride);
    let points = points.as_chunks::<2>().0.iter();
    Detection {
        left: (cell[0] + x) * stride - width / 2.0,
        top: (cell[1] + y) * stride - height / 2.0,
        width,
        height,
        score,
        points: points.map(|[x, y]| [(cell[0] + x) * stride, (cell[1] + y) * stride]).collect(),
    }
}
