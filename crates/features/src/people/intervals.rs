//! Variability of heart beat intervals that a strap reports.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::EventKind;
use teampulse_core::feature::Feature;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::stream::{Signal, Stream};
use teampulse_signal::analysis::Make;
use teampulse_signal::hrv;

use crate::analysed::Analysed;
use crate::context::FeatureContext;
use crate::running::{Happening, Naming};

/// Variability of heart beat intervals that a strap reports.
///
/// - Measures: each beat (as an event with its interval [ms]), and of each window the variability of corrected
///   intervals in time, frequency and geometry.
/// - Formula: that of each value stands in the stream's `method`.
/// - Unit: as declared for each value.
/// - Window: `windows_secs`, each second of the stream's own time, nonlinear and geometric values anew every
///   10 s; and each phase when it is over.
/// - Reference: Task Force (1996), doi:10.1161/01.CIR.93.5.1043; Lipponen & Tarvainen (2019),
///   doi:10.1080/03091902.2019.1640306.
/// - Limits: a single lost interval that is not reported as lost remains undetected.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Intervals {
    /// The lengths of the windows [s]; without it those of the study.
    pub windows_secs: Option<Vec<f64>>,
}

impl Component<dyn Feature, FeatureContext> for Intervals {
    const EXAMPLE: &'static str = "windows_secs = [30, 60, 300]";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        let windows_secs = context.windows_or(self.windows_secs)?;
        Ok(Box::new(Analysed { signal: Signal::Interval, naming: &NAMING, make, windows_secs }))
    }
}

static NAMING: Naming = Naming {
    leaf: "intervals",
    doc: "Heart rate variability of intervals.",
    events: &[Happening {
        kind: "beat",
        leaf: "beats",
        word: EventKind::Beat,
        value: "interval_ms",
        duration: "",
    }],
};

fn make(_: &Stream) -> Make {
    Box::new(|rate_hz| hrv::analysis::causal(&hrv::analysis::Settings::default(), rate_hz))
}
