//! Cameras of this computer (V4L2).

mod capture;
mod encode;
mod format;
mod found;
mod opened;
mod picture;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::panics::{at, watched};
use teampulse_core::qos::Qos;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::{Source, SourceError};
use teampulse_core::stream::{Audience, Shape, Signal, Stream, Subject};
use teampulse_messages::catalogue::shipped_or_bare;
use tokio::sync::oneshot;
use tokio::time::sleep;

use crate::SourceContext;
use crate::core_files::leave_no_core_file;
use crate::faces::Faces;
use crate::wearables::check_person;

use capture::{Ended, capture};
use format::Format;
pub use found::FoundCamera;
use opened::{Opened, Wanted};

/// How often a camera that was unplugged is looked for.
const LOOK: Duration = Duration::from_millis(500);
/// The largest side of a picture [px].
const MOST_SIDE: u32 = 16_384;

/// A camera of this computer, as `/dev/video0`: USB cameras, those of laptops, those for colour and depth of an Intel
/// `RealSense`.
///
/// The files of a camera that gives JPEG are passed on byte for byte; pixels become JPEG, and distances stay as they are.
/// Frames are shown on the dashboard and seen by workers; they are **not recorded and not published** unless `record` is
/// set. Each has the time at which the driver took it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// The person at whom it looks, by pseudonym: `p001`.
    #[serde(default)]
    pub person: Option<String>,
    /// The robot at which it looks, or which carries it. Without `person` and `robot` it looks at the team.
    #[serde(default)]
    pub robot: Option<String>,
    /// Its name among the cameras of that person, robot or team.
    #[serde(default = "camera")]
    pub name: String,
    /// Which camera, where there are several: a part of its name or of a path of it, such as
    /// `/dev/v4l/by-id/usb-046d_HD_Pro_Webcam_C920_0123ABCD-video-index0`. `teampulse scan` lists them.
    #[serde(default)]
    pub device: String,
    /// The width of its pictures [px]; with `height`. Without both about 640 × 480.
    #[serde(default)]
    pub width: Option<u32>,
    /// Their height [px].
    #[serde(default)]
    pub height: Option<u32>,
    /// How many pictures it takes [Hz].
    #[serde(default = "rate")]
    pub rate_hz: f64,
    /// What it gives. By default JPEG where it can, else pixels.
    #[serde(default)]
    pub format: Wish,
    /// Whether its pictures are recorded in the bag, and published where the study publishes its stream.
    #[serde(default)]
    pub record: bool,
    /// `"blur"`: its pictures are recorded with hidden faces only, by the worker of the type `blur`.
    #[serde(default)]
    pub faces: Faces,
}

/// What a camera is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Wish {
    /// JPEG, else pixels in colour, else grey ones.
    #[default]
    Auto,
    /// JPEG, as the camera compresses it.
    Mjpeg,
    /// Pixels of colour, which are compressed here.
    Yuyv,
    /// Grey pixels, which are compressed here.
    Grey,
    /// Distances of 16 bits, as `sensor_msgs/Image`.
    Depth,
}

fn camera() -> String {
    "camera".to_owned()
}

fn rate() -> f64 {
    30.0
}

impl Component<dyn Source, SourceContext> for Camera {
    const EXAMPLE: &'static str = r#"person = "p001""#;

    fn build(self, _: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        self.check()?;
        Ok(Box::new(CameraReader { settings: self, read_before: None }))
    }
}

impl Camera {
    fn check(&self) -> Result<(), SettingsError> {
        if let Some(person) = &self.person {
            check_person(person)?;
            if self.robot.is_some() {
                let error = SettingsError::new("it looks at a person and at a robot").at("robot");
                return Err(error.with_hint("name one; two sources can't share a camera"));
            }
        }
        let names = [("name", Some(&self.name)), ("robot", self.robot.as_ref())];
        for (at, name) in names.into_iter().filter_map(|(at, name)| Some((at, name?))) {
            let is_token = name.starts_with(|first: char| first.is_ascii_alphabetic())
                && name.chars().all(|each| each.is_ascii_alphanumeric() || each == '_');
            if !is_token {
                let error = SettingsError::new(format!("`{name}` is no ROS name")).at(at);
                return Err(error.with_hint("letters, digits and _, beginning with a letter"));
            }
        }
        if self.width.is_some() != self.height.is_some() {
            let error = SettingsError::new("it has one side of a picture").at("width");
            return Err(error.with_hint("give `width` and `height`, or neither"));
        }
        let sides = [self.width, self.height];
        if sides.iter().flatten().any(|side| !(1..=MOST_SIDE).contains(side)) {
            let error = SettingsError::new("its pictures have no such size").at("width");
            return Err(error.with_hint(format!("sides are from 1 to {MOST_SIDE} pixels")));
        }
        if !(self.rate_hz > 0.0 && self.rate_hz <= 1000.0) {
            let error = SettingsError::new(format!("{} Hz is no rate of pictures", self.rate_hz));
            return Err(error.with_hint("from above 0 to 1000 Hz").at("rate_hz"));
        }
        Ok(())
    }

    fn wanted(&self) -> Wanted {
        let size = self.width.zip(self.height);
        Wanted { size, rate_hz: self.rate_hz, formats: Format::wished(self.format) }
    }

    /// The stream of what was opened.
    fn stream(&self, opened: &Opened) -> Stream {
        let (subject, above) = match (&self.person, &self.robot) {
            (Some(person), _) => {
                (Subject::person(person.clone()), format!("/humans/persons/{person}"))
            }
            (None, Some(robot)) => (Subject::robot(robot.clone()), format!("/{robot}")),
            (None, None) => (Subject::team(), "/cameras".to_owned()),
        };
        let Opened { name, format, width, height, rate_hz, .. } = opened;
        let (audience, kept) = match (self.faces, self.record) {
            (Faces::Blur, _) => (Audience::Workers, "; recorded with hidden faces only"),
            (Faces::Keep, true) => (Audience::Everybody, ""),
            (Faces::Keep, false) => (Audience::Live, "; shown live, not recorded"),
        };
        let schema = shipped_or_bare(format.type_name());
        Stream {
            signal: Signal::Image,
            rate_hz: *rate_hz,
            doc: format!("{name}: {width} × {height}, {}{kept}", format.doc()),
            qos: vec![Qos::best_effort(5)],
            audience,
            ..Stream::raw(
                format!("{above}/{}/{}", self.name, format.leaf()),
                subject,
                Shape::Message(schema),
            )
        }
    }
}

/// Reads a camera.
struct CameraReader {
    settings: Camera,
    /// What the one that was read is known by, whatever its node is.
    read_before: Option<String>,
}

#[async_trait]
impl Source for CameraReader {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        if !self.settings.record || self.settings.faces == Faces::Blur {
            leave_no_core_file();
        }
        loop {
            let found = self.find(outlet).await?;
            let Some(found) = found else { return Ok(()) };
            let identity = found.identity();
            let ended = self.read(found, outlet).await?;
            self.read_before = Some(identity);
            match ended {
                Ended::Closed => return Ok(()),
                Ended::Gone(why) => {
                    outlet.happen(passing(format!("{} is gone: {why}", self.settings.label())));
                }
                Ended::Silent(message) => {
                    let hint = "unplug it and plug it in again, or choose a smaller picture: a USB port may carry too \
                                many cameras"
                        .to_owned();
                    return Err(SourceError::Gone { message, hint });
                }
            }
        }
    }
}

impl Camera {
    /// Whose camera it is, for people.
    fn label(&self) -> String {
        let of = self.person.as_ref().or(self.robot.as_ref());
        of.map_or_else(|| self.name.clone(), |of| format!("{} of {of}", self.name))
    }
}

impl CameraReader {
    /// The camera; the one that was read before is waited for. `None` where the session is over.
    async fn find(&self, outlet: &Outlet) -> Result<Option<FoundCamera>, SourceError> {
        loop {
            let Some(identity) = &self.read_before else {
                return FoundCamera::chosen(&self.settings.device).map(Some);
            };
            let is_it = |found: &FoundCamera| found.identity() == *identity;
            if let Some(found) = FoundCamera::all().into_iter().find(is_it) {
                return Ok(Some(found));
            }
            tokio::select! {
                () = outlet.closed() => return Ok(None),
                () = sleep(LOOK) => {}
            }
        }
    }

    async fn read(&self, found: FoundCamera, outlet: &Outlet) -> Result<Ended, SourceError> {
        let (settings, own) = (self.settings.clone(), outlet.clone());
        let (send_end, ended) = oneshot::channel();
        let is_over = Arc::new(AtomicBool::new(false));
        let stop = Arc::clone(&is_over);
        let work = move || {
            let read = || {
                let opened = Opened::open(&found, &settings.wanted())?;
                opened.warn(&settings, &own);
                let stream = own.declare(settings.stream(&opened));
                Ok(capture(&opened, stream, &own, &settings.label(), &stop))
            };
            let ended = watched(read).unwrap_or_else(|panic| {
                let message = format!(
                    "read {}: its driver answers in no known way: {panic}",
                    settings.label()
                );
                let hint = format!("a fault of teampulse{}; please report it", at(&panic));
                Err(SourceError::Gone { message, hint })
            });
            // Nobody waits for it where the session is over.
            drop(send_end.send(ended));
        };
        let thread = std::thread::Builder::new().name("camera".into()).spawn(work);
        if let Err(error) = thread {
            let message = format!("start a thread for {}: {error}", self.settings.label());
            return Err(SourceError::Gone { message, hint: "end other programs".into() });
        }
        let _stops = Stops(is_over);
        tokio::select! {
            () = outlet.closed() => Ok(Ended::Closed),
            ended = ended => match ended {
                // What was read once does not end the session.
                Ok(Err(SourceError::Fatal { message, hint })) if self.read_before.is_some() => {
                    Err(SourceError::Gone { message, hint })
                }
                Ok(ended) => ended,
                Err(_) => Ok(Ended::Closed),
            },
        }
    }
}

/// Ends the thread of a camera with its reader.
struct Stops(Arc<AtomicBool>);

impl Drop for Stops {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

#[cfg(test)]
mod tests;
