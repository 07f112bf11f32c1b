//! The requests of sessions with Bluetooth Low Energy devices.

use std::fmt;

/// The UUID of a service or characteristic.
///
/// ```
/// use teampulse_devices::gatt::Uuid;
///
/// assert_eq!(Uuid::short(0x2a37).to_string(), "00002a37-0000-1000-8000-00805f9b34fb");
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Uuid(pub u128);

impl Uuid {
    /// Returns the UUID of a number assigned by the Bluetooth SIG (Core specification, vol. 3, part B, 2.5.1).
    pub const fn short(number: u16) -> Self {
        Self(0x0000_0000_0000_1000_8000_0080_5f9b_34fb | (number as u128) << 96)
    }
}

impl fmt::Display for Uuid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, byte) in self.0.to_be_bytes().iter().enumerate() {
            let hyphen = if matches!(at, 4 | 6 | 8 | 10) { "-" } else { "" };
            write!(f, "{hyphen}{byte:02x}")?;
        }
        Ok(())
    }
}

impl fmt::Debug for Uuid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// A request about a characteristic. Report a failure with
/// [`GattSession::fail`](crate::GattSession::fail); success needs no report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// Enable notifications or indications of the characteristic.
    Subscribe(Uuid),
    /// Read the characteristic, and pass its value to [`GattSession::receive`](crate::GattSession::receive).
    Read(Uuid),
    /// Write these bytes to the characteristic with response.
    Write(Uuid, Vec<u8>),
}
