//! Measures of camera frames that need no model.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::Data;
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::pattern::Pattern;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Record;
use teampulse_core::sink::Wants;
use teampulse_core::source::Reading;
use teampulse_core::stream::{Shape, Signal, Stream, StreamId, Subject};
use teampulse_core::time::Time;
use teampulse_core::worker::{Fed, Feed, Worker, WorkerError};
use teampulse_messages::pictures::{COMPRESSED_IMAGE, IMAGE};
use teampulse_vision::frame;
use teampulse_vision::picture::{Picture, PictureError};

use crate::WorkerContext;

/// The interval at which the end of the session is checked for while no frame arrives.
const LOOK: Duration = Duration::from_millis(500);
/// The values of a frame.
const CHANNELS: &[(&str, &str)] = &[
    ("brightness", "1"),
    ("sharpness", "1"),
    ("moving", "1"),
    ("motion", "1"),
    ("presence", "1"),
    ("skin", "1"),
    ("red", "1"),
    ("green", "1"),
    ("blue", "1"),
];
/// Last tokens of topic names that do not name a camera.
pub(crate) const OF_TRANSPORTS: &[&str] =
    &["compressed", "image", "image_raw", "image_rect", "image_color"];

/// Measures of camera frames that need no model: brightness, sharpness, movement, the presence of a person, and the
/// mean skin colour. The pictures themselves are not passed on.
///
/// A frame takes a few milliseconds. Under overload, the newest frame of each camera is processed next; skipped frames
/// are counted. A picture that cannot be decoded is reported as a fault and counted as lost, and the next one is tried.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Frames {
    /// The cameras, by the names of their streams; `*` matches a part of a token: `"/robot1/front/compressed"`.
    pub streams: Vec<Pattern>,
    /// The person in view of these cameras. By default the values are about the subject of the pictures: the robot
    /// that carries the camera.
    #[serde(default)]
    pub person: Option<String>,
}

impl Component<dyn Worker, WorkerContext> for Frames {
    const EXAMPLE: &'static str = r#"
streams = ["/robot1/front/compressed"]
person  = "p001"
"#;

    fn build(self, _: &WorkerContext) -> Result<Box<dyn Worker>, SettingsError> {
        if self.streams.is_empty() {
            let error = SettingsError::new("no camera is selected").at("streams");
            return Err(error.with_hint("name its stream, such as \"/robot1/front/compressed\""));
        }
        Ok(Box::new(self))
    }
}

impl Worker for Frames {
    fn wants(&self) -> Wants {
        let patterns = self.streams.clone();
        Wants::Only(Box::new(move |stream| {
            type_of(stream).is_some() && patterns.iter().any(|it| it.matches(&stream.name))
        }))
    }

    fn run(&mut self, feed: &Feed, outlet: &Outlet) -> Result<(), WorkerError> {
        let mut cameras = BTreeMap::<StreamId, Camera>::new();
        loop {
            let records = match feed.next_one(LOOK) {
                Fed::Records(records) => records,
                Fed::Silence | Fed::Command(_) => continue,
                Fed::Closed => return Ok(()),
            };
            for record in records {
                let id = record.sample.stream;
                let camera = cameras.entry(id).or_insert_with(|| self.camera(&record, outlet));
                camera.look(&record, outlet);
            }
        }
    }
}

impl Frames {
    /// Declares the stream of a camera's values.
    fn camera(&self, record: &Record, outlet: &Outlet) -> Camera {
        let pictures = &record.stream;
        let (name, subject) = match &self.person {
            Some(person) => {
                let name = format!("/humans/persons/{person}/{}/frames", named(&pictures.name));
                (name, Subject::person(person.clone()))
            }
            None => (format!("{}/frames", pictures.name), pictures.subject()),
        };
        let stream = Stream {
            signal: Signal::Video,
            // No device: results of late frames keep the time of their frame.
            device: String::new(),
            // Skipped frames do not count as missing.
            rate_hz: 0.0,
            inputs: vec![pictures.name.clone()],
            doc: "measures of each camera frame, without the picture".to_owned(),
            ..Stream::raw(name, subject, Shape::Sample)
        };
        let stream = outlet.declare(stream.with_channels(CHANNELS));
        Camera { stream, frames: frame::Frames::default(), failing: None }
    }
}

/// The name of a camera, from its topic: `robot1_front` for `/robot1/front/compressed`.
pub(crate) fn named(topic: &str) -> String {
    let mut tokens: Vec<&str> = topic.split('/').filter(|token| !token.is_empty()).collect();
    while tokens.len() > 1 && tokens.last().is_some_and(|last| OF_TRANSPORTS.contains(last)) {
        tokens.pop();
    }
    tokens.join("_")
}

/// The message type of a stream, if its messages are pictures.
pub(crate) fn type_of(stream: &Stream) -> Option<&'static str> {
    let Shape::Message(schema) = &stream.shape else { return None };
    [COMPRESSED_IMAGE, IMAGE].into_iter().find(|name| *name == schema.name)
}

/// A camera that is being processed.
struct Camera {
    stream: StreamId,
    frames: frame::Frames,
    /// Why the camera's last frame could not be decoded; reported once, until a frame can be decoded.
    failing: Option<PictureError>,
}

impl Camera {
    fn look(&mut self, record: &Record, outlet: &Outlet) {
        let Data::Message(message) = &record.sample.data else { return };
        let Some(type_name) = type_of(&record.stream) else { return };
        match Picture::read(type_name, message) {
            Ok(picture) => {
                self.failing = None;
                self.offer(&picture, record.sample.measured, outlet);
            }
            Err(error) => {
                outlet.lost(self.stream, 1);
                if self.failing.as_ref() != Some(&error) {
                    let name = &record.stream.name;
                    outlet.happen(passing(format!("{name}: failed to {error}")));
                }
                self.failing = Some(error);
            }
        }
    }

    fn offer(&mut self, picture: &Picture, taken: Time, outlet: &Outlet) {
        let frame = self.frames.push(picture, taken.nanos() as f64 / 1e9);
        let frame::Frame { brightness, sharpness, moving, motion, is_present, skin, colour } =
            frame;
        let ([red, green, blue], presence) = (colour, f64::from(u8::from(is_present)));
        let numbers = [brightness, sharpness, moving, motion, presence, skin, red, green, blue];
        outlet.offer(Reading {
            stream: self.stream,
            index: None,
            device_time: None,
            source_time: Some(taken),
            data: Data::Sample(Arc::new(numbers)),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_is_named_by_its_topic() {
        for (topic, name) in [
            ("/robot1/front/compressed", "robot1_front"),
            ("/robot1/front/image_raw/compressed", "robot1_front"),
            ("/lab/side/image_raw", "lab_side"),
            ("/image", "image"),
        ] {
            assert_eq!(named(topic), name);
        }
    }
}
