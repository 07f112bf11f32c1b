//! Temperature of the skin, and whether the sensor is on it.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::feature::Feature;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::stream::{Signal, Stream};
use teampulse_signal::analysis::Make;
use teampulse_signal::temperature;

use crate::analysed::Analysed;
use crate::context::FeatureContext;
use crate::running::Naming;

/// Temperature of the skin, and whether the sensor is on it.
///
/// - Measures: of each window mean, spread, extremes and slope of the readings on skin.
/// - Formula: that of each value stands in the stream's `method`.
/// - Unit: as declared for each value.
/// - Window: `windows_secs`, each second of the stream's own time; and each phase when it is over.
/// - Reference: none; the limits of what skin can be stand in the `method`.
/// - Limits: a thermometer that hangs in warm air looks like skin.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SkinTemperature {
    /// The lengths of the windows [s]; without it those of the study.
    pub windows_secs: Option<Vec<f64>>,
}

impl Component<dyn Feature, FeatureContext> for SkinTemperature {
    const EXAMPLE: &'static str = "windows_secs = [30, 60, 300]";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        let windows_secs = context.windows_or(self.windows_secs)?;
        Ok(Box::new(Analysed { signal: Signal::Temperature, naming: &NAMING, make, windows_secs }))
    }
}

static NAMING: Naming = Naming {
    leaf: "skin_temperature",
    doc: "Temperature of the skin, its slope, and whether the sensor is on it.",
    events: &[],
};

fn make(_: &Stream) -> Make {
    Box::new(|rate_hz| {
        temperature::analysis::causal(&temperature::analysis::Settings::default(), rate_hz)
    })
}
