//! Analyses of the heart, from signals that show its beats.

use teampulse_core::data::EventKind;
use teampulse_core::stream::Signal;
use teampulse_signal::{ecg, hrv, ppg};

use super::{Analysis, Chosen, Documented, Happening, Tabled};

/// The remark on the windows of analyses of beats.
const SLOW: &str = ", nonlinear and geometric values every 10 s";
const OF_VARIABILITY: &str = "Task Force (1996), doi:10.1161/01.CIR.93.5.1043; Lipponen & Tarvainen (2019), \
     doi:10.1080/03091902.2019.1640306.";

pub(super) const ECG: Analysis = Analysis {
    signal: Signal::Ecg,
    feature: Some(Documented {
        name: "heart",
        doc: "Heart rate, its variability, and the quality of the ECG.",
        summary: "Heartbeats, their rate and its variability, from an ECG.",
        measures: "each beat (as an event with its interval [ms]), and for each window the heart rate, \
            time-domain, frequency-domain, geometric and nonlinear variability of corrected intervals, breathing \
            derived from the ECG, and its quality.",
        windows: SLOW,
        reference: OF_VARIABILITY,
        limits: "a beat is reported a quarter of a second after it occurs; LF needs 120 s, HF 60 s.",
    }),
    events: &[Happening {
        kind: "beat",
        leaf: "beats",
        word: EventKind::Beat,
        value: "rr_ms",
        duration: "",
    }],
    table: Tabled {
        help: "Electrocardiogram, in any unit",
        columns: &["ecg", "ekg"],
        files: &["ecg", "ekg"],
        channels: Some(1),
        least_hz: 50.0,
    },
    causal: |chosen, rate_hz| ecg::analysis::causal(&heart(chosen), rate_hz),
    whole: |chosen, recording| ecg::analysis::whole(&heart(chosen), recording),
};

pub(super) const PPG: Analysis = Analysis {
    signal: Signal::Ppg,
    feature: Some(Documented {
        name: "pulse",
        doc: "Pulse rate, its variability, the shape of pulse waves, and the quality of the PPG.",
        summary: "Pulse waves, their rate, shape and variability, from a PPG.",
        measures: "each pulse (as an event with its interval [ms]), and for each window the pulse rate and its \
            variability, the amplitude, rise time and width of pulse waves, and the quality of the PPG.",
        windows: SLOW,
        reference: "Elgendi et al. (2013), doi:10.1371/journal.pone.0076585.",
        limits: "a pulse is reported about half a second after it occurs; motion lowers the quality of windows.",
    }),
    events: &[Happening {
        kind: "pulse",
        leaf: "pulses",
        word: EventKind::Beat,
        value: "pp_ms",
        duration: "",
    }],
    table: Tabled {
        help: "Photoplethysmogram (blood volume pulse), in any unit",
        columns: &["ppg", "bvp", "pleth", "pulse", "channel 0"],
        files: &["ppg", "bvp"],
        channels: Some(1),
        least_hz: 10.0,
    },
    causal: |chosen, rate_hz| ppg::analysis::causal(&pulse(chosen), rate_hz),
    whole: |chosen, recording| ppg::analysis::whole(&pulse(chosen), recording),
};

pub(super) const INTERVAL: Analysis = Analysis {
    signal: Signal::Interval,
    feature: Some(Documented {
        name: "intervals",
        doc: "Heart rate variability of intervals.",
        summary: "Variability of heartbeat intervals that a strap reports.",
        measures: "each beat (as an event with its interval [ms]), and for each window time-domain, \
            frequency-domain, geometric and nonlinear variability of corrected intervals.",
        windows: SLOW,
        reference: OF_VARIABILITY,
        limits: "a single lost interval that is not reported as lost remains undetected.",
    }),
    events: &[Happening {
        kind: "beat",
        leaf: "beats",
        word: EventKind::Beat,
        value: "interval_ms",
        duration: "",
    }],
    table: Tabled {
        help: "Intervals between heartbeats [ms], one per line",
        columns: &["rr", "rri", "ibi", "interval", "nn", "pp", "ppi"],
        files: &["ibi", "rr", "rri", "ppi", "intervals"],
        channels: Some(1),
        least_hz: 0.2,
    },
    causal: |chosen, rate_hz| hrv::analysis::causal(&intervals(chosen), rate_hz),
    whole: |chosen, recording| hrv::analysis::whole(&intervals(chosen), recording),
};

fn heart(chosen: &Chosen) -> ecg::analysis::Settings {
    ecg::analysis::Settings { mains_hz: chosen.mains_hz, ..Default::default() }
}

fn pulse(chosen: &Chosen) -> ppg::analysis::Settings {
    ppg::analysis::Settings { unit: chosen.unit.clone().into(), ..Default::default() }
}

fn intervals(chosen: &Chosen) -> hrv::analysis::Settings {
    hrv::analysis::Settings {
        treatment: chosen.artefacts,
        most_astray_secs: chosen.most_astray_secs,
        ..Default::default()
    }
}
