//! The points of a hand, how certain it is that there is one, and which hand it is, as MediaPipe's model gives them
//! (Zhang et al. 2020, arXiv:2006.10214): x, y and a depth of each point [px], and two probabilities.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Decode, DecodeError, Found, Point, Tensor, misshaped, of_points, output};

/// The ends of the names of the streams of a model of hands.
pub(super) const SIDES: [&str; 2] = ["_left", "_right"];
/// How many numbers a point has.
const STRIDE: usize = 3;

/// The settings of the points of a hand.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hand {
    /// The names of the points.
    pub names: Vec<String>,
    /// How certain a hand has to be, 0 to 1.
    #[serde(default = "least_score")]
    pub least_score: f32,
    /// The output of the points. Without it, the first.
    #[serde(default)]
    pub points: Option<String>,
    /// The output of the probability of a hand. Without it, the second.
    #[serde(default)]
    pub presence: Option<String>,
    /// The output of the probability of a right hand, in a picture that is not mirrored. Without it, the third.
    #[serde(default)]
    pub handedness: Option<String>,
}

fn least_score() -> f32 {
    0.5
}

/// A hand in a part of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenHand {
    /// Its points; the score of each is that of the hand.
    pub points: Vec<Point>,
    /// How certain it is that there is a hand, 0 to 1.
    pub score: f32,
    /// Whether it is a right hand.
    pub is_right: bool,
}

impl Decode for Hand {
    fn decode(&self, outputs: &[Tensor], _: [usize; 2]) -> Result<Found, DecodeError> {
        let points = output(outputs, self.points.as_deref(), 0)?;
        let needed = self.names.len() * STRIDE;
        if points.values.len() != needed {
            return Err(misshaped(points, format!("{needed} numbers, {STRIDE} a point")));
        }
        let score = only(output(outputs, self.presence.as_deref(), 1)?)?;
        let is_right = only(output(outputs, self.handedness.as_deref(), 2)?)? > 0.5;
        let places = points.values.as_chunks::<STRIDE>().0.iter();
        let points = places.map(|[x, y, _]| Point { place: [*x, *y], score });
        let hand = SeenHand { points: points.collect(), score, is_right };
        Ok(Found::Hand((score >= self.least_score).then_some(hand)))
    }

    fn channels(&self) -> Vec<(String, &'static str)> {
        of_points(&self.names)
    }
}

/// The number of an output that has only one.
fn only(tensor: &Tensor) -> Result<f32, DecodeError> {
    match tensor.values.as_slice() {
        [number] => Ok(*number),
        _ => Err(misshaped(tensor, "one number")),
    }
}

/// The most certain hand of each of the [`SIDES`].
pub(super) fn of_sides(found: &[Found]) -> [Option<&Found>; 2] {
    [false, true].map(|is_right| {
        let score = |found: &Found| match found {
            Found::Hand(Some(hand)) if hand.is_right == is_right => Some(hand.score),
            _ => None,
        };
        let scored = found.iter().filter_map(|each| Some((each, score(each)?)));
        scored.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(found, _)| found)
    })
}
