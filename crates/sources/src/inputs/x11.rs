use std::collections::BTreeMap;
use std::os::fd::{AsFd, OwnedFd};
use std::time::Duration;

use teampulse_devices::inputs::{Act, Kind, Which};
use tokio::io::unix::AsyncFd;
use tokio::task::spawn_blocking;
use tokio::time::timeout;
use x11rb::connection::{Connection, RequestConnection};
use x11rb::errors::{ConnectError, DisplayParsingError};
use x11rb::protocol::Event;
use x11rb::protocol::xinput::{
    self, ConnectionExt as _, Device, DeviceClassData, EventMask, Fp3232, RawMotionEvent,
    ValuatorMode, XIDeviceInfo, XIEventMask,
};
use x11rb::protocol::xproto::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

use super::Ended;
use super::activity::Activity;
use super::event_clock::EventClock;
use super::found::is_named;

/// How long a display may take to answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// The error if neither the source nor the environment names a display; it fits after "failed to".
const NOT_SET: &str = "find an X11 display: neither `display` nor the variable DISPLAY is set";
/// The keysyms of Backspace and Delete.
const CORRECTIONS: [u32; 2] = [0xff08, 0xffff];
/// Button numbers that represent turns of a wheel.
const WHEEL: std::ops::RangeInclusive<u32> = 4..=7;

/// The input at an X11 display, from the raw events of `XInput2`, which cover all windows.
pub(super) struct Display {
    connection: RustConnection,
    readable: AsyncFd<OwnedFd>,
    devices: Vec<String>,
    pointers: BTreeMap<u16, Pointer>,
    /// The key codes of Backspace and Delete.
    corrections: Vec<u32>,
    is_of_wayland: bool,
    clock: EventClock,
}

/// A device of the display.
#[derive(Default)]
struct Pointer {
    is_chosen: bool,
    /// Whether the valuators are positions, not movements; and the last positions.
    is_absolute: bool,
    position: [Option<f64>; 2],
}

impl Display {
    /// Connects to a display; the error fits after "failed to".
    pub(super) async fn open(
        display: Option<String>,
        devices: &[String],
    ) -> Result<Display, String> {
        let devices = devices.to_vec();
        let opening = spawn_blocking(move || Display::connect(display.as_deref(), devices));
        match timeout(PATIENCE, opening).await {
            Ok(opened) => {
                opened.unwrap_or_else(|error| std::panic::resume_unwind(error.into_panic()))
            }
            Err(_elapsed) => Err("open the X11 display: it does not answer".into()),
        }
    }

    fn connect(display: Option<&str>, devices: Vec<String>) -> Result<Display, String> {
        let name = display.unwrap_or("DISPLAY");
        let error = |error: &dyn std::fmt::Display| format!("open the X11 display {name}: {error}");
        let (connection, screen) = x11rb::connect(display).map_err(|why| match why {
            ConnectError::DisplayParsingError(DisplayParsingError::DisplayNotSet) => NOT_SET.into(),
            why => error(&why),
        })?;
        let root = connection.setup().roots.get(screen).map(|screen| screen.root);
        let root = root.ok_or_else(|| error(&"it has no screen"))?;
        let has_input = connection.extension_information(xinput::X11_EXTENSION_NAME);
        if !matches!(has_input, Ok(Some(_))) {
            return Err(error(&"it has no XInput extension"));
        }
        let descriptor = connection.stream().as_fd().try_clone_to_owned();
        let readable = descriptor.and_then(watched).map_err(|why| error(&why))?;
        let mut display = Display {
            connection,
            readable,
            devices,
            pointers: BTreeMap::new(),
            corrections: Vec::new(),
            is_of_wayland: false,
            clock: EventClock::default(),
        };
        display.select(root).map_err(|why| error(&why))?;
        Ok(display)
    }

    /// Requests the raw events of all devices.
    fn select(&mut self, root: u32) -> Result<(), x11rb::errors::ReplyError> {
        self.connection.xinput_xi_query_version(2, 2)?.reply()?;
        let mask = XIEventMask::RAW_KEY_PRESS
            | XIEventMask::RAW_KEY_RELEASE
            | XIEventMask::RAW_BUTTON_PRESS
            | XIEventMask::RAW_MOTION;
        let masters = EventMask { deviceid: Device::ALL_MASTER.into(), mask: vec![mask] };
        self.connection.xinput_xi_select_events(root, &[masters])?.check()?;
        let mask = vec![XIEventMask::HIERARCHY];
        let all = EventMask { deviceid: Device::ALL.into(), mask };
        self.connection.xinput_xi_select_events(root, &[all])?.check()?;
        self.is_of_wayland = self.connection.query_extension(b"XWAYLAND")?.reply()?.present;
        self.list()?;
        self.learn_keys()
    }

    /// Lists the devices of the display.
    fn list(&mut self) -> Result<(), x11rb::errors::ReplyError> {
        let found = self.connection.xinput_xi_query_device(Device::ALL)?.reply()?;
        let pointer = |info: &XIDeviceInfo| (info.deviceid, Pointer::of(info, &self.devices));
        self.pointers = found.infos.iter().map(pointer).collect();
        Ok(())
    }

    /// Finds the key codes of Backspace and Delete.
    fn learn_keys(&mut self) -> Result<(), x11rb::errors::ReplyError> {
        let setup = self.connection.setup();
        let (first, last) = (setup.min_keycode, setup.max_keycode);
        let count = last.saturating_sub(first).saturating_add(1);
        let mapping = self.connection.get_keyboard_mapping(first, count)?.reply()?;
        let width = usize::from(mapping.keysyms_per_keycode).max(1);
        let keys = mapping.keysyms.chunks(width).zip(u32::from(first)..);
        let corrects =
            |keysyms: &[u32]| keysyms.first().is_some_and(|one| CORRECTIONS.contains(one));
        self.corrections =
            keys.filter(|(keysyms, _)| corrects(keysyms)).map(|(_, key)| key).collect();
        Ok(())
    }

    /// Whether the display runs under Wayland, which passes it only the input to its own windows.
    pub(super) fn is_of_wayland(&self) -> bool {
        self.is_of_wayland
    }

    /// Reads events until the display is gone.
    pub(super) async fn read(mut self, kinds: Vec<Kind>, activity: Activity) -> Ended {
        let _present = activity.join(&kinds);
        let why = loop {
            if let Err(why) = self.take_all(&activity) {
                break why;
            }
            match self.readable.readable().await {
                Ok(mut ready) => ready.clear_ready(),
                Err(error) => break error.to_string(),
            }
        };
        Ended { name: "the X11 display".into(), why }
    }

    /// Processes all events that have arrived.
    fn take_all(&mut self, activity: &Activity) -> Result<(), String> {
        let failed = |error: &dyn std::fmt::Display| error.to_string();
        while let Some(event) = self.connection.poll_for_event().map_err(|error| failed(&error))? {
            match event {
                Event::XinputHierarchy(_) => self.list().map_err(|error| failed(&error))?,
                Event::MappingNotify(_) => self.learn_keys().map_err(|error| failed(&error))?,
                event => {
                    if let Some((time_ms, act)) = self.act_of(&event) {
                        let event_ns = i64::from(time_ms) * 1_000_000;
                        activity.take(self.clock.session_ns(event_ns, activity.now_ns()), &act);
                    }
                }
            }
        }
        Ok(())
    }

    /// Returns the action that an event represents, with its time by the display's clock \[ms\].
    fn act_of(&mut self, event: &Event) -> Option<(u32, Act)> {
        let (device, time_ms) = match event {
            Event::XinputRawKeyPress(event) | Event::XinputRawKeyRelease(event) => {
                (event.sourceid, event.time)
            }
            Event::XinputRawButtonPress(event) | Event::XinputRawMotion(event) => {
                (event.sourceid, event.time)
            }
            _ => return None,
        };
        let pointer = self.pointers.get_mut(&device).filter(|pointer| pointer.is_chosen)?;
        let act = match event {
            Event::XinputRawKeyPress(event) => key(event.detail, true, &self.corrections),
            Event::XinputRawKeyRelease(event) => key(event.detail, false, &self.corrections),
            Event::XinputRawButtonPress(event) if WHEEL.contains(&event.detail) => Act::Wheel(1.0),
            Event::XinputRawButtonPress(event) => Act::Click(Which::of(event.detail)),
            Event::XinputRawMotion(event) => pointer.moved(event)?,
            _ => return None,
        };
        Some((time_ms, act))
    }
}

impl Pointer {
    fn of(info: &XIDeviceInfo, devices: &[String]) -> Pointer {
        let is_absolute = info.classes.iter().any(|class| match &class.data {
            DeviceClassData::Valuator(axis) => {
                axis.number < 2 && axis.mode == ValuatorMode::ABSOLUTE
            }
            _ => false,
        });
        let name = String::from_utf8_lossy(&info.name);
        let is_chosen = devices.is_empty() || is_named(&name, devices);
        Pointer { is_chosen, is_absolute, position: [None; 2] }
    }

    fn moved(&mut self, event: &RawMotionEvent) -> Option<Act> {
        let mut values = event.axisvalues_raw.iter().copied().map(number);
        let mask = event.valuator_mask.first().copied().unwrap_or(0);
        let mut moved = [0.0; 2];
        for (axis, moved) in moved.iter_mut().enumerate() {
            if mask >> axis & 1 == 0 {
                continue;
            }
            let value = values.next()?;
            let before = self.position[axis].replace(value);
            *moved =
                if self.is_absolute { before.map_or(0.0, |before| value - before) } else { value };
        }
        let path = moved[0].hypot(moved[1]);
        (path > 0.0).then_some(Act::Move(path))
    }
}

#[expect(
    deprecated,
    reason = "the new function is unsafe; the descriptor is owned, so that it is open as long as it is registered"
)]
fn watched(descriptor: OwnedFd) -> std::io::Result<AsyncFd<OwnedFd>> {
    AsyncFd::new(descriptor)
}

fn key(code: u32, is_down: bool, corrections: &[u32]) -> Act {
    Act::Key { which: Which::of(code), is_down, corrects: corrections.contains(&code) }
}

fn number(fixed: Fp3232) -> f64 {
    f64::from(fixed.integral) + f64::from(fixed.frac) / 4_294_967_296.0
}
