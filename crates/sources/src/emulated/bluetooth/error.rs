use teampulse_emulators::devices::AttError;

/// Why the emulated Bluetooth did not start, or why it ended.
#[derive(Debug, thiserror::Error)]
pub enum EmulatedBluetoothError {
    /// `dbus-daemon` is not installed on this machine.
    #[error("start a private D-Bus: dbus-daemon is not installed")]
    NoDaemon,
    /// The private `dbus-daemon` can't be run, or has ended.
    #[error("start a private D-Bus: {0}")]
    Daemon(String),
    /// The connection to the private D-Bus failed.
    #[error("serve org.bluez on the private D-Bus: {0}")]
    Bus(#[from] zbus::Error),
    /// Two devices have this address.
    #[error("emulate two Bluetooth devices with the address {0}")]
    SameAddress(String),
}

impl EmulatedBluetoothError {
    /// What the user can do.
    pub const fn hint(&self) -> &'static str {
        match self {
            Self::NoDaemon => "install it: apt install dbus-daemon",
            Self::Daemon(_) | Self::Bus(_) => "does `dbus-daemon --session --nofork` run?",
            Self::SameAddress(_) => "give each device a different address",
        }
    }
}

/// The errors that BlueZ answers with (doc/org.bluez.Device.rst and others of its source).
#[derive(Debug, zbus::DBusError)]
#[zbus(prefix = "org.bluez.Error")]
pub(super) enum BluezError {
    Failed(String),
    InProgress(String),
    NotConnected(String),
    NotPermitted(String),
    NotSupported(String),
    DoesNotExist(String),
    #[zbus(error)]
    Bus(zbus::Error),
}

impl From<AttError> for BluezError {
    fn from(error: AttError) -> Self {
        let code = match error {
            AttError::NotPermitted => return Self::NotPermitted("Not permitted".into()),
            AttError::NotSubscribed => 0xfd,
            AttError::Length => 0x0d,
        };
        Self::Failed(format!("Operation failed with ATT error: 0x{code:02x}"))
    }
}
