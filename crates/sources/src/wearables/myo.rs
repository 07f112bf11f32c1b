//! A Myo armband.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::command::Command as SessionCommand;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::Source;
use teampulse_devices::myo::{Command, EmgMode, MyoSession, MyoSettings, SERVICE, Vibration};

use super::bluetooth::{Pairing, Seen, Wearable, Wireless};
use crate::SourceContext;

/// The name of the device in a study and in the table of latencies.
pub(super) const DEVICE: &str = "myo";
/// The longest vibration that counts as short, and the longest that counts as medium \[s\].
const SHORT_SECS: f64 = 0.3;
const MEDIUM_SECS: f64 = 0.7;

/// A Myo armband that a person wears, over Bluetooth: EMG of eight electrodes (200 Hz); orientation, acceleration and
/// rotation (50 Hz); and battery. Poses and taps are markers. The armband vibrates when it is connected, and on the
/// command `vibrate`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Myo {
    /// The person who wears the Myo, by pseudonym: `p001`.
    pub person: String,
    /// The Bluetooth address, such as `C0:FF:EE:00:00:01`; by default the only Myo in range.
    #[serde(default)]
    pub address: Option<String>,
    /// The name that its owner gave the Myo, instead of its address.
    #[serde(default)]
    pub name: Option<String>,
    /// Whether to measure EMG.
    #[serde(default = "yes")]
    pub emg: bool,
    /// Whether to measure orientation, acceleration and rotation.
    #[serde(default = "yes")]
    pub motion: bool,
    /// Whether to report the poses that the armband recognises.
    #[serde(default = "yes")]
    pub poses: bool,
}

fn yes() -> bool {
    true
}

impl Component<dyn Source, SourceContext> for Myo {
    const EXAMPLE: &'static str = r#"person = "p001""#;

    fn build(self, context: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        let Myo { person, address, name, emg, motion, poses } = self;
        let emg = if emg { EmgMode::Raw } else { EmgMode::Off };
        let settings = MyoSettings { emg, imu: motion, poses, ..MyoSettings::default() };
        Wireless::<MyoSession>::build(Pairing { person, address, name }, settings, context)
    }
}

impl Wearable for MyoSession {
    const KIND: &'static str = DEVICE;

    type Settings = MyoSettings;

    fn session(settings: &MyoSettings, _: &Seen) -> Self {
        Self::new(*settings)
    }

    fn is_kind(seen: &Seen) -> bool {
        seen.services.contains(&SERVICE)
    }

    fn device(_: &Seen) -> &'static str {
        DEVICE
    }

    fn accepts(command: &SessionCommand, person: &str) -> bool {
        matches!(command, SessionCommand::Vibrate { subject, .. } if subject == person)
    }

    fn obey(&mut self, command: &SessionCommand) {
        if let SessionCommand::Vibrate { secs, .. } = command {
            self.command(Command::Vibrate(match *secs {
                secs if secs <= SHORT_SECS => Vibration::Short,
                secs if secs <= MEDIUM_SECS => Vibration::Medium,
                _ => Vibration::Long,
            }));
        }
    }
}
