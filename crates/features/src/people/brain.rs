//! Bands, indices and blinks of an EEG of any number of channels.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::EventKind;
use teampulse_core::feature::Feature;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::stream::{Signal, Stream};
use teampulse_signal::analysis::Make;
use teampulse_signal::eeg;

use crate::analysed::Analysed;
use crate::context::FeatureContext;
use crate::running::{Happening, Naming};

/// Bands, indices and blinks of an EEG of any number of channels.
///
/// - Measures: each blink (as an event), and of each channel and window the powers of the bands, the indices
///   of engagement, workload and asymmetry where the channels for them are there, and the quality.
/// - Formula: that of each value stands in the stream's `method`.
/// - Unit: as declared for each value.
/// - Window: `windows_secs`, each second of the stream's own time; and each phase when it is over.
/// - Reference: Pope et al. (1995), doi:10.1016/0301-0511(95)05116-3.
/// - Limits: indices are validated on groups under controlled conditions; for a single person they are
///   estimates.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Brain {
    /// The lengths of the windows [s]; without it those of the study.
    pub windows_secs: Option<Vec<f64>>,
}

impl Component<dyn Feature, FeatureContext> for Brain {
    const EXAMPLE: &'static str = "windows_secs = [30, 60, 300]";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        let windows_secs = context.windows_or(self.windows_secs)?;
        Ok(Box::new(Analysed { signal: Signal::Eeg, naming: &NAMING, make, windows_secs }))
    }
}

static NAMING: Naming = Naming {
    leaf: "brain",
    doc: "Bands, indices, blinks and quality of an EEG.",
    events: &[Happening {
        kind: "blink",
        leaf: "blinks",
        word: EventKind::Blink,
        value: "amplitude_uv",
        duration: "duration_secs",
    }],
};

fn make(stream: &Stream) -> Make {
    let channels = stream.channels.iter().map(|channel| channel.name.clone()).collect();
    let settings = eeg::analysis::Settings { channels, ..eeg::analysis::Settings::default() };
    Box::new(move |rate_hz| eeg::analysis::causal(&settings, rate_hz))
}
