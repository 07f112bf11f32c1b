//! Models of the user's own, as ONNX files: what they find in pictures of cameras.

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

/// How often the end of the session, and that of the process, are checked for while no frame comes.
const LOOK: Duration = Duration::from_millis(500);
/// How much earlier than due a frame may be looked at, as a part of the period: cameras are not that regular.
const EARLY: f64 = 0.1;

/// Models of your own, as ONNX files, that look at cameras: points of bodies, faces, expressions, gaze, or any numbers. A
/// descriptor beside each file says what goes in and what comes out; `teampulse models` lists those that are ready,
/// writes and verifies them.
///
/// They run in a process of their own, on one thread, with bounded memory: one that crashes, hangs or asks for too much is
/// a fault and started again, and the session goes on. Where they can't keep up, they take the newest frame next; the
/// skipped ones are counted.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// The cameras, by the name of their stream; `*` matches a part of a token: `"/robot1/front/compressed"`.
    pub streams: Vec<Pattern>,
    /// The descriptors, in the order in which the models look at a frame: one that finds faces comes before those that
    /// look at a face.
    pub descriptors: Vec<PathBuf>,
    /// The person that these cameras look at. Without it the numbers are about whom the pictures are about: the robot
    /// that carries the camera.
    #[serde(default)]
    pub person: Option<String>,
    /// The most frames of a camera that are looked at [Hz]. Without it, the least of the descriptors, or as many as can be.
    #[serde(default)]
    pub max_hz: Option<f64>,
    /// The library of an ONNX Runtime (1.22 or newer), which is several times faster. Without it the one in
    /// `ORT_DYLIB_PATH`, or else the engine in pure Rust.
    #[serde(default)]
    pub onnx_runtime: Option<PathBuf>,
    /// How long a model may take to load, and to look at a frame [s].
    #[serde(default = "patience_secs")]
    pub patience_secs: f64,
    /// The most memory that the process of these models may have [MiB].
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
            return wrong("it looks at no camera", "streams").map_err(|error| {
                error.with_hint("name its stream, such as \"/robot1/front/compressed\"")
            });
        }
        if self.max_hz.is_some_and(|rate| !rate.is_finite() || rate <= 0.0) {
            return wrong("it has to be above 0", "max_hz");
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
            let records = match feed.next(LOOK) {
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

/// Descriptors of models that look at pictures in this order. They are read again at each start, so that a file can be
/// mended while the session runs.
pub(crate) fn read(descriptors: &[PathBuf]) -> Result<Vec<Descriptor>, WorkerError> {
    let failed = |message: String| WorkerError {
        message,
        hint: "`teampulse models verify` says more".to_owned(),
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

    /// Declares the streams of a camera: one a model, and two of a model of hands.
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
            // Who publishes places needs the size of the frame that they are in.
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

/// What a model is, with its licence and its file.
fn about(descriptor: &Descriptor) -> String {
    let hash = descriptor.sha256.get(..12).unwrap_or_default();
    let Descriptor { doc, licence, .. } = descriptor;
    let file = descriptor.file.display();
    format!("{doc} (model {file}, SHA-256 {hash}…, licence {licence})")
}

/// A camera that is looked at.
struct Camera {
    /// The streams of the models, in their order.
    streams: Vec<StreamId>,
    /// The least time between two frames that are looked at [s].
    period_secs: f64,
    last: Option<Time>,
    /// Why its last frame could not be decoded: said once, until one can.
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
                self.streams.iter().for_each(|stream| outlet.lost(*stream, 1.0));
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

    /// Offers the numbers of a frame, with its time.
    fn offer(
        &self,
        numbers: Vec<Vec<f64>>,
        taken: Time,
        outlet: &Outlet,
    ) -> Result<(), WorkerError> {
        if numbers.len() != self.streams.len() {
            let message = "read the numbers of the models: a descriptor has changed".to_owned();
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
