//! The points of a hand, the confidence that there is one, and whether it is left or right, as output by MediaPipe's
//! model (Zhang et al. 2020, arXiv:2006.10214): x, y and a depth for each point [px], and two probabilities.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Decode, DecodeError, Found, Point, Tensor, misshaped, of_points, output};

/// The suffixes of the stream names of a hand model.
pub(super) const SIDES: [&str; 2] = ["_left", "_right"];
/// The number of values per point.
const STRIDE: usize = 3;

/// The settings of the points of a hand.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hand {
    /// The names of the points.
    pub names: Vec<String>,
    /// The minimum confidence of a hand, 0 to 1.
    #[serde(default = "least_score")]
    pub least_score: f32,
    /// The name of the output for points. By default the first one.
    #[serde(default)]
    pub points: Option<String>,
    /// The name of the output for the probability of a hand. By default the second one.
    #[serde(default)]
    pub presence: Option<String>,
    /// The name of the output for the probability of a right hand, in a picture that is not mirrored. By default the
    /// third one.
    #[serde(default)]
    pub handedness: Option<String>,
}

fn least_score() -> f32 {
    0.5
}

/// A hand in a part of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenHand {
    /// The points of the hand; the score of each is the score of the hand.
    pub points: Vec<Point>,
    /// The confidence that there is a hand, 0 to 1.
    pub score: f32,
    /// Whether it is a right hand.
    pub is_right: bool,
}

impl Decode for Hand {
    fn decode(&self, outputs: &[Tensor], _: [usize; 2]) -> Result<Found, DecodeError> {
        let points = output(outputs, self.points.as_deref(), 0)?;
        let needed = self.names.len() * STRIDE;
        if points.values.len() != needed {
            return Err(misshaped(points, format!("{needed} numbers, {STRIDE} per point")));
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

/// Returns the number of an output that has only one.
fn only(tensor: &Tensor) -> Result<f32, DecodeError> {
    match tensor.values.as_slice() {
        [number] => Ok(*number),
        _ => Err(misshaped(tensor, "one number")),
    }
}

/// Returns the most confident hand for each of the [`SIDES`].
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
