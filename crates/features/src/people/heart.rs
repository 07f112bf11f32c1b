//! Heart beats, their rate and its variability, from an ECG.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::EventKind;
use teampulse_core::feature::Feature;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::stream::{Signal, Stream};
use teampulse_signal::analysis::Make;
use teampulse_signal::ecg;

use crate::analysed::Analysed;
use crate::context::FeatureContext;
use crate::running::{Happening, Naming};

/// Heart beats, their rate and its variability, from an ECG.
///
/// - Measures: each beat (as an event with its interval [ms]), and of each window the heart rate, the
///   variability of corrected intervals in time, frequency and geometry, breathing as it shows in the
///   heart, and the quality of the ECG.
/// - Formula: that of each value stands in the stream's `method`.
/// - Unit: as declared for each value.
/// - Window: `windows_secs`, each second of the stream's own time, nonlinear and geometric values anew every
///   10 s; and each phase when it is over.
/// - Reference: Task Force (1996), doi:10.1161/01.CIR.93.5.1043; Lipponen & Tarvainen (2019),
///   doi:10.1080/03091902.2019.1640306.
/// - Limits: a beat is known a quarter of a second after it; LF needs 120 s, HF 60 s.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Heart {
    /// The lengths of the windows [s]; without it those of the study.
    pub windows_secs: Option<Vec<f64>>,
}

impl Component<dyn Feature, FeatureContext> for Heart {
    const EXAMPLE: &'static str = "windows_secs = [30, 60, 300]";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        let windows_secs = context.windows_or(self.windows_secs)?;
        let make = match context.mains_hz {
            None => |_: &Stream| analysis(None),
            Some(50.0) => |_: &Stream| analysis(Some(50.0)),
            Some(60.0) => |_: &Stream| analysis(Some(60.0)),
            Some(wrong) => {
                let message = format!("mains of {wrong} Hz: expected 50 or 60");
                let hint = "remove it to detect the mains in the signal";
                return Err(SettingsError::new(message).with_hint(hint).at("mains_hz"));
            }
        };
        Ok(Box::new(Analysed { signal: Signal::Ecg, naming: &NAMING, make, windows_secs }))
    }
}

static NAMING: Naming = Naming {
    leaf: "heart",
    doc: "Heart rate, its variability, and the quality of the ECG.",
    events: &[Happening {
        kind: "beat",
        leaf: "beats",
        word: EventKind::Beat,
        value: "rr_ms",
        duration: "",
    }],
};

fn analysis(mains_hz: Option<f64>) -> Make {
    let settings = ecg::analysis::Settings { mains_hz, ..ecg::analysis::Settings::default() };
    Box::new(move |rate_hz| ecg::analysis::causal(&settings, rate_hz))
}
