//! Breathing, from a belt.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::EventKind;
use teampulse_core::feature::Feature;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::stream::{Signal, Stream};
use teampulse_signal::analysis::Make;
use teampulse_signal::respiration;

use crate::analysed::Analysed;
use crate::context::FeatureContext;
use crate::running::{Happening, Naming};

/// Breathing, from a belt.
///
/// - Measures: each breath (as an event with its length), and of each window the rate, the depth, the times of
///   inhalation and exhalation, their variability, and the quality.
/// - Formula: that of each value stands in the stream's `method`.
/// - Unit: as declared for each value.
/// - Window: `windows_secs`, each second of the stream's own time; and each phase when it is over.
/// - Reference: Khodadad et al. (2018), doi:10.1088/1361-6579/aad7e6.
/// - Limits: a breath is known when the next one begins; depth is in the unit of the belt.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Breath {
    /// The lengths of the windows [s]; without it those of the study.
    pub windows_secs: Option<Vec<f64>>,
}

impl Component<dyn Feature, FeatureContext> for Breath {
    const EXAMPLE: &'static str = "windows_secs = [30, 60, 300]";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        let windows_secs = context.windows_or(self.windows_secs)?;
        Ok(Box::new(Analysed { signal: Signal::Respiration, naming: &NAMING, make, windows_secs }))
    }
}

static NAMING: Naming = Naming {
    leaf: "breath",
    doc: "Rate, depth and variability of breathing, and the quality of the signal.",
    events: &[Happening {
        kind: "breath",
        leaf: "breaths",
        word: EventKind::Breath,
        value: "amplitude",
        duration: "duration_secs",
    }],
};

fn make(_: &Stream) -> Make {
    Box::new(|rate_hz| {
        respiration::analysis::causal(&respiration::analysis::Settings::default(), rate_hz)
    })
}
