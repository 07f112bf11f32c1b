use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use evdev::raw_stream::{EventStream, RawDevice};
use teampulse_core::counted::counted;
use teampulse_core::source::SourceError;
use teampulse_devices::inputs::Kind;
use teampulse_devices::inputs::evdev::{Abilities, Translator};
use tokio::task::JoinSet;

use super::activity::Activity;
use super::event_clock::EventClock;
use super::{Ended, FoundInput};

/// The input devices in `/dev/input`.
pub(super) struct Nodes {
    kinds: Vec<Kind>,
    devices: Vec<String>,
    /// The devices being read.
    open: BTreeSet<PathBuf>,
    /// The devices that could not be opened, each of which is reported once.
    closed: BTreeSet<PathBuf>,
}

impl Nodes {
    pub(super) fn new(kinds: Vec<Kind>, devices: Vec<String>) -> Nodes {
        Nodes { kinds, devices, open: BTreeSet::new(), closed: BTreeSet::new() }
    }

    /// Stops looking for keyboards and mice, which are read from the display instead.
    pub(super) fn leave_to_display(&mut self) {
        self.kinds.retain(|kind| *kind == Kind::Gamepad);
        self.closed.clear();
    }

    /// Starts to read new devices, and those that this user may read by now.
    pub(super) fn look(&mut self, activity: &Activity, readers: &mut JoinSet<Ended>) {
        let is_wanted = |found: &FoundInput| {
            found.kinds.iter().any(|kind| self.kinds.contains(kind))
                && found.is_chosen(&self.devices)
        };
        let found: Vec<FoundInput> = FoundInput::all().into_iter().filter(is_wanted).collect();
        self.closed.retain(|path| found.iter().any(|each| each.path == *path));
        for FoundInput { path, name, .. } in found {
            if self.open.contains(&path) {
                continue;
            }
            match open(&path, &self.kinds) {
                Ok((stream, translator)) => {
                    self.closed.remove(&path);
                    self.open.insert(path.clone());
                    readers.spawn(read(stream, translator, path, activity.clone()));
                }
                Err(error) => {
                    let is_new = self.closed.insert(path.clone());
                    if is_new && !readers.is_empty() {
                        activity
                            .warn(&format!("failed to open {name} at {}: {error}", path.display()));
                    }
                }
            }
        }
    }

    /// Forgets a device that is no longer read.
    pub(super) fn forget(&mut self, name: &str) {
        self.open.remove(Path::new(name));
    }

    /// Returns the error if there is nothing to read; `display` states why X11 is not read either.
    pub(super) fn lacking(&self, display: &str) -> SourceError {
        match self.closed.len() {
            0 => SourceError::Gone {
                message: format!(
                    "read inputs: /dev/input has none of the requested devices, and {display}"
                ),
                hint: "plug in a keyboard, mouse or gamepad, or set `display`, such as \":0\"; `teampulse scan` lists \
                       the devices"
                    .into(),
            },
            denied => SourceError::Gone {
                message: format!(
                    "read inputs: {} in /dev/input may not be read, and {display}",
                    counted(denied, "device", "devices")
                ),
                hint: "run `sudo usermod -aG input $USER`, then log out and in again".into(),
            },
        }
    }
}

fn open(path: &Path, kinds: &[Kind]) -> io::Result<(EventStream, Translator)> {
    let device = RawDevice::open(path)?;
    let keys = device.supported_keys().into_iter().flat_map(|keys| keys.iter());
    let relative = device.supported_relative_axes().into_iter().flat_map(|axes| axes.iter());
    let absolute = device.supported_absolute_axes().into_iter().flat_map(|axes| axes.iter());
    let ranges = device.get_abs_state()?;
    let range =
        |code: u16| ranges.get(usize::from(code)).map(|range| (code, range.minimum, range.maximum));
    let abilities = Abilities {
        keys: keys.map(evdev::KeyCode::code).collect(),
        relative: relative.map(|axis| axis.0).collect(),
        absolute: absolute.filter_map(|axis| range(axis.0)).collect(),
    };
    Ok((device.into_event_stream()?, Translator::new(&abilities, kinds)))
}

/// Reads a device until it is gone.
async fn read(
    mut events: EventStream,
    mut translator: Translator,
    path: PathBuf,
    activity: Activity,
) -> Ended {
    let _present = activity.join(translator.kinds());
    let mut clock = EventClock::default();
    loop {
        let event = match events.next_event().await {
            Ok(event) => event,
            Err(error) => {
                return Ended { name: path.display().to_string(), why: error.to_string() };
            }
        };
        let since_epoch = event.timestamp().duration_since(UNIX_EPOCH).unwrap_or_default();
        let event_ns = i64::try_from(since_epoch.as_nanos()).unwrap_or(i64::MAX);
        let at_ns = clock.session_ns(event_ns, activity.now_ns());
        for act in translator.take(event.event_type().0, event.code(), event.value()) {
            activity.take(at_ns, &act);
        }
    }
}
