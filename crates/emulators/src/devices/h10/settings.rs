use schemars::JsonSchema;
use serde::Deserialize;

use crate::devices::pmd::MTU;

/// The properties of an emulated H10.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct H10Settings {
    /// How much too fast the clock runs: 0.02 for 2 %.
    pub clock_fast: f64,
    /// The time from the start of a stream to its first frame \[s\]; up to 30 s have been observed.
    pub start_delay_secs: f64,
    /// The MTU of the link.
    pub mtu: u16,
    /// The faults, in any order.
    #[serde(rename = "faults")]
    pub incidents: Vec<Incident>,
    /// The seed of the noise while the strap is off the skin.
    pub seed: u64,
    /// The ID, which is printed on the strap and part of its name.
    #[serde(skip)]
    pub serial: String,
    /// The battery charge when the strap is switched on \[%\].
    pub battery_percent: f64,
    /// How fast the battery drains. By default it lasts 400 hours, as the manufacturer states.
    pub drain_percent_per_hour: f64,
}

impl Default for H10Settings {
    fn default() -> Self {
        Self {
            clock_fast: 0.0,
            start_delay_secs: 0.0,
            mtu: MTU,
            incidents: Vec::new(),
            seed: 1,
            serial: "A1B2C3D4".into(),
            battery_percent: 87.0,
            drain_percent_per_hour: 0.25,
        }
    }
}

/// A fault at a given time.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Incident {
    /// When the fault begins \[s\].
    pub at_secs: f64,
    /// The fault.
    pub fault: Fault,
}

/// The possible faults.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// The next frame is not sent.
    LostFrame,
    /// The next frame is sent twice.
    RepeatedFrame,
    /// A bit of this byte of the next frame is flipped.
    CorruptByte(usize),
    /// No frame is sent until the stream is started again.
    Stall,
    /// The clock is set forward \[ns\].
    ClockSet(u64),
    /// The next answer is not sent.
    LostAnswer,
    /// The next answer is delayed by this much \[s\].
    LateAnswer(f64),
    /// The next command is answered with success but not carried out.
    FalseAnswer,
    /// The strap is taken off: it measures noise and no beats.
    StrapOff,
    /// The strap is put on again.
    StrapOn,
}
