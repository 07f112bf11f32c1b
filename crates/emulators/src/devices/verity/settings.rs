use schemars::JsonSchema;
use serde::Deserialize;

/// The model of the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VerityModel {
    /// A Verity Sense: its frames are compressed, and its PPG has 55 Hz.
    #[default]
    VeritySense,
    /// An OH1: its frames are not compressed, and its PPG has 135 Hz, reported as 130 Hz (known issues of Polar's SDK).
    Oh1,
}

impl VerityModel {
    /// The advertised name, without the ID.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::VeritySense => "Polar Sense",
            Self::Oh1 => "Polar OH1",
        }
    }

    /// The value of the Model Number characteristic.
    pub(super) const fn number(self) -> &'static [u8] {
        match self {
            Self::VeritySense => b"Polar Sense\0",
            Self::Oh1 => b"OH1\0",
        }
    }
}

/// The properties of an emulated Verity Sense or OH1.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct VeritySettings {
    /// How much too fast the clock runs: 0.02 for 2 %.
    pub clock_fast: f64,
    /// Whether a Verity Sense reports 135 Hz for its PPG of 55 Hz, as before firmware 2.1.0.
    pub reports_false_rate: bool,
    /// The battery charge when the sensor is switched on \[%\].
    pub battery_percent: f64,
    /// How fast the battery drains. By default it lasts 20 hours, as the manufacturer states for a Verity Sense.
    pub drain_percent_per_hour: f64,
    /// The faults, in any order.
    #[serde(rename = "faults")]
    pub incidents: Vec<VerityIncident>,
    /// The seed of the noise while the sensor is off the skin.
    pub seed: u64,
    /// The model of the sensor.
    #[serde(skip)]
    pub model: VerityModel,
    /// The ID, which is printed on the sensor and part of its name.
    #[serde(skip)]
    pub serial: String,
}

impl Default for VeritySettings {
    fn default() -> Self {
        Self {
            clock_fast: 0.0,
            reports_false_rate: false,
            battery_percent: 80.0,
            drain_percent_per_hour: 5.0,
            incidents: Vec::new(),
            seed: 1,
            model: VerityModel::default(),
            serial: "B1C2D3E4".into(),
        }
    }
}

/// A fault at a given time.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VerityIncident {
    /// When the fault begins \[s\].
    pub at_secs: f64,
    /// The fault.
    pub fault: VerityFault,
}

/// The possible faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VerityFault {
    /// The next frame is not sent.
    LostFrame,
    /// A bit of this byte of the next frame is flipped.
    CorruptByte(usize),
    /// No frame is sent until a stream is started again.
    Stall,
    /// The next answer is not sent.
    LostAnswer,
    /// The sensor stops all streams by itself and reports it, as when its button is pressed.
    Stopped,
    /// The arm moves: intervals between pulses are marked as unusable.
    Moving,
    /// The arm is still again.
    Still,
    /// The sensor is taken off: it measures noise and no pulses.
    Off,
    /// The sensor is put on again.
    On,
}
