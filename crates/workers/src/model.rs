//! User-supplied ONNX models that process camera pictures.

pub(crate) mod process;
pub mod serve;
mod signal;
mod wire;

use std::collections::BTreeMap;
use std::path::PathBuf;
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
use teampulse_core::stream::{Channel, Shape, Stream, StreamId, Subject};
use teampulse_core::time::Time;
use teampulse_core::worker::{Fed, Feed, Worker, WorkerError};
use teampulse_messages::hri::FRAME_CHANNELS;
use teampulse_vision::model::chain::missing;
use teampulse_vision::model::descriptor::Descriptor;

use crate::WorkerContext;
use crate::frames::{named, type_of};
use process::{Models, Process, Seen, memory_mib, patience_secs};
use signal::signal_of;

/// The interval at which the end of the session and the exit of the process are checked for while no frame arrives.
const LOOK: Duration = Duration::from_millis(500);
/// How early a frame may be processed, as a share of the period, as cameras are not perfectly regular.
const EARLY: f64 = 0.1;

/// Runs your own ONNX models on camera pictures: keypoints of bodies, faces, expressions, gaze, or any other numbers. A
/// descriptor next to each model file describes the model's input and output; `teampulse models` lists, writes and
/// verifies descriptors of published models.
///
/// Models run in a separate process, on one thread, with bounded memory: a crash, a time-out or excessive memory use is
/// a fault after which the process is restarted, and the session continues. Under overload, the newest frame is
/// processed next; skipped frames are counted.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// The cameras, by the names of their streams; `*` matches a part of a token: `"/robot1/front/compressed"`.
    pub streams: Vec<Pattern>,
    /// The descriptors, in the order in which the models process a frame: put a face detector before the models that
    /// process a face.
    pub descriptors: Vec<PathBuf>,
    /// The person in view of these cameras. By default the values are about the subject of the pictures: the robot
    /// that carries the camera.
    #[serde(default)]
    pub person: Option<String>,
    /// The highest rate at which the frames of a camera are processed [Hz]. By default the lowest limit in the
    /// descriptors; if there is none, as high as possible.
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

impl Component<dyn Worker, WorkerContext> for Model {
    const EXAMPLE: &'static str = r#"
streams     = ["/robot1/front/compressed"]
descriptors = ["models/yunet.toml", "models/fer.toml"]
person      = "p001"
max_hz      = 10
"#;

    fn build(self, _: &WorkerContext) -> Result<Box<dyn Worker>, SettingsError> {
        let wrong = |message: &str, at: &str| Err(SettingsError::new(message).at(at));
        if self.streams.is_empty() {
            return wrong("no camera is selected", "streams").map_err(|error| {
                error.with_hint("name its stream, such as \"/robot1/front/compressed\"")
            });
        }
        if self.max_hz.is_some_and(|rate| !rate.is_finite() || rate <= 0.0) {
            return wrong("the rate must be above 0 Hz", "max_hz");
        }
        self.models().check()?;
        Ok(Box::new(self))
    }
}

impl Worker for Model {
    fn wants(&self) -> Wants {
        let patterns = self.streams.clone();
        Wants::Only(Box::new(move |stream| {
            type_of(stream).is_some() && patterns.iter().any(|it| it.matches(&stream.name))
        }))
    }

    fn run(&mut self, feed: &Feed, outlet: &Outlet) -> Result<(), WorkerError> {
        let descriptors = read(&self.descriptors)?;
        let Some(mut process) = Process::start(&self.models(), feed)? else { return Ok(()) };
        let mut cameras = BTreeMap::<StreamId, Camera>::new();
        loop {
            let records = match feed.next_one(LOOK) {
                Fed::Records(records) => records,
                Fed::Silence | Fed::Command(_) => {
                    process.check()?;
                    continue;
                }
                Fed::Closed => {
                    process.end();
                    return Ok(());
                }
            };
            for record in records {
                let declare = || self.camera(&record.stream, &descriptors, &process, outlet);
                let camera = cameras.entry(record.sample.stream).or_insert_with(declare);
                camera.look(&record, &mut process, outlet)?;
            }
        }
    }
}

/// Reads the descriptors of models, in the order in which the models process pictures. They are read again at each
/// start, so that a file can be corrected during a session.
pub(crate) fn read(descriptors: &[PathBuf]) -> Result<Vec<Descriptor>, WorkerError> {
    let failed = |message: String| WorkerError {
        message,
        hint: "run `teampulse models verify` for details".to_owned(),
    };
    let read: Result<Vec<_>, _> = descriptors
        .iter()
        .map(|path| {
            let named = |error| failed(format!("{error} ({})", path.display()));
            Descriptor::read(path).map_err(named)
        })
        .collect();
    let read = read?;
    match missing(&read) {
        Some(missing) => Err(failed(format!("use these models: {missing}"))),
        None => Ok(read),
    }
}

impl Model {
    fn models(&self) -> Models<'_> {
        Models {
            descriptors: &self.descriptors,
            onnx_runtime: self.onnx_runtime.as_deref(),
            patience_secs: self.patience_secs,
            memory_mib: self.memory_mib,
        }
    }

    /// Declares the streams of a camera: one per model, two for a model of hands.
    fn camera(
        &self,
        pictures: &Stream,
        descriptors: &[Descriptor],
        process: &Process<'_>,
        outlet: &Outlet,
    ) -> Camera {
        let declare = |(descriptor, token): (&Descriptor, String)| {
            let (name, subject) = match &self.person {
                Some(person) => {
                    let camera = named(&pictures.name);
                    let name = format!("/humans/persons/{person}/{camera}/{token}");
                    (name, Subject::person(person.clone()))
                }
                None => (format!("{}/{token}", pictures.name), pictures.subject()),
            };
            // Positions are published together with the size of their frame.
            let size = FRAME_CHANNELS.map(|name| Channel::new(name, "px"));
            let size = size.into_iter().filter(|_| descriptor.output.has_places());
            let channels = descriptor.output.channels();
            let channels =
                channels.iter().map(|(name, unit)| Channel::new(name, *unit)).chain(size);
            outlet.declare(Stream {
                signal: signal_of(&descriptor.output),
                inputs: vec![pictures.name.clone()],
                channels: channels.collect(),
                method: process.engine().to_owned(),
                doc: about(descriptor),
                ..Stream::raw(name, subject, Shape::Sample)
            })
        };
        let least = descriptors.iter().filter_map(|descriptor| descriptor.max_hz).reduce(f64::min);
        let period_secs = self.max_hz.or(least).map_or(0.0, |rate_hz| (1.0 - EARLY) / rate_hz);
        let streams = descriptors
            .iter()
            .flat_map(|descriptor| descriptor.streams().map(move |token| (descriptor, token)))
            .map(declare)
            .collect();
        Camera { streams, period_secs, last: None, failing: None }
    }
}

/// A description of a model, with its file, hash and licence.
fn about(descriptor: &Descriptor) -> String {
    let hash = descriptor.sha256.get(..12).unwrap_or_default();
    let Descriptor { doc, licence, .. } = descriptor;
    let file = descriptor.file.display();
    format!("{doc} (model {file}, SHA-256 {hash}…, licence {licence})")
}

/// A camera that is being processed.
struct Camera {
    /// The streams of the models, in order.
    streams: Vec<StreamId>,
    /// The minimum time between two processed frames [s].
    period_secs: f64,
    last: Option<Time>,
    /// Why the camera's last frame could not be decoded; reported once, until a frame can be decoded.
    failing: Option<String>,
}

impl Camera {
    fn look(
        &mut self,
        record: &Record,
        process: &mut Process<'_>,
        outlet: &Outlet,
    ) -> Result<(), WorkerError> {
        let (Data::Message(message), Some(type_name)) =
            (&record.sample.data, type_of(&record.stream))
        else {
            return Ok(());
        };
        let taken = record.sample.measured;
        let since = self.last.map(|last| taken.secs_since(last));
        if since.is_some_and(|since| (0.0..self.period_secs).contains(&since)) {
            return Ok(());
        }
        self.last = Some(taken);
        match process.look(type_name, message)? {
            Some(Seen::Found { numbers, .. }) => {
                self.failing = None;
                self.offer(numbers, taken, outlet)
            }
            Some(Seen::Unreadable(why)) => {
                self.streams.iter().for_each(|stream| outlet.lost(*stream, 1));
                if self.failing.as_ref() != Some(&why) {
                    let name = &record.stream.name;
                    outlet.happen(passing(format!("{name}: failed to {why}")));
                }
                self.failing = Some(why);
                Ok(())
            }
            None => Ok(()),
        }
    }

    /// Offers the values of a frame, with the frame's time.
    fn offer(
        &self,
        numbers: Vec<Vec<f64>>,
        taken: Time,
        outlet: &Outlet,
    ) -> Result<(), WorkerError> {
        if numbers.len() != self.streams.len() {
            let message = "read the outputs of the models: a descriptor has changed".to_owned();
            return Err(WorkerError { message, hint: String::new() });
        }
        for (stream, numbers) in self.streams.iter().zip(numbers) {
            outlet.offer(Reading {
                stream: *stream,
                index: None,
                device_time: None,
                source_time: Some(taken),
                data: Data::Sample(Arc::from(numbers)),
            });
        }
        Ok(())
    }
}
