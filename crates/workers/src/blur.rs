//! Hides faces in pictures.

mod held;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::Data;
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Record;
use teampulse_core::sink::Wants;
use teampulse_core::source::Reading;
use teampulse_core::stream::{Audience, Shape, Signal, Stream, StreamId};
use teampulse_core::time::Time;
use teampulse_core::worker::{Fed, Feed, Worker, WorkerError};
use teampulse_messages::catalogue::shipped_or_bare;
use teampulse_messages::pictures::COMPRESSED_IMAGE;
use teampulse_vision::model::descriptor::{Descriptor, Resize, Source, Subject};

use crate::WorkerContext;
use crate::frames::{OF_TRANSPORTS, type_of};
use crate::model::process::{Models, Process, Seen, memory_mib, patience_secs};
use crate::model::read;
use held::{Held, Picked};

/// The interval at which the end of the session and the exit of the process are checked for while no frame arrives.
const LOOK: Duration = Duration::from_millis(500);
/// How early a frame may be processed, as a share of the period, as cameras are not perfectly regular.
const EARLY: f64 = 0.1;
/// The longest time for which frames can be held [s].
const MOST_HOLD_SECS: f64 = 10.0;

/// Hides faces in pictures from the cameras, robots and topics for which the study sets `faces = "blur"`. The original
/// pictures are visible only to workers; the blurred ones are recorded and shown.
///
/// Faces are detected by one or more models, each of which processes the whole picture. Frames that were not processed
/// are not recorded: frames that cannot be decoded, or are skipped because the models are too slow, are counted as
/// lost. A face is also hidden at the same place for a moment before and after it was found. A face that the models
/// miss for longer is visible, so test them on your own pictures.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Blur {
    /// The descriptors of the face detection models, such as `YuNet`'s; a lower `least_score` there hides more.
    pub descriptors: Vec<PathBuf>,
    /// How far the hidden part extends beyond each side of a face, as a share of the face's width and height.
    #[serde(default = "margin")]
    pub margin: f64,
    /// How long before and after its detection a face is hidden at the same place [s]. Pictures are delayed by this
    /// time.
    #[serde(default = "hold_secs")]
    pub hold_secs: f64,
    /// The highest rate at which the frames of a camera are processed and recorded [Hz]. By default all frames.
    #[serde(default)]
    pub max_hz: Option<f64>,
    /// The library of an ONNX Runtime (1.22 or newer), which is several times faster. By default the library in
    /// `ORT_DYLIB_PATH`, or else the engine in pure Rust.
    #[serde(default)]
    pub onnx_runtime: Option<PathBuf>,
    /// How long a model may take to load, and to process a frame [s].
    #[serde(default = "patience_secs")]
    pub patience_secs: f64,
    /// The memory limit of the process that runs these models [MiB].
    #[serde(default = "memory_mib")]
    pub memory_mib: u64,
}

fn margin() -> f64 {
    0.3
}

fn hold_secs() -> f64 {
    0.5
}

impl Component<dyn Worker, WorkerContext> for Blur {
    const EXAMPLE: &'static str = r#"descriptors = ["models/yunet.toml"]"#;

    fn build(self, _: &WorkerContext) -> Result<Box<dyn Worker>, SettingsError> {
        self.models().check()?;
        if !(0.0..=10.0).contains(&self.margin) {
            return Err(SettingsError::new("the margin must be from 0 to 10").at("margin"));
        }
        if !(0.0..=MOST_HOLD_SECS).contains(&self.hold_secs) {
            let message = format!("the hold time must be from 0 to {MOST_HOLD_SECS} s");
            return Err(SettingsError::new(message).at("hold_secs"));
        }
        if self.max_hz.is_some_and(|rate| !rate.is_finite() || rate <= 0.0) {
            return Err(SettingsError::new("the rate must be above 0 Hz").at("max_hz"));
        }
        Ok(Box::new(self))
    }
}

impl Worker for Blur {
    fn wants(&self) -> Wants {
        Wants::Only(Box::new(is_to_hide))
    }

    fn keeps(&self) -> Wants {
        Wants::Only(Box::new(is_to_hide))
    }

    fn run(&mut self, feed: &Feed, outlet: &Outlet) -> Result<(), WorkerError> {
        for descriptor in read(&self.descriptors)? {
            refuse_blind(&descriptor)?;
        }
        let Some(mut process) = Process::start(&self.models(), feed)? else { return Ok(()) };
        let mut cameras = BTreeMap::<StreamId, Camera>::new();
        let looked = self.look(feed, outlet, &mut process, &mut cameras);
        for camera in cameras.values_mut() {
            match &looked {
                Ok(()) => camera.let_go(Time::from_nanos(i64::MAX), outlet),
                // The held frames were processed, but a face may appear in the frames after them.
                Err(_) => outlet.lost(camera.stream, camera.held.len() as u64),
            }
        }
        looked
    }
}

/// Whether faces must be hidden in the pictures of a stream.
fn is_to_hide(stream: &Stream) -> bool {
    stream.audience == Audience::Workers && stream.signal == Signal::Image
}

/// Fails if a model does not find faces, or does not process the whole picture.
fn refuse_blind(descriptor: &Descriptor) -> Result<(), WorkerError> {
    let name = &descriptor.name;
    let refuse = |why: &str, hint: &str| {
        let message = format!("hide faces: the model `{name}` {why}");
        Err(WorkerError { message, hint: hint.to_owned() })
    };
    if descriptor.output.finds() != Some(Subject::Face) {
        return refuse(
            "does not find faces",
            "use a face detector such as YuNet: see `teampulse models list`",
        );
    }
    if descriptor.input.source != Source::Frame || descriptor.input.resize == Resize::Crop {
        return refuse(
            "processes only a part of the picture",
            "use `source = \"frame\"` and no `crop`",
        );
    }
    Ok(())
}

impl Blur {
    fn models(&self) -> Models<'_> {
        Models {
            descriptors: &self.descriptors,
            onnx_runtime: self.onnx_runtime.as_deref(),
            patience_secs: self.patience_secs,
            memory_mib: self.memory_mib,
        }
    }

    /// Processes frames until there are no more.
    fn look(
        &self,
        feed: &Feed,
        outlet: &Outlet,
        process: &mut Process<'_>,
        cameras: &mut BTreeMap<StreamId, Camera>,
    ) -> Result<(), WorkerError> {
        loop {
            let records = match feed.next_one(LOOK) {
                Fed::Records(records) => records,
                Fed::Silence => {
                    let now = outlet.clock().now();
                    for camera in cameras.values_mut() {
                        camera.let_go(now, outlet);
                    }
                    process.check()?;
                    continue;
                }
                Fed::Command(_) => continue,
                Fed::Closed => {
                    process.end();
                    return Ok(());
                }
            };
            for record in records {
                let declare = || self.camera(&record.stream, process, outlet);
                let camera = cameras.entry(record.sample.stream).or_insert_with(declare);
                if !camera.look(&record, process, outlet)? {
                    return Ok(());
                }
            }
        }
    }

    /// Declares the stream of a camera with hidden faces.
    fn camera(&self, pictures: &Stream, process: &Process<'_>, outlet: &Outlet) -> Camera {
        let stream = Stream {
            signal: Signal::Image,
            inputs: vec![pictures.name.clone()],
            method: process.engine().to_owned(),
            doc: "pictures with hidden faces, as JPEG; unchanged if no face was found".to_owned(),
            ..Stream::raw(
                blurred(&pictures.name),
                pictures.subject(),
                Shape::Message(shipped_or_bare(COMPRESSED_IMAGE)),
            )
        };
        let period_secs = self.max_hz.map_or(0.0, |rate_hz| (1.0 - EARLY) / rate_hz);
        let held = Held::new(self.hold_secs, self.margin);
        Camera { stream: outlet.declare(stream), held, period_secs, last: None, failing: None }
    }
}

/// The stream of a camera with hidden faces: `/robot1/front/blurred/compressed` for `/robot1/front/compressed`.
fn blurred(name: &str) -> String {
    let plain = match name.rsplit_once('/') {
        Some((above, last)) if !above.is_empty() && OF_TRANSPORTS.contains(&last) => above,
        _ => name,
    };
    format!("{plain}/blurred/compressed")
}

/// A camera in whose pictures faces are hidden.
struct Camera {
    /// The stream of the camera's pictures with hidden faces.
    stream: StreamId,
    held: Held,
    /// The minimum time between two processed frames [s].
    period_secs: f64,
    last: Option<Time>,
    /// Why the camera's last frame was left out; reported once, until a frame succeeds.
    failing: Option<String>,
}

impl Camera {
    /// Processes a frame. Returns whether the session continues.
    fn look(
        &mut self,
        record: &Record,
        process: &mut Process<'_>,
        outlet: &Outlet,
    ) -> Result<bool, WorkerError> {
        let Data::Message(message) = &record.sample.data else { return Ok(true) };
        let taken = record.sample.measured;
        let since = self.last.map(|last| taken.secs_since(last));
        if since.is_some_and(|since| (0.0..self.period_secs).contains(&since)) {
            return Ok(true);
        }
        self.last = Some(taken);
        let Some(type_name) = type_of(&record.stream) else {
            let Shape::Message(schema) = &record.stream.shape else { return Ok(true) };
            let why = format!("detect faces in a {}", schema.name);
            self.leave_out(&record.stream.name, why, outlet);
            return Ok(true);
        };
        match process.look(type_name, message) {
            Ok(Some(Seen::Found { faces, .. })) => {
                let frame = Picked { type_name, message: message.clone(), taken };
                let pushed_out = self.held.push(frame, &faces);
                outlet.lost(self.stream, pushed_out as u64);
                self.let_go(taken, outlet);
                Ok(true)
            }
            Ok(Some(Seen::Unreadable(why))) => {
                self.leave_out(&record.stream.name, why, outlet);
                Ok(true)
            }
            Ok(None) => Ok(false),
            Err(error) => {
                outlet.lost(self.stream, 1);
                Err(error)
            }
        }
    }

    /// Counts a frame that is not recorded, and reports the reason.
    fn leave_out(&mut self, name: &str, why: String, outlet: &Outlet) {
        outlet.lost(self.stream, 1);
        if self.failing.as_ref() != Some(&why) {
            let message = format!("{name}: failed to {why}; unprocessed frames are not recorded");
            outlet.happen(passing(message));
        }
        self.failing = Some(why);
    }

    /// Offers the frames whose holding time has ended by `now`.
    fn let_go(&mut self, now: Time, outlet: &Outlet) {
        while let Some((taken, hidden)) = self.held.next(now) {
            match hidden {
                Ok(message) => {
                    self.failing = None;
                    outlet.offer(Reading {
                        stream: self.stream,
                        index: None,
                        device_time: None,
                        source_time: Some(taken),
                        data: Data::Message(message),
                    });
                }
                Err(why) => self.leave_out("pictures with hidden faces", why, outlet),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_with_hidden_faces_are_below_those_of_their_camera() {
        for (pictures, expected) in [
            ("/robot1/front/compressed", "/robot1/front/blurred/compressed"),
            ("/robot1/image_raw", "/robot1/blurred/compressed"),
            ("/robot1/front/colour", "/robot1/front/colour/blurred/compressed"),
            ("/image", "/image/blurred/compressed"),
        ] {
            assert_eq!(blurred(pictures), expected);
        }
    }
}
