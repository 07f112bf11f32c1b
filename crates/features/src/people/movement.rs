//! Movement and posture, from three axes of acceleration.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::feature::Feature;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::stream::{Signal, Stream};
use teampulse_signal::acceleration::analysis::{Settings, causal};
use teampulse_signal::analysis::Make;

use crate::analysed::Analysed;
use crate::context::FeatureContext;
use crate::running::Naming;

/// Movement and posture, from three axes of acceleration.
///
/// - Measures: of each window the magnitude of acceleration, ENMO, activity, tilt, and how much of it was motion
///   enough to spoil signals beside it.
/// - Formula: that of each value stands in the stream's `method`.
/// - Unit: as declared for each value.
/// - Window: `windows_secs`, each second of the stream's own time; and each phase when it is over.
/// - Reference: van Hees et al. (2013), doi:10.1371/journal.pone.0061691.
/// - Limits: in g; a stream in m/s², mg or 1/64 g is converted by its unit.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Movement {
    /// The lengths of the windows [s]; without it those of the study.
    pub windows_secs: Option<Vec<f64>>,
}

impl Component<dyn Feature, FeatureContext> for Movement {
    const EXAMPLE: &'static str = "windows_secs = [30, 60, 300]";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        let windows_secs = context.windows_or(self.windows_secs)?;
        Ok(Box::new(Analysed { signal: Signal::Acceleration, naming: &NAMING, make, windows_secs }))
    }
}

static NAMING: Naming = Naming {
    leaf: "movement",
    doc: "Movement, posture and motion that spoils signals.",
    events: &[],
};

fn make(_: &Stream) -> Make {
    Box::new(|rate_hz| causal(&Settings::default(), rate_hz))
}
