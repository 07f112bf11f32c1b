use super::SettingKind;
use crate::Channel;

/// What a PMD device can measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Measurement {
    /// Electrocardiogram (H10).
    Ecg = 0,
    /// Photoplethysmogram (Verity Sense, OH1).
    Ppg = 1,
    /// Acceleration (all).
    Acceleration = 2,
    /// Pulse-to-pulse intervals (Verity Sense, OH1).
    PpInterval = 3,
    /// Angular velocity (Verity Sense).
    Gyroscope = 5,
    /// Magnetic flux density (Verity Sense).
    Magnetometer = 6,
}

impl Measurement {
    /// All measurements.
    pub const ALL: [Self; 6] = [
        Self::Ecg,
        Self::Ppg,
        Self::Acceleration,
        Self::PpInterval,
        Self::Gyroscope,
        Self::Magnetometer,
    ];

    /// Returns the measurement with this code, which is in the lower six bits.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|measurement| *measurement as u8 == code & 0x3f)
    }

    /// The name of the measurement's stream.
    pub const fn stream(self) -> &'static str {
        match self {
            Self::Ecg => "ecg",
            Self::Ppg => "ppg",
            Self::Acceleration => "acceleration",
            Self::PpInterval => "pp_interval",
            Self::Gyroscope => "gyroscope",
            Self::Magnetometer => "magnetometer",
        }
    }

    /// Whether a start request for the measurement needs this kind of setting; the device offers values for each.
    pub(super) const fn is_configured_by(self, kind: SettingKind) -> bool {
        !matches!(self, Self::PpInterval)
            && !matches!(kind, SettingKind::Factor | SettingKind::Security)
    }
}

/// How the samples of a frame type are encoded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Layout {
    pub channels: &'static [&'static str],
    pub bits: u32,
    pub floating: bool,
    unit: &'static str,
    scale: f64,
}

const XYZ: &[&str] = &["x", "y", "z"];
const PPG: &[&str] = &["ppg0", "ppg1", "ppg2", "ambient"];

impl Layout {
    /// Returns the layout of a frame type; `None` if it is not documented.
    pub fn of(measurement: Measurement, compressed: bool, kind: u8) -> Option<Self> {
        use Measurement::{Acceleration, Ecg, Gyroscope, Magnetometer, Ppg};
        let integers = |channels, bits, unit, scale| {
            Some(Self { channels, bits, floating: false, unit, scale })
        };
        match (measurement, compressed, kind) {
            (Ecg, false, 0) => integers(&["ecg"], 24, "uV", 1.0),
            (Acceleration, false, 0) => integers(XYZ, 8, "g", 0.001),
            (Acceleration, _, 1) => integers(XYZ, 16, "g", 0.001),
            (Acceleration, false, 2) => integers(XYZ, 24, "g", 0.001),
            (Acceleration, true, 0) => integers(XYZ, 16, "g", 1.0),
            (Ppg, _, 0) => integers(PPG, 24, "", 1.0),
            (Gyroscope, true, 0) => integers(XYZ, 16, "deg/s", 1.0),
            (Gyroscope, true, 1) => {
                Some(Self { channels: XYZ, bits: 32, floating: true, unit: "deg/s", scale: 1.0 })
            }
            // Gauss, and milligauss with the state of the calibration.
            (Magnetometer, true, 0) => integers(XYZ, 16, "uT", 100.0),
            (Magnetometer, true, 1) => integers(&["x", "y", "z", "calibration"], 16, "uT", 0.1),
            _ => None,
        }
    }

    /// The size of one sample [bytes].
    pub fn sample_bytes(&self) -> usize {
        self.channels.len() * self.bits.div_ceil(8) as usize
    }

    /// Returns the channels, with the factor from the device's answer to the start request.
    pub fn channels_with_factor(&self, factor: f64) -> Vec<Channel> {
        let scale = self.scale * factor;
        let channel = |name: &&'static str| match *name {
            "calibration" => Channel::new("calibration", ""),
            name => Channel::new(name, self.unit).scaled(scale),
        };
        self.channels.iter().map(channel).collect()
    }
}
