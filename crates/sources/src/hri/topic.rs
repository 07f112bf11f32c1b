//! What a topic contains, by its name and type.

use teampulse_messages::hri::Kind;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::geometry_msgs::PoseStamped;
use teampulse_messages::standard::nav_msgs::Odometry;
use teampulse_messages::standard::std_msgs::Text;

/// The type of a body's position, as published by `hri_body_detect`.
const POINT: &str = "geometry_msgs/msg/PointStamped";

/// The types of positions, each with the path to its point.
const POSITIONS: [(&str, &str); 4] = [
    (POINT, "point"),
    (PoseStamped::NAME, "pose.position"),
    ("geometry_msgs/msg/PoseWithCovarianceStamped", "pose.pose.position"),
    (Odometry::NAME, "pose.pose.position"),
];

/// A part of a person that is detected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    /// A face.
    Face,
    /// A body.
    Body,
}

/// The content of a topic.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Topic {
    /// A quantity of a face.
    Face { id: String, kind: Kind },
    /// A quantity of a body.
    Body { id: String, kind: Kind },
    /// A quantity of a person.
    Person { id: String, kind: Kind },
    /// Who looks at whom.
    Gazing,
    /// The position of a body, with the path to its point.
    BodyPosition { id: String, path: &'static str },
    /// The position of a person of the study, with the path to its point.
    Position { path: &'static str },
    /// The assignment of a face or body to a person.
    Match { person: String, part: Part },
}

impl Topic {
    /// Classifies the topic with this name and type below a namespace.
    pub fn of(namespace: &str, name: &str, type_name: &str) -> Option<Topic> {
        let below = name.strip_prefix(namespace.trim_end_matches('/'))?.strip_prefix('/')?;
        if below == "interactions/gazing" {
            return (Kind::of_type(type_name) == Some(Kind::Gaze)).then_some(Topic::Gazing);
        }
        let (group, rest) = below.split_once('/')?;
        let (id, last) = rest.split_once('/')?;
        let kind = Kind::of_type(type_name).filter(|kind| kind.topic() == last);
        let id = Some(id).filter(|id| !id.is_empty())?.to_owned();
        match (group, kind) {
            ("faces", Some(Kind::Skeleton | Kind::Engagement)) => None,
            ("faces", Some(kind)) => Some(Topic::Face { id, kind }),
            ("bodies", Some(kind @ Kind::Skeleton)) => Some(Topic::Body { id, kind }),
            ("bodies", None) if last == "position" && type_name == POINT => {
                Some(Topic::BodyPosition { id, path: path(type_name)? })
            }
            ("persons", Some(kind @ (Kind::Engagement | Kind::Expression))) => {
                Some(Topic::Person { id, kind })
            }
            ("persons", None) if type_name == Text::NAME => {
                let part = match last {
                    "face_id" => Part::Face,
                    "body_id" => Part::Body,
                    _ => return None,
                };
                Some(Topic::Match { person: id, part })
            }
            _ => None,
        }
    }

    /// Returns a topic that may hold the position of a person of the study.
    pub fn of_position(name: &str, type_name: &str) -> Option<Topic> {
        (!name.is_empty()).then(|| path(type_name))?.map(|path| Topic::Position { path })
    }
}

/// Returns the path to the point in messages of a type; `None` if it is not a position type.
fn path(type_name: &str) -> Option<&'static str> {
    POSITIONS.iter().find(|(name, _)| *name == type_name).map(|(_, path)| *path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(name: &str, type_name: &str) -> Option<Topic> {
        Topic::of("/humans", name, type_name)
    }

    #[test]
    fn topics_of_faces_bodies_and_persons_are_known() {
        let id = || "bf3d".to_owned();
        let face = of("/humans/faces/bf3d/landmarks", "hri_msgs/msg/FacialLandmarks");
        assert_eq!(face, Some(Topic::Face { id: id(), kind: Kind::Landmarks }));
        let body = of("/humans/bodies/bf3d/skeleton2d", "hri_msgs/msg/Skeleton2D");
        assert_eq!(body, Some(Topic::Body { id: id(), kind: Kind::Skeleton }));
        let matched = of("/humans/persons/bf3d/face_id", Text::NAME);
        assert_eq!(matched, Some(Topic::Match { person: id(), part: Part::Face }));
        assert_eq!(of("/humans/interactions/gazing", "hri_msgs/msg/Gaze"), Some(Topic::Gazing));
        assert_eq!(
            of("/humans/bodies/bf3d/position", POINT),
            Some(Topic::BodyPosition { id: id(), path: "point" })
        );
    }

    #[test]
    fn other_topics_and_other_types_are_left_alone() {
        for (name, type_name) in [
            ("/humans/faces/bf3d/landmarks", "hri_msgs/msg/Skeleton2D"),
            ("/humans/faces/bf3d/cropped", "sensor_msgs/msg/Image"),
            ("/humans/faces/tracked", "hri_msgs/msg/IdsList"),
            ("/humans/persons/p001/hri/landmarks", "teampulse_msgs/msg/Sample"),
            ("/humans/persons/bf3d/name", Text::NAME),
            ("/humans/faces//landmarks", "hri_msgs/msg/FacialLandmarks"),
            ("/robots/faces/bf3d/landmarks", "hri_msgs/msg/FacialLandmarks"),
            ("/humansfaces/bf3d/landmarks", "hri_msgs/msg/FacialLandmarks"),
        ] {
            assert_eq!(of(name, type_name), None, "{name} {type_name}");
        }
        assert_eq!(Topic::of_position("/mocap/p001", "std_msgs/msg/String"), None);
    }
}
