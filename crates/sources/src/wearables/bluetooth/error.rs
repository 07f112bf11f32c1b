use thiserror::Error;

use teampulse_core::source::SourceError;

/// Why a Bluetooth device can't be used. The message fits after "failed to".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum BluetoothError {
    /// D-Bus is not running, or refuses the connection.
    #[error("connect to the system's D-Bus: {0}")]
    Bus(String),
    /// No program owns the name `org.bluez`, or its owner has left the bus.
    #[error("reach BlueZ on D-Bus: {0}")]
    Daemon(String),
    /// This computer has no adapter, or it is disabled.
    #[error("find a Bluetooth adapter: BlueZ has none")]
    Adapter,
    /// The adapter is present but does not work.
    #[error("use the Bluetooth adapter {0}: it is powered off")]
    Off(String),
    /// A scan found no matching device.
    #[error("find {0}: it is not in range")]
    NotInRange(String),
    /// Several devices match, but only one is wanted.
    #[error("choose {wanted}: {found} are in range")]
    Several {
        /// The wanted device.
        wanted: String,
        /// The matching devices, with their addresses.
        found: String,
        /// The setting that selects one.
        setting: String,
    },
    /// Another source of this session holds the device.
    #[error("connect to {0}: another source of this session uses it")]
    Taken(String),
    /// Another session of teampulse, on this computer, holds the device.
    #[error("connect to {0}: another session of teampulse uses it")]
    Elsewhere(String),
    /// The device was found, but connecting failed.
    #[error("connect to {device}: {reason}")]
    Connect {
        /// The device.
        device: String,
        /// The reason given by `BlueZ`.
        reason: String,
    },
    /// The link was lost.
    #[error("continue: the Bluetooth link is lost")]
    Lost,
}

impl BluetoothError {
    /// What the user can do.
    pub fn hint(&self) -> String {
        match self {
            Self::Bus(_) => "is dbus running? In a container, share /run/dbus with it".into(),
            Self::Daemon(_) => "start it: `sudo systemctl start bluetooth`".into(),
            Self::Adapter => "plug one in; `rfkill list` and `bluetoothctl list` show them".into(),
            Self::Off(_) => "`bluetoothctl power on`, or `rfkill unblock bluetooth`".into(),
            Self::NotInRange(_) => {
                "is it worn, charged and in range, with no phone connected to it? \
                `teampulse scan` lists the devices in range"
                    .into()
            }
            Self::Several { setting, .. } => setting.clone(),
            Self::Taken(_) => "give each source the address of its own device".into(),
            Self::Elsewhere(_) => "end that session, or its `teampulse check`, first".into(),
            Self::Connect { .. } => "bring it closer, or take it off and put it on again".into(),
            Self::Lost => "is the device on, and in range?".into(),
        }
    }
}

impl From<BluetoothError> for SourceError {
    fn from(error: BluetoothError) -> SourceError {
        SourceError::Gone { message: error.to_string(), hint: error.hint() }
    }
}
