//! This computer's keyboards, mice and gamepads: how much they are used each second, but not which keys.

mod activity;
mod event_clock;
mod found;
mod nodes;
mod x11;

use std::time::Duration;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::clock::Clock;
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::{Source, SourceError};
use teampulse_devices::inputs::Kind;
use tokio::task::JoinSet;
use tokio::time::sleep;

use crate::SourceContext;
use crate::core_files::leave_no_core_file;
use crate::wearables::check_person;

use activity::Activity;
pub use found::FoundInput;
use nodes::Nodes;
use x11::Display;

/// How long after a second has ended its events may still be read \[ns\].
const SETTLED_NS: i64 = 100_000_000;
const SECOND_NS: i64 = 1_000_000_000;

/// The keyboards, mice and gamepads that a person uses: how much each second, but not which keys.
///
/// Each second has a summary: presses, their times and corrections of keyboards; path, clicks and wheel of mice;
/// buttons and deflection of gamepads. No key and no text leaves the reader, nor the time of a single press: means are
/// taken over at least five. The process leaves no core file behind. Devices are read from `/dev/input`, for which this
/// user must be in the group `input`; otherwise from an X11 display, if there is one.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Inputs {
    /// The pseudonym of the person who uses the devices: `p001`.
    pub person: String,
    /// Which devices to read, if several people use one computer: each text is part of a device's name or of one of its
    /// paths, such as `Logitech` or `by-path/pci-0000:00:14.0-usb-0:2`. By default all. On X11, only names are matched.
    #[serde(default)]
    pub devices: Vec<String>,
    /// Which kinds of devices to read.
    #[serde(default = "kinds")]
    pub kinds: Vec<InputKind>,
    /// How keyboards and mice are read.
    #[serde(default)]
    pub via: Via,
    /// The X11 display; by default that of `DISPLAY`.
    #[serde(default)]
    pub display: Option<String>,
}

/// A kind of input device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InputKind {
    /// Keyboards.
    Keyboard,
    /// Mice, touchpads and other pointers.
    Mouse,
    /// Gamepads and joysticks; only from `/dev/input`.
    Gamepad,
}

/// How keyboards and mice are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Via {
    /// From `/dev/input` if it has a permitted device, otherwise from X11.
    #[default]
    Auto,
    /// From `/dev/input`.
    Evdev,
    /// From an X11 display. On Wayland, the display sees only input to windows of X11 programs.
    X11,
}

fn kinds() -> Vec<InputKind> {
    vec![InputKind::Keyboard, InputKind::Mouse, InputKind::Gamepad]
}

impl InputKind {
    fn kind(self) -> Kind {
        match self {
            InputKind::Keyboard => Kind::Keyboard,
            InputKind::Mouse => Kind::Mouse,
            InputKind::Gamepad => Kind::Gamepad,
        }
    }
}

impl Component<dyn Source, SourceContext> for Inputs {
    const EXAMPLE: &'static str = r#"person = "p001""#;

    fn build(self, _: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        check_person(&self.person)?;
        if self.kinds.is_empty() {
            let error = SettingsError::new("no kinds are listed").at("kinds");
            return Err(error.with_hint("name some, such as [\"keyboard\", \"mouse\"]"));
        }
        Ok(Box::new(InputReader { settings: self }))
    }
}

/// Reads the input devices of a person.
struct InputReader {
    settings: Inputs,
}

/// How the reading of a device ended.
struct Ended {
    name: String,
    why: String,
}

#[async_trait]
impl Source for InputReader {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        leave_no_core_file();
        let mut readers: JoinSet<Ended> = JoinSet::new();
        let activity = Activity::new(&self.settings.person, outlet);
        let mut nodes = self.nodes();
        nodes.look(&activity, &mut readers);
        self.read_display(&mut nodes, &activity, &mut readers).await?;
        loop {
            tokio::select! {
                () = outlet.closed() => return Ok(()),
                () = sleep(to_next_second(outlet.clock())) => {
                    activity.hand_over();
                    nodes.look(&activity, &mut readers);
                }
                Some(ended) = readers.join_next() => {
                    // A task's panic is resumed here; it is caught further up.
                    let Ended { name, why } =
                        ended.unwrap_or_else(|error| std::panic::resume_unwind(error.into_panic()));
                    let message = format!("{name} of {} is gone: {why}", self.settings.person);
                    nodes.forget(&name);
                    if readers.is_empty() {
                        let hint = "plug it in again, or start the display again".into();
                        return Err(SourceError::Gone { message: format!("read inputs: {message}"), hint });
                    }
                    outlet.happen(passing(message));
                }
            }
        }
    }
}

impl InputReader {
    fn kinds(&self) -> Vec<Kind> {
        self.settings.kinds.iter().map(|kind| kind.kind()).collect()
    }

    fn nodes(&self) -> Nodes {
        let mut nodes = Nodes::new(self.kinds(), self.settings.devices.clone());
        if self.settings.via == Via::X11 {
            nodes.leave_to_display();
        }
        nodes
    }

    /// Reads keyboards and mice from the display if they are not read from `/dev/input`.
    async fn read_display(
        &self,
        nodes: &mut Nodes,
        activity: &Activity,
        readers: &mut JoinSet<Ended>,
    ) -> Result<(), SourceError> {
        let shown: Vec<Kind> =
            self.kinds().into_iter().filter(|kind| *kind != Kind::Gamepad).collect();
        let is_needed = match self.settings.via {
            Via::Auto => !shown.is_empty() && !shown.iter().any(|kind| activity.has(*kind)),
            Via::Evdev => false,
            Via::X11 => true,
        };
        if is_needed {
            match Display::open(self.settings.display.clone(), &self.settings.devices).await {
                Ok(display) => {
                    nodes.leave_to_display();
                    if display.is_of_wayland() {
                        activity.warn(
                            "this display runs under Wayland: only input to windows of X11 \
                             programs is seen; to see all of it, read /dev/input: `sudo usermod \
                             -aG input $USER`, then log out and in",
                        );
                    }
                    readers.spawn(display.read(shown, activity.clone()));
                }
                Err(why) if readers.is_empty() => {
                    return Err(nodes.lacking(&format!("failed to {why}")));
                }
                Err(why) => activity.warn(&format!("no keyboard and no mouse: failed to {why}")),
            }
        }
        if readers.is_empty() {
            Err(nodes
                .lacking("X11 is not used (`via = \"evdev\"`, or only gamepads are requested)"))
        } else {
            Ok(())
        }
    }
}

/// Returns the time until the current second is over and its events have arrived.
fn to_next_second(clock: &Clock) -> Duration {
    let into_ns = clock.now().nanos().saturating_sub(SETTLED_NS).rem_euclid(SECOND_NS);
    Duration::from_nanos((SECOND_NS - into_ns).unsigned_abs())
}

#[cfg(test)]
mod tests;
