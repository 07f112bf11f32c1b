//! This computer's cameras (V4L2).

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

/// How often a disconnected camera is searched for.
const LOOK: Duration = Duration::from_millis(500);
/// The largest side of a picture [px].
const MOST_SIDE: u32 = 16_384;

/// A camera connected to this computer, such as `/dev/video0`: USB cameras, laptop cameras, and the colour and depth
/// cameras of an Intel `RealSense`.
///
/// JPEG frames of the camera are passed on byte for byte; raw pixels are compressed to JPEG, and distances stay
/// unchanged. Frames are shown on the dashboard and available to workers; they are **not recorded and not published**
/// unless `record` is set. Each frame has the time at which the driver took it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// The person in view, by pseudonym: `p001`.
    #[serde(default)]
    pub person: Option<String>,
    /// The robot in view, or the robot that carries the camera. Without `person` and `robot`, the camera belongs to
    /// the team.
    #[serde(default)]
    pub robot: Option<String>,
    /// The camera's name among the cameras of that person, robot or team.
    #[serde(default = "camera")]
    pub name: String,
    /// Which camera to use if there are several: a part of its name or path, such as
    /// `/dev/v4l/by-id/usb-046d_HD_Pro_Webcam_C920_0123ABCD-video-index0`. `teampulse scan` lists them.
    #[serde(default)]
    pub device: String,
    /// The picture width [px]; set it together with `height`. By default about 640 × 480.
    #[serde(default)]
    pub width: Option<u32>,
    /// The picture height [px].
    #[serde(default)]
    pub height: Option<u32>,
    /// The frame rate [Hz].
    #[serde(default = "rate")]
    pub rate_hz: f64,
    /// The frame format. By default JPEG if available, or else raw pixels.
    #[serde(default)]
    pub format: Wish,
    /// Whether pictures are recorded in the bag, and published if the study publishes the stream.
    #[serde(default)]
    pub record: bool,
    /// `"blur"`: pictures are recorded only with hidden faces, by the worker of type `blur`.
    #[serde(default)]
    pub faces: Faces,
}

/// The requested format of a camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Wish {
    /// JPEG, or else raw colour pixels, or else grey ones.
    #[default]
    Auto,
    /// JPEG, as compressed by the camera.
    Mjpeg,
    /// Raw colour pixels, which are compressed here.
    Yuyv,
    /// Grey pixels, which are compressed here.
    Grey,
    /// 16-bit distances, as `sensor_msgs/Image`.
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
                let error =
                    SettingsError::new("the camera has both a person and a robot").at("robot");
                return Err(error.with_hint("remove one of them; two sources can't share a camera"));
            }
        }
        let names = [("name", Some(&self.name)), ("robot", self.robot.as_ref())];
        for (at, name) in names.into_iter().filter_map(|(at, name)| Some((at, name?))) {
            let is_token = name.starts_with(|first: char| first.is_ascii_alphabetic())
                && name.chars().all(|each| each.is_ascii_alphanumeric() || each == '_');
            if !is_token {
                let error = SettingsError::new(format!("`{name}` is not a ROS name")).at(at);
                return Err(error.with_hint("use a-z, A-Z, 0-9 and _, beginning with a letter"));
            }
        }
        if self.width.is_some() != self.height.is_some() {
            let error = SettingsError::new("only one of `width` and `height` is set").at("width");
            return Err(error.with_hint("set both or neither"));
        }
        let sides = [self.width, self.height];
        if sides.iter().flatten().any(|side| !(1..=MOST_SIDE).contains(side)) {
            let error = SettingsError::new("the picture size is out of range").at("width");
            return Err(error.with_hint(format!("use sides of 1 to {MOST_SIDE} pixels")));
        }
        if !(self.rate_hz > 0.0 && self.rate_hz <= 1000.0) {
            let error =
                SettingsError::new(format!("a frame rate of {} Hz is out of range", self.rate_hz));
            return Err(error.with_hint("use a rate above 0, up to 1000 Hz").at("rate_hz"));
        }
        Ok(())
    }

    fn wanted(&self) -> Wanted {
        let size = self.width.zip(self.height);
        Wanted { size, rate_hz: self.rate_hz, formats: Format::wished(self.format) }
    }

    /// Returns the stream of an opened camera.
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
    /// The identity of the camera that was read before, even if its node has changed.
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
    /// The camera and its owner, for messages.
    fn label(&self) -> String {
        let of = self.person.as_ref().or(self.robot.as_ref());
        of.map_or_else(|| self.name.clone(), |of| format!("{} of {of}", self.name))
    }
}

impl CameraReader {
    /// Finds the camera; waits for the one that was read before. `None` if the session has ended.
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
                    "read {}: unexpected answer from its driver: {panic}",
                    settings.label()
                );
                let hint = format!("a bug in teampulse{}; please report it", at(&panic));
                Err(SourceError::Gone { message, hint })
            });
            // No receiver is left if the session has ended.
            drop(send_end.send(ended));
        };
        let thread = std::thread::Builder::new().name("camera".into()).spawn(work);
        if let Err(error) = thread {
            let message = format!("start a thread for {}: {error}", self.settings.label());
            return Err(SourceError::Gone { message, hint: "close other programs".into() });
        }
        let _stops = Stops(is_over);
        tokio::select! {
            () = outlet.closed() => Ok(Ended::Closed),
            ended = ended => match ended {
                // A camera that worked before does not end the session.
                Ok(Err(SourceError::Fatal { message, hint })) if self.read_before.is_some() => {
                    Err(SourceError::Gone { message, hint })
                }
                Ok(ended) => ended,
                Err(_) => Ok(Ended::Closed),
            },
        }
    }
}

/// Stops the thread of a camera together with its reader.
struct Stops(Arc<AtomicBool>);

impl Drop for Stops {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

#[cfg(test)]
mod tests;
