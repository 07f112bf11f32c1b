//! What a model's outputs mean: points, parts of the picture, or numbers. A file a kind.

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

/// What comes out of a model, by its kind.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Output {
    /// Points, each the highest place of a map.
    Heatmap(heatmap::Heatmap),
    /// Points, each with its column and its row classified (SimCC).
    Simcc(simcc::Simcc),
    /// Points as numbers in a row.
    Points(points::Points),
    /// Points as MoveNet gives them.
    Movenet(movenet::Movenet),
    /// How probable each of some classes is.
    Classes(classes::Classes),
    /// Numbers as they are, such as valence and arousal.
    Regression(regression::Regression),
    /// The direction of a gaze.
    Gaze(gaze::Gaze),
    /// Faces as YuNet gives them.
    Yunet(yunet::Yunet),
    /// Faces or palms as offsets from anchors (BlazeFace).
    Ssd(ssd::Ssd),
    /// Persons, faces or things as YOLO gives them.
    Yolo(yolo::Yolo),
    /// The points of a hand, and which hand it is.
    Hand(hand::Hand),
}

/// What a model has found.
#[derive(Clone, Debug, PartialEq)]
pub enum Found {
    /// Points, in the order of their names.
    Points(Vec<Point>),
    /// Parts of the picture, the most certain first.
    Detections(Vec<Detection>),
    /// Numbers.
    Values(Vec<f64>),
    /// A hand; `None` where the part of the picture shows none.
    Hand(Option<SeenHand>),
}

/// A point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Its place [px].
    pub place: [f32; 2],
    /// How certain it is, as the model says.
    pub score: f32,
}

/// A part of a picture: a face, a person, or a hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// Its left side [px].
    pub left: f32,
    /// Its top [px].
    pub top: f32,
    /// Its width [px].
    pub width: f32,
    /// Its height [px].
    pub height: f32,
    /// How certain it is, 0 to 1.
    pub score: f32,
    /// Points in it [px].
    pub points: Vec<[f32; 2]>,
}

/// Why outputs can't be read.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum DecodeError {
    /// Fewer outputs than needed.
    #[error("it has {is} outputs; its kind has {expected}")]
    Count {
        /// How many there are.
        is: usize,
        /// How many there should be.
        expected: usize,
    },
    /// No output of this name.
    #[error("it has no output `{name}`, but {has}")]
    Name {
        /// The name.
        name: String,
        /// The names that there are.
        has: String,
    },
    /// An output of another shape.
    #[error("its output `{name}` is {is}; expected {expected}")]
    Shape {
        /// The output.
        name: String,
        /// Its shape.
        is: String,
        /// What it should be.
        expected: String,
    },
}

/// The settings and the meaning of a kind of output.
trait Decode {
    /// Reads the outputs of a model whose input has this size; places are in pixels of the input.
    fn decode(&self, outputs: &[Tensor], size: [usize; 2]) -> Result<Found, DecodeError>;

    /// Names and units of the numbers of a picture.
    fn channels(&self) -> Vec<(String, &'static str)>;

    /// A setting without a meaning.
    fn wrong(&self) -> Option<String> {
        None
    }

    /// What it finds that later models look at.
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

    /// Reads the outputs of a model whose input has this width and height [px].
    pub fn decode(&self, outputs: &[Tensor], size: [usize; 2]) -> Result<Found, DecodeError> {
        self.kind().decode(outputs, size)
    }

    /// Names and units of the numbers of a picture.
    pub fn channels(&self) -> Vec<(String, &'static str)> {
        self.kind().channels()
    }

    /// What it finds that later models look at.
    pub fn finds(&self) -> Option<Subject> {
        self.kind().finds()
    }

    /// Whether its numbers have places in the picture.
    pub fn has_places(&self) -> bool {
        !matches!(self, Output::Classes(_) | Output::Regression(_) | Output::Gaze(_))
    }

    /// What its streams are told apart by, at the end of their names: the side of a hand, else nothing.
    pub fn sides(&self) -> &'static [&'static str] {
        match self {
            Output::Hand(_) => &hand::SIDES,
            _ => &[""],
        }
    }

    /// The numbers of a picture for each of its streams, of all that it found there.
    pub fn numbers(&self, found: &[Found]) -> Vec<Vec<f64>> {
        match self {
            Output::Hand(_) => {
                let sides = hand::of_sides(found);
                sides.into_iter().map(|hand| self.values(hand)).collect()
            }
            _ => vec![self.values(found.first())],
        }
    }

    /// The numbers of a stream, one a channel: NaN where nothing was found.
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
            return Some(format!("it has {} numbers; from 1 to 4096 can be read", names.len()));
        }
        self.kind().wrong()
    }
}

impl Found {
    /// The same in pixels of the picture.
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

/// The output of this name; the one at this place, where no name is given.
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

/// The error of a tensor of another shape.
fn misshaped(tensor: &Tensor, expected: impl Into<String>) -> DecodeError {
    let (name, is) = (tensor.name.clone(), shown(&tensor.shape));
    DecodeError::Shape { name, is, expected: expected.into() }
}

/// The names and units of points.
fn of_points(names: &[String]) -> Vec<(String, &'static str)> {
    let each = |name: &String| {
        [("x", "px"), ("y", "px"), ("score", "1")]
            .map(|(part, unit)| (format!("{name}_{part}"), unit))
    };
    names.iter().flat_map(each).collect()
}

#[cfg(test)]
mod tests;
