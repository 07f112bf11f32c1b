//! Positions in a frame.

use teampulse_core::data::Data;
use teampulse_core::sample::Sample;
use teampulse_core::stream::{About, Channel, Origin, Shape, Signal, Stream};
use teampulse_core::time::Time;
use teampulse_messages::fields::header_frame;
use teampulse_messages::readout::Readout;

/// The message types with a position, each with the path to its point.
const TYPES: [(&str, &str); 4] = [
    ("nav_msgs/msg/Odometry", "pose.pose.position"),
    ("geometry_msgs/msg/PoseStamped", "pose.position"),
    ("geometry_msgs/msg/PoseWithCovarianceStamped", "pose.pose.position"),
    ("geometry_msgs/msg/PointStamped", "point"),
];
/// Words in topic names that indicate a goal instead of an actual position.
const WISHES: [&str; 3] = ["goal", "target", "initial"];

/// The newest position on a stream.
#[derive(Debug)]
pub(super) struct Place {
    readout: Readout,
    newest: Option<Newest>,
}

#[derive(Debug)]
struct Newest {
    at: Time,
    frame: String,
    x_m: f64,
    y_m: f64,
}

impl Place {
    /// Whether a stream carries positions of a person or a robot.
    pub fn is_one(stream: &Stream) -> bool {
        let of_one = matches!(stream.about, About::Person | About::Robot) && !stream.id.is_empty();
        let is_wish = |stream: &Stream| {
            let name = stream.subject().within(&stream.name).to_lowercase();
            stream.signal == Signal::Input || WISHES.iter().any(|word| name.contains(word))
        };
        of_one
            && stream.origin == Origin::Raw
            && path(stream).is_some()
            && !(stream.about == About::Robot && is_wish(stream))
    }

    /// The stream's position tracker, before the first message.
    pub fn of(stream: &Stream) -> Option<Place> {
        let path = path(stream)?;
        let axes = ["x", "y"].map(|axis| Channel::new(format!("{path}.{axis}"), "m"));
        Some(Place { readout: Readout::of_channels(stream, &axes)?, newest: None })
    }

    /// Takes in a message; one that cannot be decoded, or has no frame, does not count.
    pub fn take(&mut self, sample: &Sample) {
        let at = sample.measured;
        if self.newest.as_ref().is_some_and(|newest| newest.at > at) {
            return;
        }
        let Data::Message(bytes) = &sample.data else { return };
        let numbers = self.readout.read(&sample.data).and_then(|numbers| numbers.get(..2));
        let place = numbers.filter(|place| place.iter().all(|number| number.is_finite()));
        let (Some([x_m, y_m]), Some(frame)) = (place, header_frame(bytes)) else { return };
        let (x_m, y_m) = (*x_m, *y_m);
        match &mut self.newest {
            Some(newest) if newest.frame == frame => {
                (newest.at, newest.x_m, newest.y_m) = (at, x_m, y_m);
            }
            newest => *newest = Some(Newest { at, frame: frame.to_owned(), x_m, y_m }),
        }
    }

    /// Whether a position is known and not older than this.
    pub fn is_known_at(&self, now: Time, stale_secs: f64) -> bool {
        self.newest.as_ref().is_some_and(|newest| now.secs_since(newest.at) <= stale_secs)
    }

    /// The frame of the position; empty before the first position.
    pub fn frame(&self) -> &str {
        self.newest.as_ref().map_or("", |newest| &newest.frame)
    }

    /// The time of the position.
    pub fn at(&self) -> Time {
        self.newest.as_ref().map_or(Time::EPOCH, |newest| newest.at)
    }

    /// The horizontal distance to another position in the same frame [m].
    pub fn distance_m(&self, other: &Place) -> f64 {
        match (&self.newest, &other.newest) {
            (Some(one), Some(other)) => (one.x_m - other.x_m).hypot(one.y_m - other.y_m),
            _ => f64::NAN,
        }
    }
}

fn path(stream: &Stream) -> Option<&'static str> {
    let Shape::Message(schema) = &stream.shape else { return None };
    TYPES.iter().find(|(name, _)| *name == schema.name).map(|(_, path)| *path)
}
