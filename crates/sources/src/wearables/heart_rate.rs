//! Any heart rate strap.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::Source;
use teampulse_devices::heart_rate::{HeartRateSession, SERVICE};

use super::bluetooth::{Pairing, Seen, Wearable, Wireless};
use crate::SourceContext;

/// The type of the source in a study.
pub(super) const KIND: &str = "heart_rate";
/// The device name in streams and in the table of latencies.
pub(super) const DEVICE: &str = "heart_rate_strap";

/// A heart rate strap of any make that a person wears, over Bluetooth: heart rate, every interval between beats
/// (`rr_interval`), skin contact, battery.
///
/// Straps do not time-stamp their intervals: beats are timed by the sum of the intervals relative to the arrivals,
/// minus the strap's delay, which the stated uncertainty includes until `calibrate` has measured it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeartRate {
    /// The person who wears the strap, by pseudonym: `p001`.
    pub person: String,
    /// The strap's Bluetooth address, such as `A0:9E:1A:00:00:01`; by default the only strap in range.
    #[serde(default)]
    pub address: Option<String>,
    /// The name that the strap advertises, instead of its address.
    #[serde(default)]
    pub name: Option<String>,
}

impl Component<dyn Source, SourceContext> for HeartRate {
    const EXAMPLE: &'static str = r#"person = "p001""#;

    fn build(self, context: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        let HeartRate { person, address, name } = self;
        Wireless::<HeartRateSession>::build(Pairing { person, address, name }, (), context)
    }
}

impl Wearable for HeartRateSession {
    const KIND: &'static str = KIND;

    type Settings = ();

    fn session((): &(), _: &Seen) -> Self {
        Self::new()
    }

    fn is_kind(seen: &Seen) -> bool {
        seen.services.contains(&SERVICE)
    }

    fn device(_: &Seen) -> &'static str {
        DEVICE
    }
}
