//! Level and responses of the skin's conductance.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::EventKind;
use teampulse_core::feature::Feature;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::stream::{Signal, Stream};
use teampulse_signal::analysis::Make;
use teampulse_signal::eda;

use crate::analysed::Analysed;
use crate::context::FeatureContext;
use crate::running::{Happening, Naming};

/// Level and responses of the skin's conductance.
///
/// - Measures: each response (as an event with its amplitude [µS]), and of each window the level, its slope,
///   how many responses there were and how large, and the quality.
/// - Formula: that of each value stands in the stream's `method`.
/// - Unit: as declared for each value.
/// - Window: `windows_secs`, each second of the stream's own time; and each phase when it is over.
/// - Reference: Boucsein et al. (2012), doi:10.1111/j.1469-8986.2012.01384.x.
/// - Limits: a response is known 1.1 s after its peak; split causally, while `extract` offers cvxEDA.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Skin {
    /// The lengths of the windows [s]; without it those of the study.
    pub windows_secs: Option<Vec<f64>>,
}

impl Component<dyn Feature, FeatureContext> for Skin {
    const EXAMPLE: &'static str = "windows_secs = [30, 60, 300]";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        let windows_secs = context.windows_or(self.windows_secs)?;
        Ok(Box::new(Analysed { signal: Signal::Eda, naming: &NAMING, make, windows_secs }))
    }
}

static NAMING: Naming = Naming {
    leaf: "skin",
    doc: "Level and responses of the skin's conductance, and its quality.",
    events: &[Happening {
        kind: "response",
        leaf: "responses",
        word: EventKind::Response,
        value: "amplitude_us",
        duration: "rise_secs",
    }],
};

fn make(_: &Stream) -> Make {
    Box::new(|rate_hz| eda::analysis::causal(&eda::analysis::Settings::default(), rate_hz))
}
