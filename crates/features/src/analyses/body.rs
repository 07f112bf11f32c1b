//! Analyses of the body: skin, muscles, brain, breathing and movement.

use teampulse_core::data::EventKind;
use teampulse_core::stream::Signal;
use teampulse_signal::{acceleration, eda, eeg, emg, respiration, temperature};

use super::{Analysis, Chosen, Documented, Happening, Tabled};

pub(super) const EDA: Analysis = Analysis {
    signal: Signal::Eda,
    feature: Some(Documented {
        name: "skin",
        doc: "Level and responses of skin conductance, and its quality.",
        summary: "Level and responses of skin conductance.",
        measures: "each response (as an event with its amplitude [µS]), and for each window the level, its \
            slope, the number and amplitude of responses, and the quality.",
        windows: "",
        reference: "Boucsein et al. (2012), doi:10.1111/j.1469-8986.2012.01384.x.",
        limits: "a response is reported 1.1 s after its peak; the signal is decomposed causally, whereas `extract` \
            also offers cvxEDA.",
    }),
    events: &[Happening {
        kind: "response",
        leaf: "responses",
        word: EventKind::Response,
        value: "amplitude_us",
        duration: "rise_secs",
    }],
    table: Tabled {
        help: "Skin conductance [µS]",
        columns: &["eda", "gsr", "scl", "skin"],
        files: &["eda", "gsr"],
        channels: Some(1),
        least_hz: 0.9,
    },
    causal: |chosen, rate_hz| eda::analysis::causal(&skin(chosen), rate_hz),
    whole: |chosen, recording| eda::analysis::whole(&skin(chosen), recording),
};

pub(super) const EMG: Analysis = Analysis {
    signal: Signal::Emg,
    feature: Some(Documented {
        name: "muscle",
        doc: "Amplitude, frequencies and bursts of each channel of an EMG, and its quality.",
        summary: "Activity of muscles, from an EMG of any number of channels.",
        measures: "each burst (as an event), and for each channel and window its amplitude, frequencies, \
            bursts and quality.",
        windows: "",
        reference: "Phinyomark et al. (2012), doi:10.1016/j.eswa.2012.01.102.",
        limits: "in the unit of the input; not as a share of a maximum, which is not measured.",
    }),
    events: &[Happening {
        kind: "burst",
        leaf: "bursts",
        word: EventKind::Burst,
        value: "peak_envelope",
        duration: "duration_secs",
    }],
    table: Tabled {
        help: "Electromyogram, one column per channel",
        columns: &["emg"],
        files: &["emg"],
        channels: None,
        least_hz: 50.0,
    },
    causal: |chosen, rate_hz| emg::analysis::causal(&muscles(chosen), rate_hz),
    whole: |chosen, recording| emg::analysis::whole(&muscles(chosen), recording),
};

pub(super) const EEG: Analysis = Analysis {
    signal: Signal::Eeg,
    feature: Some(Documented {
        name: "brain",
        doc: "Bands, indices, blinks and quality of an EEG.",
        summary: "Bands, indices and blinks of an EEG of any number of channels.",
        measures: "each blink (as an event), and for each channel and window the powers of the bands, the \
            indices of engagement, workload and asymmetry if the channels for them exist, and the quality.",
        windows: "",
        reference: "Pope et al. (1995), doi:10.1016/0301-0511(95)05116-3.",
        limits: "indices are validated on groups under controlled conditions; for a single person they are \
            estimates.",
    }),
    events: &[Happening {
        kind: "blink",
        leaf: "blinks",
        word: EventKind::Blink,
        value: "amplitude_uv",
        duration: "duration_secs",
    }],
    table: Tabled {
        help: "Electroencephalogram [µV], one column per channel",
        columns: &["eeg", "exg", "raw_"],
        files: &["eeg"],
        channels: None,
        least_hz: 50.0,
    },
    causal: |chosen, rate_hz| eeg::analysis::causal(&scalp(chosen), rate_hz),
    whole: |chosen, recording| eeg::analysis::whole(&scalp(chosen), recording),
};

pub(super) const RESPIRATION: Analysis = Analysis {
    signal: Signal::Respiration,
    feature: Some(Documented {
        name: "breath",
        doc: "Rate, depth and variability of breathing, and the quality of the signal.",
        summary: "Breathing, from a belt.",
        measures: "each breath (as an event with its length), and for each window the rate, the depth, the \
            times of inhalation and exhalation, their variability, and the quality.",
        windows: "",
        reference: "Khodadad et al. (2018), doi:10.1088/1361-6579/aad7e6.",
        limits: "a breath is reported when the next one begins; depth is in the unit of the belt.",
    }),
    events: &[Happening {
        kind: "breath",
        leaf: "breaths",
        word: EventKind::Breath,
        value: "amplitude",
        duration: "duration_secs",
    }],
    table: Tabled {
        help: "Breathing, from a belt",
        columns: &["resp", "rsp", "breath"],
        files: &["rsp", "resp", "respiration", "breath"],
        channels: Some(1),
        least_hz: 2.0,
    },
    causal: |chosen, rate_hz| respiration::analysis::causal(&breath(chosen), rate_hz),
    whole: |chosen, recording| respiration::analysis::whole(&breath(chosen), recording),
};

pub(super) const TEMPERATURE: Analysis = Analysis {
    signal: Signal::Temperature,
    feature: Some(Documented {
        name: "skin_temperature",
        doc: "Temperature of the skin, its slope, and whether the sensor is on it.",
        summary: "Temperature of the skin, and whether the sensor is on it.",
        measures: "for each window mean, spread, extremes and slope of the readings on skin.",
        windows: "",
        reference: "none; the plausible limits for skin are in the `method`.",
        limits: "a thermometer that hangs in warm air looks like skin.",
    }),
    events: &[],
    table: Tabled {
        help: "Skin temperature [°C]",
        columns: &["temp"],
        files: &["temp", "temperature"],
        channels: Some(1),
        least_hz: 0.0,
    },
    causal: |_, rate_hz| {
        temperature::analysis::causal(&temperature::analysis::Settings::default(), rate_hz)
    },
    whole: |_, recording| {
        temperature::analysis::whole(&temperature::analysis::Settings::default(), recording)
    },
};

pub(super) const ACCELERATION: Analysis = Analysis {
    signal: Signal::Acceleration,
    feature: Some(Documented {
        name: "movement",
        doc: "Movement, posture and motion that spoils signals.",
        summary: "Movement and posture, from three axes of acceleration.",
        measures: "for each window the magnitude of acceleration, ENMO, activity, tilt, and how much of it \
            was motion enough to spoil signals beside it.",
        windows: "",
        reference: "van Hees et al. (2013), doi:10.1371/journal.pone.0061691.",
        limits: "in g; a stream in m/s², mg or 1/64 g is converted by its unit.",
    }),
    events: &[],
    table: Tabled {
        help: "Acceleration [g], three columns",
        columns: &["acc"],
        files: &["acc", "accelerometer", "acceleration"],
        channels: Some(3),
        least_hz: 5.0,
    },
    causal: |_, rate_hz| {
        acceleration::analysis::causal(&acceleration::analysis::Settings::default(), rate_hz)
    },
    whole: |_, recording| {
        acceleration::analysis::whole(&acceleration::analysis::Settings::default(), recording)
    },
};

fn skin(chosen: &Chosen) -> eda::analysis::Settings {
    eda::analysis::Settings { phasic: chosen.phasic, ..Default::default() }
}

fn muscles(chosen: &Chosen) -> emg::analysis::Settings {
    let channel = |name: &String| emg::analysis::Channel { name: name.clone(), mvc: None };
    let channels = chosen.channels.iter().map(channel).collect();
    emg::analysis::Settings { channels, unit: chosen.unit.clone(), ..Default::default() }
}

fn scalp(chosen: &Chosen) -> eeg::analysis::Settings {
    eeg::analysis::Settings { channels: chosen.channels.clone(), ..Default::default() }
}

fn breath(chosen: &Chosen) -> respiration::analysis::Settings {
    respiration::analysis::Settings { unit: chosen.unit.clone(), ..Default::default() }
}
