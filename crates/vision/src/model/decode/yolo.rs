//! Persons, faces or objects as YOLO outputs them: centre, sides and a score per class [px], as 1 × (4 + C) × N (from
//! version 8 on), or with an additional objectness score as 1 × N × (5 + C) (version 5).

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Decode, DecodeError, Detection, Found, Tensor, boxes, misshaped, output};
use crate::model::descriptor::Subject;

/// The settings of YOLO detections.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Yolo {
    /// The version of the output format: `v5` or `v8`.
    pub version: Version,
    /// What the model finds for later models: a `person` or a `face`.
    pub finds: Subject,
    /// The index of the class to find, from 0; with COCO, persons are class 0.
    #[serde(default)]
    pub class: usize,
    /// The minimum confidence of a detection, 0 to 1.
    #[serde(default = "least_score")]
    pub least_score: f32,
    /// The largest overlap of two detections (intersection over union).
    #[serde(default = "most_overlap")]
    pub most_overlap: f32,
}

/// The version of an output format.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Version {
    /// 1 × N × (5 + C).
    V5,
    /// 1 × (4 + C) × N.
    V8,
}

fn least_score() -> f32 {
    0.5
}

fn most_overlap() -> f32 {
    0.5
}

impl Decode for Yolo {
    fn decode(&self, outputs: &[Tensor], _: [usize; 2]) -> Result<Found, DecodeError> {
        let tensor = output(outputs, None, 0)?;
        let &[1, first, second] = tensor.shape.as_slice() else {
            return Err(misshaped(tensor, "1 × N × (5 + classes), or 1 × (4 + classes) × N"));
        };
        let (count, width, needed) = match self.version {
            Version::V5 => (first, second, self.class.saturating_add(6)),
            Version::V8 => (second, first, self.class.saturating_add(5)),
        };
        if width < needed {
            return Err(misshaped(tensor, format!("at least {needed} numbers per box")));
        }
        let number = |place: usize, part: usize| match self.version {
            Version::V5 => tensor.values[place * width + part],
            Version::V8 => tensor.values[part * count + place],
        };
        let found = (0..count).filter_map(|place| self.part(|part| number(place, part)));
        Ok(Found::Detections(boxes::apart(found.collect(), self.most_overlap)))
    }

    fn channels(&self) -> Vec<(String, &'static str)> {
        boxes::channels(&[])
    }

    fn finds(&self) -> Option<Subject> {
        Some(self.finds)
    }
}

impl Yolo {
    fn part(&self, number: impl Fn(usize) -> f32) -> Option<Detection> {
        let score = match self.version {
            Version::V5 => number(4) * number(5 + self.class),
            Version::V8 => number(4 + self.class),
        };
        let [x, y, width, height] = [0, 1, 2, 3].map(&number);
        let (left, top, points) = (x - width / 2.0, y - height / 2.0, Vec::new());
        (score >= self.least_score).then_some(Detection { left, top, width, height, score, points })
    }
}
