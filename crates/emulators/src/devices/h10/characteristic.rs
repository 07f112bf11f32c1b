use crate::devices::assigned;

/// The characteristics that can be read, written or subscribed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Characteristic {
    /// Heart Rate Measurement, 0x2A37.
    HeartRate,
    /// Body Sensor Location, 0x2A38.
    SensorLocation,
    /// Battery Level, 0x2A19.
    Battery,
    /// Manufacturer Name, 0x2A29.
    Manufacturer,
    /// Model Number, 0x2A24.
    Model,
    /// Serial Number, 0x2A25.
    Serial,
    /// Firmware Revision, 0x2A26.
    Firmware,
    /// The control point of the PMD service, FB005C81.
    Control,
    /// The data of the PMD service, FB005C82.
    Data,
}

impl Characteristic {
    const ALL: [Self; 9] = [
        Self::HeartRate,
        Self::SensorLocation,
        Self::Battery,
        Self::Manufacturer,
        Self::Model,
        Self::Serial,
        Self::Firmware,
        Self::Control,
        Self::Data,
    ];

    /// The UUID of the characteristic.
    pub const fn uuid(self) -> u128 {
        match self {
            Self::HeartRate => assigned(0x2a37),
            Self::SensorLocation => assigned(0x2a38),
            Self::Battery => assigned(0x2a19),
            Self::Manufacturer => assigned(0x2a29),
            Self::Model => assigned(0x2a24),
            Self::Serial => assigned(0x2a25),
            Self::Firmware => assigned(0x2a26),
            Self::Control => measurement_data(1),
            Self::Data => measurement_data(2),
        }
    }

    /// Returns the characteristic with this UUID, if an H10 has it.
    pub fn of(uuid: u128) -> Option<Self> {
        Self::ALL.into_iter().find(|one| one.uuid() == uuid)
    }
}

/// Returns a UUID of the Polar Measurement Data service: the service (0), its control point (1) or its data (2).
pub(super) const fn measurement_data(number: u8) -> u128 {
    0xfb00_5c80_02e7_f387_1cad_8acd_2d8d_f0c8 + ((number as u128) << 96)
}
