//! Converts messages of `hri_msgs` (REP-155), in which other programs report what they see of people, to numbers with
//! the same names and units as those of our own models.
//!
//! | message | numbers |
//! |---|---|
//! | `FacialLandmarks`, `Skeleton2D` | x, y [px] and score of each point; the size of the frame [px] |
//! | `Expression` | a probability of each word, valence, arousal |
//! | `FacialActionUnits` | the intensity and the score of each unit of [`UNITS`] |
//! | `Gaze` | whether the robot is looked at |
//! | `EngagementLevel` | the level |
//!
//! Values that a message leaves at zero are unknown, not zero: a point without position and score, a unit without
//! intensity and score, valence and arousal that are both 0, an expression without confidence.

use teampulse_core::text::label;
use teampulse_core::time::Time;
use thiserror::Error;

use crate::cdr::CdrError;
use crate::standard::Message;
use crate::standard::hri_msgs::{
    ACTION_UNITS, EXPRESSIONS, EngagementLevel, Expression, FacialActionUnits, FacialLandmarks,
    Gaze, LANDMARKS, NormalizedPointOfInterest2D, SKELETON, Skeleton2D,
};
use crate::standard::std_msgs::Header;

/// The codes of the facial action units that are read: movements of the face itself, and closed eyes.
pub const UNITS: [u8; 30] = [
    1, 2, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27,
    28, 43, 45, 46,
];

/// The channels with the size of the frame to which points refer.
pub const FRAME_CHANNELS: [&str; 2] = ["frame_width", "frame_height"];

/// How far outside the picture a coordinate of a point may be [widths, heights]; beyond this it is taken as unknown.
const MOST_OUTSIDE: f32 = 1.0;
/// The largest plausible intensity of a unit; programs use 0 to 1 or 0 to 5.
const MOST_INTENSITY: f32 = 10.0;
/// The largest side of a frame [px].
const MOST_PIXELS: u32 = 65_536;
/// The longest unknown word that is repeated in an error [bytes].
const SHOWN_BYTES: usize = 40;

/// Width and height of a camera's frame [px].
pub type Frame = [u32; 2];

/// A kind of message that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Points of a face.
    Landmarks,
    /// Facial action units.
    ActionUnits,
    /// The expression of a face.
    Expression,
    /// Who looks at whom.
    Gaze,
    /// Points of a body.
    Skeleton,
    /// How engaged somebody is with the robot.
    Engagement,
}

/// The contents of a message.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// The stamp of the message's header; `None` if it is zero.
    pub stamp: Option<Time>,
    /// Who looks, for a gaze; empty for other kinds.
    pub sender: String,
    /// The numbers, one per channel; NaN if unknown.
    pub numbers: Vec<f64>,
}

/// Why a message can't be read. It fits after "failed to".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum HriError {
    /// The message is truncated, or not of this type.
    #[error("read a message about faces or bodies: {0}")]
    Message(#[from] CdrError),
    /// The pixels of points can't be computed, as the size of the frame is unknown.
    #[error("find the size of the camera's frame in a message: give it as `frame = [640, 480]`")]
    Size,
    /// An expression that `hri_msgs` does not list.
    #[error("read the expression `{0}`: not a word of hri_msgs/Expression")]
    Word(String),
}

impl Kind {
    /// All kinds.
    pub const ALL: [Kind; 6] = [
        Kind::Landmarks,
        Kind::ActionUnits,
        Kind::Expression,
        Kind::Gaze,
        Kind::Skeleton,
        Kind::Engagement,
    ];

    /// The kind of a message type.
    pub fn of_type(type_name: &str) -> Option<Kind> {
        Kind::ALL.into_iter().find(|kind| kind.type_name() == type_name)
    }

    /// The message type of this kind.
    pub fn type_name(self) -> &'static str {
        match self {
            Kind::Landmarks => FacialLandmarks::NAME,
            Kind::ActionUnits => FacialActionUnits::NAME,
            Kind::Expression => Expression::NAME,
            Kind::Gaze => Gaze::NAME,
            Kind::Skeleton => Skeleton2D::NAME,
            Kind::Engagement => EngagementLevel::NAME,
        }
    }

    /// The last token of the topic, as in REP-155 and libhri.
    pub fn topic(self) -> &'static str {
        match self {
            Kind::Landmarks => "landmarks",
            Kind::ActionUnits => "facs",
            Kind::Expression => "expression",
            Kind::Gaze => "gaze",
            Kind::Skeleton => "skeleton2d",
            Kind::Engagement => "engagement_status",
        }
    }

    /// The names and units of the numbers. A skeleton does not state the size of its frame: if `frame` is `None`,
    /// positions are fractions of the width and the height.
    pub fn channels(self, frame: Option<Frame>) -> Vec<(String, &'static str)> {
        let named = |name: &str, unit| vec![(name.to_owned(), unit)];
        match self {
            Kind::Landmarks => points(&LANDMARKS, true),
            Kind::Skeleton => points(&SKELETON, frame.is_some()),
            Kind::Expression => {
                let words = EXPRESSIONS.into_iter().chain(["valence", "arousal"]);
                words.map(|word| (word.to_owned(), "1")).collect()
            }
            Kind::ActionUnits => {
                let both = |code: &u8| [format!("AU{code:02}"), format!("AU{code:02}_score")];
                UNITS.iter().flat_map(both).map(|name| (name, "1")).collect()
            }
            Kind::Gaze => named("at_robot", "1"),
            Kind::Engagement => named("level", "1"),
        }
    }

    /// Reads a message of this kind. `frame` is the frame of the camera, which is used if the message states none.
    pub fn read(self, cdr: &[u8], frame: Option<Frame>) -> Result<Sighting, HriError> {
        let (header, numbers) = match self {
            Kind::Landmarks => {
                let face = FacialLandmarks::decode(cdr)?;
                let stated = Some([face.width, face.height]).filter(is_frame);
                let frame = stated.or(frame).ok_or(HriError::Size)?;
                (face.header, placed(&face.landmarks, Some(frame)))
            }
            Kind::Skeleton => {
                let body = Skeleton2D::decode(cdr)?;
                (body.header, placed(&body.skeleton, frame))
            }
            Kind::Expression => {
                let seen = Expression::decode(cdr)?;
                let numbers = expressed(&seen)?;
                (seen.header, numbers)
            }
            Kind::ActionUnits => {
                let units = FacialActionUnits::decode(cdr)?;
                let numbers = UNITS.iter().flat_map(|code| unit(&units, *code)).collect();
                (units.header, numbers)
            }
            Kind::Gaze => {
                let Gaze { header, sender, receiver } = Gaze::decode(cdr)?;
                let at_robot = f64::from(u8::from(receiver.is_empty()));
                return Ok(Sighting { sender, ..Sighting::of(&header, vec![at_robot]) });
            }
            Kind::Engagement => {
                let engaged = EngagementLevel::decode(cdr)?;
                let level = Some(engaged.level).filter(|level| (1..=4).contains(level));
                (engaged.header, vec![level.map_or(f64::NAN, f64::from)])
            }
        };
        Ok(Sighting::of(&header, numbers))
    }
}

impl Sighting {
    fn of(header: &Header, numbers: Vec<f64>) -> Sighting {
        let stamp = Some(header.stamp).filter(|stamp| *stamp != Time::EPOCH);
        Sighting { stamp, sender: String::new(), numbers }
    }
}

/// Whether a frame has a valid size.
pub fn is_frame(frame: &Frame) -> bool {
    frame.iter().all(|side| (1..=MOST_PIXELS).contains(side))
}

fn points(names: &[&str], is_sized: bool) -> Vec<(String, &'static str)> {
    let unit = if is_sized { "px" } else { "1" };
    let each = |name: &&str| {
        [("x", unit), ("y", unit), ("score", "1")]
            .map(|(part, unit)| (format!("{name}_{part}"), unit))
    };
    let size = FRAME_CHANNELS.map(|name| (name.to_owned(), "px"));
    names.iter().flat_map(each).chain(size.into_iter().filter(|_| is_sized)).collect()
}

/// The positions and scores of points, in pixels of a frame or as fractions of it, and the size of the frame.
fn placed(points: &[NormalizedPointOfInterest2D], frame: Option<Frame>) -> Vec<f64> {
    let [width, height] = frame.map_or([1.0; 2], |frame| frame.map(f64::from));
    // If a program states no score at all, all of its points count as certain.
    let is_scored = points.iter().any(|point| point.c != 0.0);
    let each = |point: &NormalizedPointOfInterest2D| {
        if [point.x, point.y, point.c].iter().all(|number| *number == 0.0) {
            return [f64::NAN, f64::NAN, 0.0];
        }
        let at = |part: f32, side: f64| {
            let is_near = (-MOST_OUTSIDE..=1.0 + MOST_OUTSIDE).contains(&part);
            if is_near { f64::from(part) * side } else { f64::NAN }
        };
        let score = if is_scored { share(point.c).unwrap_or(0.0) } else { 1.0 };
        [at(point.x, width), at(point.y, height), score]
    };
    let size = frame.map(|frame| frame.map(f64::from)).into_iter().flatten();
    points.iter().flat_map(each).chain(size).collect()
}

/// A number if it is a fraction [0..1]; otherwise `None`.
fn share(number: f32) -> Option<f64> {
    (0.0..=1.0).contains(&number).then(|| f64::from(number))
}

/// The probabilities of the words, valence and arousal. The stated word has its confidence as its probability; all
/// other words share the rest evenly.
fn expressed(seen: &Expression) -> Result<Vec<f64>, HriError> {
    let word = seen.expression.trim();
    let place = EXPRESSIONS.iter().position(|each| each.eq_ignore_ascii_case(word));
    if place.is_none() && !word.is_empty() {
        return Err(HriError::Word(label(word.to_owned(), SHOWN_BYTES)));
    }
    let confidence = share(seen.confidence).filter(|confidence| *confidence > 0.0);
    let mut numbers = vec![f64::NAN; EXPRESSIONS.len()];
    if let (Some(place), Some(confidence)) = (place, confidence) {
        numbers.fill((1.0 - confidence) / (EXPRESSIONS.len() - 1) as f64);
        numbers[place] = confidence;
    }
    let is_stated = (seen.valence, seen.arousal) != (0.0, 0.0);
    let dimension = |number: f32| {
        let is_one = is_stated && (-1.0..=1.0).contains(&number);
        if is_one { f64::from(number) } else { f64::NAN }
    };
    numbers.extend([seen.valence, seen.arousal].map(dimension));
    Ok(numbers)
}

/// The intensity of a unit, and its score.
fn unit(units: &FacialActionUnits, code: u8) -> [f64; 2] {
    const { assert!(UNITS[UNITS.len() - 1] < ACTION_UNITS as u8) };
    let place = usize::from(code);
    let (intensity, score) = (units.intensity[place], units.confidence[place]);
    let is_unknown = (intensity, score) == (0.0, 0.0);
    if is_unknown || !(0.0..=MOST_INTENSITY).contains(&intensity) {
        return [f64::NAN, 0.0];
    }
    [f64::from(intensity), share(score).unwrap_or(f64::NAN)]
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these are exact")]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn point(x: f32, y: f32, c: f32) -> NormalizedPointOfInterest2D {
        NormalizedPointOfInterest2D { x, y, c }
    }

    fn number(kind: Kind, sighting: &Sighting, name: &str) -> f64 {
        let channels = kind.channels(Some([1, 1]));
        sighting.numbers[channels.iter().position(|(each, _)| each == name).unwrap()]
    }

    #[test]
    fn points_of_a_face_are_pixels_of_the_frame_that_the_message_states() {
        let mut face = FacialLandmarks { width: 640, height: 480, ..FacialLandmarks::default() };
        face.header.stamp = Time::from_stamp(7, 5);
        face.landmarks[36] = point(0.5, 0.25, 0.75);
        face.landmarks[37] = point(f32::NAN, 3.0, 7.0);
        let seen = Kind::Landmarks.read(&face.encode(), Some([9, 9])).unwrap();
        let of = |name: &str| number(Kind::Landmarks, &seen, name);
        assert_eq!(["right_eye_outside_x", "right_eye_outside_y"].map(of), [320.0, 120.0]);
        assert_eq!((of("right_eye_outside_score"), of("frame_width")), (0.75, 640.0));
        assert!(of("right_eye_top_1_x").is_nan() && of("right_eye_top_1_y").is_nan());
        assert_eq!(of("right_eye_top_1_score"), 0.0);
        assert!(of("menton_x").is_nan());
        assert_eq!(seen.stamp, Some(Time::from_stamp(7, 5)));
        let face = FacialLandmarks { width: 0, ..face };
        assert_eq!(Kind::Landmarks.read(&face.encode(), None), Err(HriError::Size));
        let seen = Kind::Landmarks.read(&face.encode(), Some([100, 50])).unwrap();
        assert_eq!(number(Kind::Landmarks, &seen, "right_eye_outside_x"), 50.0);
    }

    #[test]
    fn a_skeleton_is_in_pixels_only_where_the_frame_is_known() {
        let mut body = Skeleton2D::default();
        body.skeleton[2] = point(0.5, 0.5, 0.0);
        let seen = Kind::Skeleton.read(&body.encode(), Some([640, 480])).unwrap();
        let of = |name: &str| number(Kind::Skeleton, &seen, name);
        let shoulder = ["right_shoulder_x", "right_shoulder_y", "right_shoulder_score"];
        assert_eq!(shoulder.map(of), [320.0, 240.0, 1.0], "no point has a score");
        let seen = Kind::Skeleton.read(&body.encode(), None).unwrap();
        assert_eq!(seen.numbers[6..9], [0.5, 0.5, 1.0]);
        assert_eq!(Kind::Skeleton.channels(None)[6], ("right_shoulder_x".to_owned(), "1"));
    }

    #[test]
    fn an_expression_is_the_probability_of_each_word() {
        let read = |expression: &str, confidence: f32, valence: f32| {
            let seen = Expression {
                expression: expression.to_owned(),
                confidence,
                valence,
                ..Expression::default()
            };
            Kind::Expression.read(&seen.encode(), None)
        };
        let happy = read("Happy", 0.75, 0.5).unwrap();
        let of = |name: &str| number(Kind::Expression, &happy, name);
        assert_eq!(["happy", "valence", "arousal"].map(of), [0.75, 0.5, 0.0]);
        assert!((happy.numbers[..25].iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let unsure = read("happy", 0.0, 0.0).unwrap();
        assert!(unsure.numbers.iter().all(|number| number.is_nan()));
        let dimensions = read("", 0.9, -0.5).unwrap();
        assert!(dimensions.numbers[..25].iter().all(|number| number.is_nan()));
        assert_eq!(number(Kind::Expression, &dimensions, "valence"), -0.5);
        assert_eq!(read("glad", 0.5, 0.0), Err(HriError::Word("glad".into())));
    }

    #[test]
    fn units_that_were_not_examined_are_unknown() {
        let mut units = FacialActionUnits::default();
        (units.intensity[12], units.confidence[12]) = (0.5, 0.9);
        units.confidence[45] = 0.75;
        units.intensity[4] = f32::INFINITY;
        let seen = Kind::ActionUnits.read(&units.encode(), None).unwrap();
        let of = |name: &str| number(Kind::ActionUnits, &seen, name);
        assert_eq!(["AU12", "AU45", "AU45_score"].map(of), [0.5, 0.0, 0.75]);
        assert!(of("AU04").is_nan() && of("AU01").is_nan());
    }

    #[test]
    fn a_gaze_without_a_receiver_is_at_the_robot() {
        let read = |receiver: &str| {
            let gaze =
                Gaze { sender: "p001".into(), receiver: receiver.to_owned(), ..Gaze::default() };
            Kind::Gaze.read(&gaze.encode(), None).unwrap()
        };
        assert_eq!((read("").numbers[0], read("p002").numbers[0]), (1.0, 0.0));
        assert_eq!(read("").sender, "p001");
    }

    proptest! {
        #[test]
        fn any_bytes_are_bounded_numbers_or_an_error(
            bytes in prop::collection::vec(any::<u8>(), 0..1200),
            is_sized: bool,
        ) {
            let frame = is_sized.then_some([640, 480]);
            for kind in Kind::ALL {
                let cdr = [&[0, 1, 0, 0], bytes.as_slice()].concat();
                if let Ok(seen) = kind.read(&cdr, frame) {
                    prop_assert_eq!(seen.numbers.len(), kind.channels(frame).len());
                    let is_bounded = |number: &f64| number.is_nan() || number.abs() <= 2e5;
                    prop_assert!(seen.numbers.iter().all(is_bounded), "{:?}", seen);
                }
            }
        }
    }
}
