//! Pulse waves, their rate, shape and variability, from a PPG.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::EventKind;
use teampulse_core::feature::Feature;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::stream::{Signal, Stream};
use teampulse_signal::analysis::Make;
use teampulse_signal::ppg;

use crate::analysed::Analysed;
use crate::context::FeatureContext;
use crate::running::{Happening, Naming};

/// Pulse waves, their rate, shape and variability, from a PPG.
///
/// - Measures: each pulse (as an event with its interval [ms]), and of each window the pulse rate, its
///   variability, amplitude, rise time and width of the waves, and the quality of the PPG.
/// - Formula: that of each value stands in the stream's `method`.
/// - Unit: as declared for each value.
/// - Window: `windows_secs`, each second of the stream's own time, nonlinear and geometric values anew every
///   10 s; and each phase when it is over.
/// - Reference: Elgendi et al. (2013), doi:10.1371/journal.pone.0076585.
/// - Limits: a pulse is known about half a second after it; motion makes windows poor, and they say so.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Pulse {
    /// The lengths of the windows [s]; without it those of the study.
    pub windows_secs: Option<Vec<f64>>,
}

impl Component<dyn Feature, FeatureContext> for Pulse {
    const EXAMPLE: &'static str = "windows_secs = [30, 60, 300]";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        let windows_secs = context.windows_or(self.windows_secs)?;
        Ok(Box::new(Analysed { signal: Signal::Ppg, naming: &NAMING, make, windows_secs }))
    }
}

static NAMING: Naming = Naming {
    leaf: "pulse",
    doc: "Pulse rate, its variability, the shape of pulse waves, and the quality of the PPG.",
    events: &[Happening {
        kind: "pulse",
        leaf: "pulses",
        word: EventKind::Beat,
        value: "pp_ms",
        duration: "",
    }],
};

fn make(_: &Stream) -> Make {
    Box::new(|rate_hz| ppg::analysis::causal(&ppg::analysis::Settings::default(), rate_hz))
}
