//! Analyses of unknown signals.

use teampulse_core::stream::Signal;
use teampulse_signal::descriptive;

use super::{Analysis, Chosen, Tabled};

pub(super) const OTHER: Analysis = Analysis {
    signal: Signal::Other,
    feature: None,
    events: &[],
    table: Tabled {
        help: "Any other numbers",
        columns: &[],
        files: &[],
        channels: None,
        least_hz: 0.0,
    },
    causal: |chosen, rate_hz| descriptive::analysis::causal(&any(chosen), rate_hz),
    whole: |chosen, recording| descriptive::analysis::whole(&any(chosen), recording),
};

fn any(chosen: &Chosen) -> descriptive::analysis::Settings {
    let channel = |name: &String| descriptive::analysis::Channel {
        name: name.clone(),
        unit: chosen.unit.clone(),
    };
    descriptive::analysis::Settings { channels: chosen.channels.iter().map(channel).collect() }
}
