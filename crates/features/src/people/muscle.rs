//! Activity of muscles, from an EMG of any number of channels.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::EventKind;
use teampulse_core::feature::Feature;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::stream::{Signal, Stream};
use teampulse_signal::analysis::Make;
use teampulse_signal::emg;

use crate::analysed::Analysed;
use crate::context::FeatureContext;
use crate::running::{Happening, Naming};

/// Activity of muscles, from an EMG of any number of channels.
///
/// - Measures: each burst (as an event), and of each channel and window its loudness, frequencies, bursts and
///   quality.
/// - Formula: that of each value stands in the stream's `method`.
/// - Unit: as declared for each value.
/// - Window: `windows_secs`, each second of the stream's own time; and each phase when it is over.
/// - Reference: Phinyomark et al. (2012), doi:10.1016/j.eswa.2012.01.102.
/// - Limits: in the unit of the input; no share of a maximum, which nobody measured.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Muscle {
    /// The lengths of the windows [s]; without it those of the study.
    pub windows_secs: Option<Vec<f64>>,
}

impl Component<dyn Feature, FeatureContext> for Muscle {
    const EXAMPLE: &'static str = "windows_secs = [30, 60, 300]";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        let windows_secs = context.windows_or(self.windows_secs)?;
        Ok(Box::new(Analysed { signal: Signal::Emg, naming: &NAMING, make, windows_secs }))
    }
}

static NAMING: Naming = Naming {
    leaf: "muscle",
    doc: "Loudness, frequencies and bursts of each channel of an EMG, and its quality.",
    events: &[Happening {
        kind: "burst",
        leaf: "bursts",
        word: EventKind::Burst,
        value: "peak_envelope",
        duration: "duration_secs",
    }],
};

fn make(stream: &Stream) -> Make {
    let settings = emg::analysis::Settings {
        channels: stream.channels.iter().map(|each| channel(&each.name)).collect(),
        unit: stream.channels.first().map(|each| each.unit.clone()).unwrap_or_default(),
        ..emg::analysis::Settings::default()
    };
    Box::new(move |rate_hz| emg::analysis::causal(&settings, rate_hz))
}

fn channel(name: &str) -> emg::analysis::Channel {
    emg::analysis::Channel { name: name.to_owned(), mvc: None }
}
