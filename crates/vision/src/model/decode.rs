//! Decodes model outputs to points, parts of the picture, or numbers. Each kind has a file.

mod boxes;
mod classes;
mod gaze;
mod hand;
mod heatmap;
mod movenet;
mod points;
mod regression;
mod simcc;
mod ssd;
mod yolo;
mod yunet;

use schemars::JsonSchema;
use serde::Deserialize;
use thiserror::Error;

use super::descriptor::Subject;
use super::input::Placement;
use super::tensor::{Tensor, shown};
pub use hand::SeenHand;

/// The output of a model, by kind.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Output {
    /// Keypoints as heatmaps; each point is at the maximum of its map.
    Heatmap(heatmap::Heatmap),
    /// Keypoints with their columns and rows classified separately (SimCC).
    Simcc(simcc::Simcc),
    /// Keypoints as a flat array of numbers.
    Points(points::Points),
    /// Keypoints as MoveNet outputs them.
    Movenet(movenet::Movenet),
    /// Class probabilities.
    Classes(classes::Classes),
    /// Plain numbers, such as valence and arousal.
    Regression(regression::Regression),
    /// Gaze direction.
    Gaze(gaze::Gaze),
    /// Faces as YuNet outputs them.
    Yunet(yunet::Yunet),
    /// Faces or palms as offsets from anchors (BlazeFace).
    Ssd(ssd::Ssd),
    /// Persons, faces or objects as YOLO outputs them.
    Yolo(yolo::Yolo),
    /// The points of a hand, and whether it is left or right.
    Hand(hand::Hand),
}

/// The decoded output of a model.
#[derive(Clone, Debug, PartialEq)]
pub enum Found {
    /// Points, in the order of their names.
    Points(Vec<Point>),
    /// Parts of the picture, the most confident first.
    Detections(Vec<Detection>),
    /// Numbers.
    Values(Vec<f64>),
    /// A hand; `None` if the part of the picture shows none.
    Hand(Option<SeenHand>),
}

/// A keypoint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// The position [px].
    pub place: [f32; 2],
    /// The score as reported by the model.
    pub score: f32,
}

/// A part of a picture: a face, a person, or a hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// The left side [px].
    pub left: f32,
    /// The top [px].
    pub top: f32,
    /// The width [px].
    pub width: f32,
    /// The height [px].
    pub height: f32,
    /// The confidence, 0 to 1.
    pub score: f32,
    /// The keypoints [px].
    pub points: Vec<[f32; 2]>,
}

/// Why outputs cannot be decoded.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum DecodeError {
    /// There are fewer outputs than needed.
    #[error("it has {is} outputs; its kind needs {expected}")]
    Count {
        /// The number of outputs.
        is: usize,
        /// The expected number of outputs.
        expected: usize,
    },
    /// There is no output with this name.
    #[error("it has no output `{name}`, only {has}")]
    Name {
        /// The name.
        name: String,
        /// The names of the outputs.
        has: String,
    },
    /// An output has an unexpected shape.
    #[error("its output `{name}` is {is}; expected {expected}")]
    Shape {
        /// The name of the output.
        name: String,
        /// The shape of the output.
        is: String,
        /// The expected shape.
        expected: String,
    },
}

/// The settings of a kind of output, and how it is decoded.
trait Decode {
    /// Decodes the outputs of a model whose input has this size; positions are in pixels of the input.
    fn decode(&self, outputs: &[Tensor], size: [usize; 2]) -> Result<Found, DecodeError>;

    /// The names and units of the values for a picture.
    fn channels(&self) -> Vec<(String, &'static str)>;

    /// Describes an invalid setting, if there is one.
    fn wrong(&self) -> Option<String> {
        None
    }

    /// What the model finds for later models.
    fn finds(&self) -> Option<Subject> {
        None
    }
}

impl Output {
    fn kind(&self) -> &dyn Decode {
        match self {
            Output::Heatmap(kind) => kind,
            Output::Simcc(kind) => kind,
            Output::Points(kind) => kind,
            Output::Movenet(kind) => kind,
            Output::Classes(kind) => kind,
            Output::Regression(kind) => kind,
            Output::Gaze(kind) => kind,
            Output::Yunet(kind) => kind,
            Output::Ssd(kind) => kind,
            Output::Yolo(kind) => kind,
            Output::Hand(kind) => kind,
        }
    }

    /// Decodes the outputs of a model whose input has this width and height [px].
    pub fn decode(&self, outputs: &[Tensor], size: [usize; 2]) -> Result<Found, DecodeError> {
        self.kind().decode(outputs, size)
    }

    /// The names and units of the values for a picture.
    pub fn channels(&self) -> Vec<(String, &'static str)> {
        self.kind().channels()
    }

    /// What the model finds for later models.
    pub fn finds(&self) -> Option<Subject> {
        self.kind().finds()
    }

    /// Whether the values are positions in the picture.
    pub fn has_places(&self) -> bool {
        !matches!(self, Output::Classes(_) | Output::Regression(_) | Output::Gaze(_))
    }

    /// The suffixes that distinguish the model's streams: the sides of a hand, otherwise a single empty one.
    pub fn sides(&self) -> &'static [&'static str] {
        match self {
            Output::Hand(_) => &hand::SIDES,
            _ => &[""],
        }
    }

    /// Returns the values for each of the model's streams, from everything found in a picture.
    pub fn numbers(&self, found: &[Found]) -> Vec<Vec<f64>> {
        match self {
            Output::Hand(_) => {
                let sides = hand::of_sides(found);
                sides.into_iter().map(|hand| self.values(hand)).collect()
            }
            _ => vec![self.values(found.first())],
        }
    }

    /// Returns the values of a stream, one per channel; NaN if nothing was found.
    pub fn values(&self, found: Option<&Found>) -> Vec<f64> {
        let count = self.channels().len();
        let mut values = match found {
            None => Vec::new(),
            Some(Found::Values(values)) => values.clone(),
            Some(Found::Points(points)) => points.iter().flat_map(Point::values).collect(),
            Some(Found::Detections(found)) => boxes::values(found),
            Some(Found::Hand(hand)) => {
                hand.iter().flat_map(|hand| &hand.points).flat_map(Point::values).collect()
            }
        };
        values.resize(count, f64::NAN);
        values
    }

    pub(super) fn wrong(&self) -> Option<String> {
        let names = self.channels();
        if names.is_empty() || names.len() > 4096 {
            return Some(format!("it has {} values; 1 to 4096 are supported", names.len()));
        }
        self.kind().wrong()
    }
}

impl Found {
    /// Converts positions to pixels of the picture.
    #[must_use]
    pub fn placed(mut self, placement: &Placement) -> Found {
        match &mut self {
            Found::Points(points) | Found::Hand(Some(SeenHand { points, .. })) => {
                for point in points {
                    point.place = placement.in_picture(point.place);
                }
            }
            Found::Detections(found) => {
                for each in found {
                    each.place(placement);
                }
            }
            Found::Values(_) | Found::Hand(None) => {}
        }
        self
    }
}

impl Point {
    fn values(&self) -> [f64; 3] {
        [self.place[0], self.place[1], self.score].map(f64::from)
    }
}

impl Detection {
    fn place(&mut self, placement: &Placement) {
        let [x, y] = placement.in_picture([self.left, self.top]);
        let [across, down] = placement.scale();
        (self.left, self.top) = (x, y);
        (self.width, self.height) = (self.width * across, self.height * down);
        for point in &mut self.points {
            *point = placement.in_picture(*point);
        }
    }
}

/// Returns the output with this name or, without a name, at this index.
fn output<'a>(
    outputs: &'a [Tensor],
    name: Option<&str>,
    place: usize,
) -> Result<&'a Tensor, DecodeError> {
    match name {
        None => {
            outputs.get(place).ok_or(DecodeError::Count { is: outputs.len(), expected: place + 1 })
        }
        Some(name) => outputs.iter().find(|output| output.name == name).ok_or_else(|| {
            let has: Vec<&str> = outputs.iter().map(|output| output.name.as_str()).collect();
            DecodeError::Name { name: name.to_owned(), has: has.join(", ") }
        }),
    }
}

/// Returns the error for a tensor with an unexpected shape.
fn misshaped(tensor: &Tensor, expected: impl Into<String>) -> DecodeError {
    let (name, is) = (tensor.name.clone(), shown(&tensor.shape));
    DecodeError::Shape { name, is, expected: expected.into() }
}

/// Returns the names and units of the values of points.
fn of_points(names: &[String]) -> Vec<(String, &'static str)> {
    let each = |name: &String| {
        [("x", "px"), ("y", "px"), ("score", "1")]
            .map(|(part, unit)| (format!("{name}_{part}"), unit))
    };
    names.iter().flat_map(each).collect()
}

#[cfg(test)]
mod tests;
