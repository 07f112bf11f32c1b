//! Polar H10, Verity Sense and OH1 sensors.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::Source;
use teampulse_devices::polar::{Measurement, PolarSession, Selection};

use super::bluetooth::{Pairing, Seen, Wearable, Wireless};
use crate::SourceContext;

/// The type of the source in a study, and the prefix of the device names.
pub(super) const DEVICE: &str = "polar";
const H10: &str = "polar_h10";

/// A Polar sensor that a person wears, over Bluetooth: an H10 on the chest (ECG at 130 Hz), or a Verity Sense or OH1
/// on the arm (PPG and intervals between pulses); heart rate, intervals between beats, battery.
///
/// The streams belong to the device `polar_h10`, `polar_verity_sense` or `polar_oh1`. The first ECG may arrive half a
/// minute after the connection.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Polar {
    /// The person who wears the sensor, by pseudonym: `p001`.
    pub person: String,
    /// The Bluetooth address, such as `A0:9E:1A:00:00:01`; by default the only Polar sensor in range.
    #[serde(default)]
    pub address: Option<String>,
    /// The name that the sensor advertises, instead of its address: `Polar H10 12345678`.
    #[serde(default)]
    pub name: Option<String>,
    /// What to measure besides heart rate: any of `ecg`, `ppg`, `pp_interval`, `acceleration`, `gyroscope`,
    /// `magnetometer`. By default an H10 measures ECG, the others PPG and intervals between pulses. An H10 that sends
    /// ECG and acceleration together may lose its link.
    #[serde(default)]
    pub measure: Option<Vec<Measured>>,
}

/// What a Polar sensor can measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Measured {
    /// Electrocardiogram (H10).
    Ecg,
    /// Pulse wave (Verity Sense, OH1).
    Ppg,
    /// Intervals between pulses (Verity Sense, OH1).
    PpInterval,
    /// Acceleration (all).
    Acceleration,
    /// Angular velocity (Verity Sense).
    Gyroscope,
    /// Magnetic field (Verity Sense).
    Magnetometer,
}

/// Returns what a model measures by default.
fn usual(device: &str) -> Vec<Measured> {
    if device == H10 { vec![Measured::Ecg] } else { vec![Measured::Ppg, Measured::PpInterval] }
}

impl From<Measured> for Selection {
    fn from(measured: Measured) -> Selection {
        Selection::of(match measured {
            Measured::Ecg => Measurement::Ecg,
            Measured::Ppg => Measurement::Ppg,
            Measured::PpInterval => Measurement::PpInterval,
            Measured::Acceleration => Measurement::Acceleration,
            Measured::Gyroscope => Measurement::Gyroscope,
            Measured::Magnetometer => Measurement::Magnetometer,
        })
    }
}

impl Component<dyn Source, SourceContext> for Polar {
    const EXAMPLE: &'static str = r#"person = "p001""#;

    fn build(self, context: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        let Polar { person, address, name, measure } = self;
        Wireless::<PolarSession>::build(Pairing { person, address, name }, measure, context)
    }
}

impl Wearable for PolarSession {
    const KIND: &'static str = DEVICE;

    type Settings = Option<Vec<Measured>>;

    fn session(measure: &Self::Settings, seen: &Seen) -> Self {
        let measure = measure.clone().unwrap_or_else(|| usual(Self::device(seen)));
        let selections: Vec<Selection> = measure.into_iter().map(Selection::from).collect();
        Self::new(&selections)
    }

    fn is_kind(seen: &Seen) -> bool {
        // The names of Polar's watches begin with `Polar`, too.
        Self::device(seen) != DEVICE
    }

    fn device(seen: &Seen) -> &'static str {
        // The last word of the name is the serial number.
        match seen.name.as_str() {
            name if name.starts_with("Polar H10") => H10,
            name if name.starts_with("Polar OH1") => "polar_oh1",
            name if name.starts_with("Polar") && name.contains("Sense") => "polar_verity_sense",
            _ => DEVICE,
        }
    }
}
