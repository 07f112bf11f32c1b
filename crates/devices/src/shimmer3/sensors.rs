use std::ops::BitOr;

/// A set of sensors, as in the firmware's three bytes.
///
/// ```
/// use teampulse_devices::shimmer3::Sensors;
///
/// let sensors = Sensors::GSR | Sensors::PPG;
/// assert!(sensors.has(Sensors::PPG) && !sensors.has(Sensors::BATTERY));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sensors(pub u32);

impl Sensors {
    /// Skin conductance.
    pub const GSR: Self = Self(0x04);
    /// The optical sensor on the internal ADC channel 13, including its power.
    pub const PPG: Self = Self(0x01 << 8);
    /// The low-noise accelerometer.
    pub const ACCELERATION_LOW_NOISE: Self = Self(0x80);
    /// The wide-range accelerometer.
    pub const ACCELERATION_WIDE_RANGE: Self = Self(0x10 << 8);
    /// The gyroscope.
    pub const GYROSCOPE: Self = Self(0x40);
    /// The magnetometer.
    pub const MAGNETOMETER: Self = Self(0x20);
    /// The voltage of the battery.
    pub const BATTERY: Self = Self(0x20 << 8);

    /// Whether all of these are in the set.
    pub const fn has(self, sensors: Self) -> bool {
        self.0 & sensors.0 == sensors.0
    }
}

impl BitOr for Sensors {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}
