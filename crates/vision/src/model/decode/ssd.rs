//! Faces or palms as offsets from anchors of one size, as BlazeFace outputs them (Bazarevsky et al. 2019,
//! arXiv:1907.05047): 1 × anchors × (4 + two per point), and 1 × anchors × 1 scores.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Decode, DecodeError, Detection, Found, Tensor, boxes, misshaped, output};
use crate::model::descriptor::Subject;
use crate::model::tensor::sigmoid;

/// The points of a face; left and right are as seen by the person.
const OF_FACE: [&str; 6] = ["right_eye", "left_eye", "nose", "mouth", "right_ear", "left_ear"];
/// The points of a palm: the wrist, the bases of the fingers, and the two joints at the base of the thumb.
const OF_PALM: [&str; 7] =
    ["wrist", "index_mcp", "middle_mcp", "ring_mcp", "pinky_mcp", "thumb_cmc", "thumb_mcp"];

/// The settings of faces or palms as offsets from anchors.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ssd {
    /// The cell spacing of each layer [px] and the number of anchors per cell: `[[8, 2], [16, 6]]`.
    pub anchors: Vec<[usize; 2]>,
    /// What the model finds for later models: a `face` with six points, or a `hand` with the seven points of its palm.
    #[serde(default = "face")]
    pub finds: Subject,
    /// The minimum confidence, 0 to 1.
    #[serde(default = "least_score")]
    pub least_score: f32,
    /// The largest overlap of two detections (intersection over union).
    #[serde(default = "most_overlap")]
    pub most_overlap: f32,
    /// The name of the output for offsets. By default the first one.
    #[serde(default)]
    pub offsets: Option<String>,
    /// The name of the output for scores. By default the second one.
    #[serde(default)]
    pub scores: Option<String>,
}

fn face() -> Subject {
    Subject::Face
}

fn least_score() -> f32 {
    0.5
}

fn most_overlap() -> f32 {
    0.3
}

impl Decode for Ssd {
    fn decode(&self, outputs: &[Tensor], size: [usize; 2]) -> Result<Found, DecodeError> {
        let offsets = output(outputs, self.offsets.as_deref(), 0)?;
        let scores = output(outputs, self.scores.as_deref(), 1)?;
        let anchors = self.centres(size);
        let width = 4 + 2 * self.points().len();
        if offsets.values.len() != anchors.len() * width {
            return Err(misshaped(offsets, format!("1 × {} × {width}", anchors.len())));
        }
        if scores.values.len() != anchors.len() {
            return Err(misshaped(scores, format!("1 × {} × 1", anchors.len())));
        }
        let rows = offsets.values.chunks_exact(width).zip(&scores.values).zip(anchors);
        let part = |((row, score), anchor): ((&[f32], &f32), [f32; 2])| {
            let score = sigmoid(*score);
            (score >= self.least_score).then(|| part(row, score, anchor))
        };
        Ok(Found::Detections(boxes::apart(rows.filter_map(part).collect(), self.most_overlap)))
    }

    fn channels(&self) -> Vec<(String, &'static str)> {
        boxes::channels(self.points())
    }

    fn finds(&self) -> Option<Subject> {
        Some(self.finds)
    }

    fn wrong(&self) -> Option<String> {
        if self.finds == Subject::Person {
            return Some("`finds` must be `face` or `hand` for the kind `ssd`".to_owned());
        }
        let is_wrong = self.anchors.is_empty()
            || self.anchors.len() > 16
            || self.anchors.iter().any(|[stride, count]| *stride == 0 || !(1..=64).contains(count));
        is_wrong.then(|| {
            "`anchors` must be 1 to 16 pairs of a spacing and a count from 1 to 64".to_owned()
        })
    }
}

impl Ssd {
    /// The names of the keypoints of a detection.
    fn points(&self) -> &'static [&'static str] {
        match self.finds {
            Subject::Hand => &OF_PALM,
            _ => &OF_FACE,
        }
    }

    /// Returns the centres of all anchors [px].
    fn centres(&self, [width, height]: [usize; 2]) -> Vec<[f32; 2]> {
        let mut centres = Vec::new();
        for [stride, count] in &self.anchors {
            for row in 0..height.div_ceil(*stride) {
                for column in 0..width.div_ceil(*stride) {
                    let middle = [column, row].map(|cell| (cell as f32 + 0.5) * *stride as f32);
                    centres.extend(std::iter::repeat_n(middle, *count));
                }
            }
        }
        centres
    }
}

/// Returns the detection at an anchor: its centre, sides and points, all in pixels from the anchor's centre.
fn part(row: &[f32], score: f32, [x, y]: [f32; 2]) -> Detection {
    let (centre, points) = ([row[0] + x, row[1] + y], row[4..].as_chunks::<2>().0);
    Detection {
        left: centre[0] - row[2] / 2.0,
        top: centre[1] - row[3] / 2.0,
        width: row[2],
        height: row[3],
        score,
        points: points.iter().map(|[across, down]| [across + x, down + y]).collect(),
    }
}
