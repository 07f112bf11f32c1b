//! `hri_msgs` of ROS4HRI (REP-155), versions 2.0 to 2.3 for ROS 2: observations of people.
//!
//! Positions are fractions of the picture's width and height, from the top left.

use super::message;
use super::std_msgs::Header;

/// The number of points of a face.
pub const FACE_POINTS: usize = 70;
/// The number of points of a body.
pub const BODY_POINTS: usize = 18;
/// The number of codes of facial action units.
pub const ACTION_UNITS: usize = 99;

/// A point in a picture, and how certain it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NormalizedPointOfInterest2D {
    /// The horizontal position, to the right [widths].
    pub x: f32,
    /// The vertical position, downwards [heights].
    pub y: f32,
    /// How certain the point is [0..1].
    pub c: f32,
}

message!(NormalizedPointOfInterest2D { x, y, c } = "hri_msgs/msg/NormalizedPointOfInterest2D");

/// A part of a picture: a face or a body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NormalizedRegionOfInterest2D {
    /// The time of the picture.
    pub header: Header,
    /// The left side [widths].
    pub xmin: f32,
    /// The top [heights].
    pub ymin: f32,
    /// The right side [widths].
    pub xmax: f32,
    /// The bottom [heights].
    pub ymax: f32,
    /// How certain the region is [0..1].
    pub c: f32,
}

message!(
    NormalizedRegionOfInterest2D { header, xmin, ymin, xmax, ymax, c } =
        "hri_msgs/msg/NormalizedRegionOfInterest2D"
);

/// The points of a face.
#[derive(Clone, Debug, PartialEq)]
pub struct FacialLandmarks {
    /// The time of the picture.
    pub header: Header,
    /// The points, in the order of [`LANDMARKS`]; all zeros for a point that was not found.
    pub landmarks: [NormalizedPointOfInterest2D; FACE_POINTS],
    /// The height of the picture [px].
    pub height: u32,
    /// The width of the picture [px].
    pub width: u32,
}

message!(FacialLandmarks { header, landmarks, height, width } = "hri_msgs/msg/FacialLandmarks");

impl Default for FacialLandmarks {
    fn default() -> FacialLandmarks {
        let landmarks = [NormalizedPointOfInterest2D::default(); FACE_POINTS];
        FacialLandmarks { header: Header::default(), landmarks, height: 0, width: 0 }
    }
}

/// The points of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Skeleton2D {
    /// The time of the picture.
    pub header: Header,
    /// The points, in the order of [`SKELETON`]; all zeros for a point that was not found.
    pub skeleton: [NormalizedPointOfInterest2D; BODY_POINTS],
}

message!(Skeleton2D { header, skeleton } = "hri_msgs/msg/Skeleton2D");

impl Default for Skeleton2D {
    fn default() -> Skeleton2D {
        let skeleton = [NormalizedPointOfInterest2D::default(); BODY_POINTS];
        Skeleton2D { header: Header::default(), skeleton }
    }
}

/// The intensities of facial action units, each at the index of its code.
#[derive(Clone, Debug, PartialEq)]
pub struct FacialActionUnits {
    /// The time of the picture.
    pub header: Header,
    /// The intensity of each unit.
    pub intensity: [f32; ACTION_UNITS],
    /// How certain each intensity is [0..1].
    pub confidence: [f32; ACTION_UNITS],
}

message!(FacialActionUnits { header, intensity, confidence } = "hri_msgs/msg/FacialActionUnits");

impl Default for FacialActionUnits {
    fn default() -> FacialActionUnits {
        let none = [0.0; ACTION_UNITS];
        FacialActionUnits { header: Header::default(), intensity: none, confidence: none }
    }
}

/// The expression of a face.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Expression {
    /// The time of the picture.
    pub header: Header,
    /// One of [`EXPRESSIONS`]; empty if there is none.
    pub expression: String,
    /// How pleasant the emotion is [-1..1].
    pub valence: f32,
    /// How aroused the person is [-1..1].
    pub arousal: f32,
    /// How certain the expression is [0..1].
    pub confidence: f32,
}

message!(
    Expression { header, expression, valence, arousal, confidence } = "hri_msgs/msg/Expression"
);

/// Who looks at whom.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gaze {
    /// The time of the observation.
    pub header: Header,
    /// Who looks; empty for the robot.
    pub sender: String,
    /// Who is looked at; empty for the robot.
    pub receiver: String,
}

message!(Gaze { header, sender, receiver } = "hri_msgs/msg/Gaze");

/// The ids of faces, bodies or persons.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IdsList {
    /// The time of the observation.
    pub header: Header,
    /// The ids.
    pub ids: Vec<String>,
}

message!(IdsList { header, ids } = "hri_msgs/msg/IdsList");

/// How engaged a person is with the robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EngagementLevel {
    /// The time of the observation.
    pub header: Header,
    /// 0 unknown, 1 disengaged, 2 engaging, 3 engaged, 4 disengaging.
    pub level: u8,
}

message!(EngagementLevel { header, level } = "hri_msgs/msg/EngagementLevel");

/// The points of a face, as `FacialLandmarks` names them, in lower case and in the order of their codes. Right and left
/// are the person's.
pub const LANDMARKS: [&str; FACE_POINTS] = [
    "right_ear",
    "right_profile_1",
    "right_profile_2",
    "right_profile_3",
    "right_profile_4",
    "right_profile_5",
    "right_profile_6",
    "right_profile_7",
    "menton",
    "left_profile_7",
    "left_profile_6",
    "left_profile_5",
    "left_profile_4",
    "left_profile_3",
    "left_profile_2",
    "left_profile_1",
    "left_ear",
    "right_eyebrow_outside",
    "right_eyebrow_1",
    "right_eyebrow_2",
    "right_eyebrow_3",
    "right_eyebrow_inside",
    "left_eyebrow_inside",
    "left_eyebrow_3",
    "left_eyebrow_2",
    "left_eyebrow_1",
    "left_eyebrow_outside",
    "sellion",
    "nose_1",
    "nose_2",
    "nose",
    "nostril_1",
    "nostril_2",
    "nostril_3",
    "nostril_4",
    "nostril_5",
    "right_eye_outside",
    "right_eye_top_1",
    "right_eye_top_2",
    "right_eye_inside",
    "right_eye_bottom_2",
    "right_eye_bottom_1",
    "left_eye_inside",
    "left_eye_top_2",
    "left_eye_top_1",
    "left_eye_outside",
    "left_eye_bottom_1",
    "left_eye_bottom_2",
    "mouth_outer_right",
    "mouth_outer_top_1",
    "mouth_outer_top_2",
    "mouth_outer_top_3",
    "mouth_outer_top_4",
    "mouth_outer_top_5",
    "mouth_outer_left",
    "mouth_outer_bottom_5",
    "mouth_outer_bottom_4",
    "mouth_outer_bottom_3",
    "mouth_outer_bottom_2",
    "mouth_outer_bottom_1",
    "mouth_inner_right",
    "mouth_inner_top_1",
    "mouth_inner_top_2",
    "mouth_inner_top_3",
    "mouth_inner_left",
    "mouth_inner_bottom_3",
    "mouth_inner_bottom_2",
    "mouth_inner_bottom_1",
    "right_pupil",
    "left_pupil",
];

/// The points of a body, as `Skeleton2D` names them, in lower case and in the order of their codes.
pub const SKELETON: [&str; BODY_POINTS] = [
    "nose",
    "neck",
    "right_shoulder",
    "right_elbow",
    "right_wrist",
    "left_shoulder",
    "left_elbow",
    "left_wrist",
    "right_hip",
    "right_knee",
    "right_ankle",
    "left_hip",
    "left_knee",
    "left_ankle",
    "left_eye",
    "right_eye",
    "left_ear",
    "right_ear",
];

/// The words for expressions.
pub const EXPRESSIONS: [&str; 25] = [
    "neutral",
    "angry",
    "sad",
    "happy",
    "surprised",
    "disgusted",
    "scared",
    "pleading",
    "vulnerable",
    "despaired",
    "guilty",
    "disappointed",
    "embarrassed",
    "horrified",
    "skeptical",
    "annoyed",
    "furious",
    "suspicious",
    "rejected",
    "bored",
    "tired",
    "asleep",
    "confused",
    "amazed",
    "excited",
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::shipped;
    use crate::standard::Message;

    /// The names of the constants of a type, in the order of their numbers; none for an unused one.
    fn constants(type_name: &str) -> Vec<Option<String>> {
        let schema = shipped(type_name).expect("it is shipped");
        let mut names = Vec::new();
        for line in schema.text.lines().filter_map(|line| line.strip_prefix("uint8 ")) {
            let Some((name, code)) = line.split_once('=') else { continue };
            let code: usize = code.trim().parse().expect("a number");
            names.resize(names.len().max(code + 1), None);
            names[code] = Some(name.trim().to_lowercase());
        }
        names
    }

    #[test]
    fn names_of_points_are_those_of_their_codes() {
        let named = |names: &[&str]| -> Vec<Option<String>> {
            names.iter().map(|name| Some((*name).to_owned())).collect()
        };
        assert_eq!(constants(FacialLandmarks::NAME), named(&LANDMARKS));
        assert_eq!(constants(Skeleton2D::NAME), named(&SKELETON));
        let text = &shipped(Expression::NAME).unwrap().text;
        let words: Vec<&str> = text.lines().filter_map(|line| line.split('"').nth(1)).collect();
        assert_eq!(words, EXPRESSIONS);
    }

    #[test]
    fn a_message_is_read_as_it_was_written() {
        let mut face = FacialLandmarks { height: 480, width: 640, ..FacialLandmarks::default() };
        face.landmarks[69] = NormalizedPointOfInterest2D { x: 0.5, y: 0.25, c: 1.0 };
        assert_eq!(FacialLandmarks::decode(&face.encode()).as_ref(), Ok(&face));
        let mut units = FacialActionUnits::default();
        units.intensity[12] = 0.75;
        assert_eq!(FacialActionUnits::decode(&units.encode()), Ok(units));
        let seen = Expression { expression: "happy".into(), valence: 0.5, ..Expression::default() };
        assert_eq!(Expression::decode(&seen.encode()), Ok(seen));
    }
}
