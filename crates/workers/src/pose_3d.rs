//! Places the points of a picture in space, with the depth picture of the same camera.

mod layout;
mod pairs;

use std::collections::BTreeMap;
use std::mem::{Discriminant, discriminant};
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
use teampulse_core::stream::{Shape, Stream, StreamId};
use teampulse_core::time::Time;
use teampulse_core::worker::{Fed, Feed, Worker, WorkerError};
use teampulse_messages::pictures::IMAGE;
use teampulse_vision::depth::{CAMERA_INFO, Depth, DepthError, Intrinsics, IntrinsicsError, Patch};
use thiserror::Error;

use crate::WorkerContext;
use layout::Layout;
use pairs::{Frame, Pairs};

/// The interval at which the end of the session and waiting frames are checked while nothing arrives.
const LOOK: Duration = Duration::from_millis(200);
/// The suffix of the names of streams with points in space.
const ENDING: &str = "_3d";
/// The largest value of `within_secs` [s].
const MOST_APART_SECS: f64 = 1.0;
/// The largest side of a patch [px].
const MOST_SIDE: u32 = 101;
/// The largest value of `most_spread_m` [m].
const MOST_SPREAD_M: f64 = 10.0;

/// Places the points of a picture in space. A model or another program finds the points in the colour pictures of a
/// depth camera; each point gets the median distance around it. Positions are in metres, in the camera's optical frame
/// (x to the right, y down, z forward).
///
/// The depth picture must show the same view (`aligned_depth_to_color` of a `RealSense`, `depth_registered` of others),
/// and a source must also read its `sensor_msgs/CameraInfo`. A point without a distance, or at an edge, where the
/// distance could belong to something else, is NaN and has the score 0; `holes` and `edges` count such points. A frame
/// without a depth picture from the same time is skipped and counted as lost.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pose3d {
    /// The streams of points in pixels, from models (`"/humans/persons/p001/robot1_front/rtmpose"`) or other programs
    /// (`"/humans/persons/p001/hri/skeleton2d"`); `*` matches a part of a token.
    pub points: Vec<Pattern>,
    /// The stream of depth pictures: `sensor_msgs/Image` with the encoding `16UC1` (millimetres) or `32FC1` (metres).
    pub depth: String,
    /// The stream with the calibration of the depth pictures. By default `camera_info` beside their stream.
    #[serde(default)]
    pub camera_info: Option<String>,
    /// The largest difference between the times of a frame and its depth picture [s].
    #[serde(default = "within_secs")]
    pub within_secs: f64,
    /// The side of the square around a point in which distances are measured [px].
    #[serde(default = "patch_px")]
    pub patch_px: u32,
    /// The largest spread of the distances in that square [m], without the nearest and the farthest tenth; beyond it,
    /// the point counts as at an edge.
    #[serde(default = "most_spread_m")]
    pub most_spread_m: f64,
}

fn within_secs() -> f64 {
    0.05
}

fn patch_px() -> u32 {
    7
}

fn most_spread_m() -> f64 {
    0.1
}

impl Component<dyn Worker, WorkerContext> for Pose3d {
    const EXAMPLE: &'static str = r#"
points = ["/humans/persons/p001/robot1_front/rtmpose"]
depth  = "/robot1/aligned_depth_to_color/image_raw"
"#;

    fn build(self, _: &WorkerContext) -> Result<Box<dyn Worker>, SettingsError> {
        let wrong = |message: &str, at: &str| Err(SettingsError::new(message).at(at));
        if self.points.is_empty() {
            return wrong("no stream of points is selected", "points").map_err(|error| {
                let hint = "name a stream, such as \"/humans/persons/p001/robot1_front/rtmpose\"";
                error.with_hint(hint)
            });
        }
        let topics = [("depth", Some(&self.depth)), ("camera_info", self.camera_info.as_ref())];
        for (at, topic) in topics.into_iter().filter_map(|(at, topic)| Some((at, topic?))) {
            if !topic.starts_with('/') || topic.contains('*') {
                let error = SettingsError::new(format!("`{topic}` is not the name of a stream"));
                return Err(error.at(at).with_hint("give it in full, with its leading slash"));
            }
        }
        if !(self.within_secs >= 0.0 && self.within_secs <= MOST_APART_SECS) {
            return wrong("the time difference must be from 0 to 1 s", "within_secs");
        }
        if !(1..=MOST_SIDE).contains(&self.patch_px) {
            return wrong("the side must be from 1 to 101 px", "patch_px");
        }
        if !(self.most_spread_m > 0.0 && self.most_spread_m <= MOST_SPREAD_M) {
            return wrong("the spread must be above 0 m and at most 10 m", "most_spread_m");
        }
        Ok(Box::new(self))
    }
}

impl Worker for Pose3d {
    fn wants(&self) -> Wants {
        let (points, depth, info) = (self.points.clone(), self.depth.clone(), self.camera_info());
        Wants::Only(Box::new(move |stream| {
            is_of(stream, &depth, IMAGE)
                || is_of(stream, &info, CAMERA_INFO)
                || is_among(stream, &points)
        }))
    }

    fn keeps(&self) -> Wants {
        let (points, depth) = (self.points.clone(), self.depth.clone());
        Wants::Only(Box::new(move |stream| {
            is_of(stream, &depth, IMAGE) || is_among(stream, &points)
        }))
    }

    fn run(&mut self, feed: &Feed, outlet: &Outlet) -> Result<(), WorkerError> {
        let mut camera = Camera::new(self);
        loop {
            match feed.next(LOOK) {
                Fed::Records(records) => {
                    for record in &records {
                        camera.take(record, outlet);
                    }
                }
                Fed::Silence | Fed::Command(_) => {}
                Fed::Closed => {
                    camera.settle(Time::from_nanos(i64::MAX), outlet);
                    return Ok(());
                }
            }
            camera.settle(outlet.clock().now(), outlet);
        }
    }
}

impl Pose3d {
    /// The stream with the calibration.
    fn camera_info(&self) -> String {
        let beside = || {
            let above = self.depth.rsplit_once('/').map_or("", |(above, _)| above);
            format!("{above}/camera_info")
        };
        self.camera_info.clone().unwrap_or_else(beside)
    }

    /// The stream of the same points in space.
    fn stream(&self, points: &Stream, layout: &Layout) -> Stream {
        let Pose3d { patch_px, most_spread_m, within_secs, .. } = self;
        Stream {
            inputs: vec![points.name.clone(), self.depth.clone(), self.camera_info()],
            channels: layout.channels(),
            method: format!(
                "the median distance of {patch_px} × {patch_px} px, spread over at most {most_spread_m} m, in a depth \
                 picture at most {within_secs} s apart"
            ),
            doc: "points in space, in the optical frame of the camera: x to the right, y down, z forward".to_owned(),
            ..Stream::raw(format!("{}{ENDING}", points.name), points.subject(), Shape::Sample)
        }
    }
}

/// Whether a stream has this name and messages of this type.
fn is_of(stream: &Stream, name: &str, type_name: &str) -> bool {
    let Shape::Message(schema) = &stream.shape else { return false };
    stream.name == name && schema.name == type_name
}

/// Whether a stream has points in pixels, and one of the patterns matches its name.
fn is_among(stream: &Stream, patterns: &[Pattern]) -> bool {
    stream.shape == Shape::Sample
        && patterns.iter().any(|pattern| pattern.matches(&stream.name))
        && Layout::of(stream).is_some()
}

/// A camera that records colour and depth.
struct Camera<'a> {
    settings: &'a Pose3d,
    patch: Patch,
    pairs: Pairs,
    /// The newest calibration, or why it can't be used.
    intrinsics: Option<Result<Intrinsics, IntrinsicsError>>,
    /// The streams of points.
    points: BTreeMap<StreamId, Points>,
    /// Why the last frame of each output stream was skipped; reported once, until a frame is not skipped.
    failing: BTreeMap<StreamId, Discriminant<Skipped>>,
}

/// The points of a stream.
struct Points {
    name: String,
    layout: Layout,
    /// The stream of the same points in space.
    stream: StreamId,
}

/// Why a frame is skipped. The message fits after "failed to".
#[derive(Clone, Debug, Error)]
enum Skipped {
    /// No calibration has arrived.
    #[error(
        "place points in space: nothing has arrived on {0}; publish the {CAMERA_INFO} of the depth pictures there, and have \
         a source read it (`topics`)"
    )]
    NoCalibration(String),
    /// The calibration can't be used.
    #[error("{error} ({topic})")]
    Calibration { error: IntrinsicsError, topic: String },
    /// There is no depth picture from the frame's time.
    #[error(
        "place points in space: {topic} has no picture within {within_secs} s of the frame (`within_secs`)"
    )]
    NoDepth { topic: String, within_secs: f64 },
    /// The depth picture can't be read.
    #[error("{error} ({topic})")]
    Depth { error: DepthError, topic: String },
    /// The depth picture shows another view.
    #[error(
        "place points in space: the depth pictures have {} × {} px and {what} {} × {} px: they don't show the same view; \
         use depth pictures that are aligned to the colour pictures",
        depth[0], depth[1], size[0], size[1]
    )]
    Unlike { depth: [f64; 2], what: &'static str, size: [f64; 2] },
}

impl Camera<'_> {
    fn new(settings: &Pose3d) -> Camera<'_> {
        let patch = Patch { side: settings.patch_px, most_spread_m: settings.most_spread_m };
        let pairs = Pairs::new(settings.within_secs);
        let (points, failing) = (BTreeMap::new(), BTreeMap::new());
        Camera { settings, patch, pairs, intrinsics: None, points, failing }
    }

    /// Takes in a record.
    fn take(&mut self, record: &Record, outlet: &Outlet) {
        let (id, taken) = (record.sample.stream, record.sample.measured);
        match &record.sample.data {
            Data::Message(message) if record.stream.name == self.settings.depth => {
                self.pairs.push_depth(taken, message.clone());
            }
            Data::Message(message) => self.intrinsics = Some(Intrinsics::read(message)),
            Data::Sample(values) => {
                if !self.points.contains_key(&id) {
                    let Some(layout) = Layout::of(&record.stream) else { return };
                    let stream = outlet.declare(self.settings.stream(&record.stream, &layout));
                    let name = record.stream.name.clone();
                    self.points.insert(id, Points { name, layout, stream });
                }
                let pushed_out =
                    self.pairs.push_frame(Frame { stream: id, taken, values: Arc::clone(values) });
                if let Some(points) = pushed_out.and_then(|frame| self.points.get(&frame.stream)) {
                    outlet.lost(points.stream, 1);
                }
            }
            _ => {}
        }
    }

    /// Places the points of each frame whose depth picture has arrived, and skips frames that have waited too long at
    /// `now`.
    fn settle(&mut self, now: Time, outlet: &Outlet) {
        for frame in self.pairs.settled(now, self.intrinsics.is_some()) {
            let Some(Points { name, layout, stream }) = self.points.get(&frame.stream) else {
                continue;
            };
            match self.placed(&frame, layout) {
                Ok(numbers) => {
                    self.failing.remove(stream);
                    outlet.offer(Reading {
                        stream: *stream,
                        index: None,
                        device_time: None,
                        source_time: Some(frame.taken),
                        data: Data::Sample(numbers),
                    });
                }
                Err(why) => {
                    outlet.lost(*stream, 1);
                    let kind = discriminant(&why);
                    if self.failing.insert(*stream, kind) != Some(kind) {
                        outlet.happen(passing(format!("{name}: failed to {why}")));
                    }
                }
            }
        }
    }

    /// Places the points of a frame in space.
    fn placed(&self, frame: &Frame, layout: &Layout) -> Result<Arc<[f64]>, Skipped> {
        let Pose3d { depth: topic, within_secs, .. } = self.settings;
        let info = || self.settings.camera_info();
        let intrinsics = self.intrinsics.as_ref().ok_or_else(|| Skipped::NoCalibration(info()))?;
        let unusable =
            |error: &IntrinsicsError| Skipped::Calibration { error: error.clone(), topic: info() };
        let intrinsics = intrinsics.as_ref().map_err(unusable)?;
        let late = || Skipped::NoDepth { topic: topic.clone(), within_secs: *within_secs };
        let message = self.pairs.nearest(frame.taken).ok_or_else(late)?;
        let unread = |error| Skipped::Depth { error, topic: topic.clone() };
        let depth = Depth::read(message).map_err(unread)?;
        let unlike = |what, size| Skipped::Unlike { depth: depth.size(), what, size };
        let scaled = intrinsics.of_pictures(depth.size());
        let scaled = scaled.ok_or_else(|| unlike("their calibration", intrinsics.size()))?;
        let numbers = layout.in_space(&frame.values, &depth, &scaled, &self.patch);
        numbers.map(Arc::from).map_err(|size| unlike("the frames", size))
    }
}

#[cfg(test)]
mod tests;
