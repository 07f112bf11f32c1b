//! The table of analyses: how each signal of a person is analysed, live, by `extract` and by `import`.
//!
//! A new signal is an analysis in the crate `signal` and a row here.

use teampulse_core::data::EventKind;
use teampulse_core::stream::Signal;
use teampulse_core::units::worked_in;
use teampulse_signal::analysis::{Causal, Recording, Whole};
use teampulse_signal::error::SignalError;
use teampulse_signal::{
    acceleration, activity, descriptive, ecg, eda, eeg, emg, hrv, ppg, respiration, temperature,
    view, voice,
};

/// The analysis of one signal: a row of the table. Its values, with units and recipes, are those that the
/// analysis declares.
#[derive(Clone, Copy, Debug)]
pub struct Analysis {
    /// The signal.
    pub signal: Signal,
    /// The feature that runs it on streams of people; `None` where it is for tables only.
    pub feature: Option<Documented>,
    /// The events that it finds; the first are those that `extract` scores.
    pub events: &'static [Happening],
    /// Its form in a table of samples.
    pub table: Tabled,
    /// Starts the analysis, sample by sample, at a rate [Hz].
    pub causal: fn(&Chosen, f64) -> Begun,
    /// Analyses a whole recording.
    pub whole: fn(&Chosen, &Recording<'_>) -> Result<Whole, SignalError>,
}

/// A started analysis, or the reason why it can't start.
pub type Begun = Result<Box<dyn Causal + Send>, SignalError>;

/// The documentation of a feature.
#[derive(Clone, Copy, Debug)]
pub struct Documented {
    /// Its name in a study, and of its streams below their input.
    pub name: &'static str,
    /// A description of the values of windows, for people.
    pub doc: &'static str,
    /// A description in one sentence.
    pub summary: &'static str,
    /// The events and values that are reported.
    pub measures: &'static str,
    /// Remarks on its windows.
    pub windows: &'static str,
    /// References.
    pub reference: &'static str,
    /// Limits.
    pub limits: &'static str,
}

/// Events of one kind.
#[derive(Clone, Copy, Debug)]
pub struct Happening {
    /// Their name in the analysis.
    pub kind: &'static str,
    /// The name of their stream below the input.
    pub leaf: &'static str,
    /// Their kind on the wire.
    pub word: EventKind,
    /// The detail that becomes the event's value.
    pub value: &'static str,
    /// The detail that becomes its duration [s]; `None` for a moment.
    pub duration: &'static str,
}

/// A signal in a table of samples.
#[derive(Clone, Copy, Debug)]
pub struct Tabled {
    /// A description in a few words.
    pub help: &'static str,
    /// Words that occur in the names of its columns.
    pub columns: &'static [&'static str],
    /// Words in the names of files with this signal, as devices name them.
    pub files: &'static [&'static str],
    /// The number of channels; `None` for any number.
    pub channels: Option<usize>,
    /// The lowest plausible sampling rate [Hz]: where times have no unit, a unit that gives a lower rate is
    /// rejected.
    pub least_hz: f64,
}

/// The properties of a signal and the options of its analysis; by default those of a live analysis.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// The names of the channels.
    pub channels: Vec<String>,
    /// The unit of the samples; `1` when unknown.
    pub unit: String,
    /// The mains frequency [Hz]; `None` to detect it.
    pub mains_hz: Option<f64>,
    /// How skin conductance is split in a whole recording.
    pub phasic: eda::analysis::Phasic,
    /// How artefacts among intervals are treated.
    pub artefacts: hrv::Treatment,
    /// How far the sum of intervals may be from the times of their beats [s].
    pub most_astray_secs: f64,
}

impl Default for Chosen {
    fn default() -> Chosen {
        let intervals = hrv::analysis::Settings::default();
        Chosen {
            channels: Vec::new(),
            unit: "1".to_owned(),
            mains_hz: None,
            phasic: eda::analysis::Settings::default().phasic,
            artefacts: intervals.treatment,
            most_astray_secs: intervals.most_astray_secs,
        }
    }
}

impl Analysis {
    /// The analysis of a signal.
    pub fn of(signal: Signal) -> Option<&'static Analysis> {
        ANALYSES.iter().find(|analysis| analysis.signal == signal)
    }

    /// The word for the signal, in descriptions of streams and on the command line.
    pub fn word(&self) -> &'static str {
        self.signal.word()
    }

    /// The unit in which it works; `None` if any will do.
    pub fn unit(&self) -> Option<&'static str> {
        worked_in(self.signal)
    }

    /// Whether the signal's samples come at an even rate.
    pub fn is_even(&self) -> bool {
        !matches!(self.signal, Signal::Interval | Signal::Video)
    }

    /// The kind of the events that are scored against true ones.
    pub fn main_event(&self) -> Option<&'static str> {
        self.events.first().map(|event| event.kind)
    }
}

/// The index of the row of a feature.
pub(crate) const fn row(name: &str) -> usize {
    let mut place = 0;
    while place < ANALYSES.len() {
        if let Some(feature) = ANALYSES[place].feature
            && is_same(feature.name.as_bytes(), name.as_bytes())
        {
            return place;
        }
        place += 1;
    }
    panic!("no analysis is this feature");
}

const fn is_same(one: &[u8], other: &[u8]) -> bool {
    let mut place = 0;
    while place < one.len() && place < other.len() && one[place] == other[place] {
        place += 1;
    }
    place == one.len() && place == other.len()
}

impl Documented {
    /// The documentation of the feature's settings, by the template of all features.
    pub fn text(&self) -> String {
        let Documented { summary, measures, windows, reference, limits, .. } = self;
        format!(
            "{summary}\n\n\
             - Measures: {measures}\n\
             - Formula: that of each value stands in the stream's `method`.\n\
             - Unit: as declared for each value.\n\
             - Window: `windows_secs`, each second of the stream's own time{windows}; and each phase when it is \
               over.\n\
             - Reference: {reference}\n\
             - Limits: {limits}"
        )
    }
}

/// The remark on the windows of analyses of beats.
const SLOW: &str = ", nonlinear and geometric values anew every 10 s";
const OF_VARIABILITY: &str = "Task Force (1996), doi:10.1161/01.CIR.93.5.1043; Lipponen & Tarvainen (2019), \
     doi:10.1080/03091902.2019.1640306.";

/// Every analysis.
pub const ANALYSES: &[Analysis] = &[
    Analysis {
        signal: Signal::Ecg,
        feature: Some(Documented {
            name: "heart",
            doc: "Heart rate, its variability, and the quality of the ECG.",
            summary: "Heart beats, their rate and its variability, from an ECG.",
            measures: "each beat (as an event with its interval [ms]), and of each window the heart rate, the \
                variability of corrected intervals in time, frequency and geometry, breathing as it shows in \
                the heart, and the quality of the ECG.",
            windows: SLOW,
            reference: OF_VARIABILITY,
            limits: "a beat is known a quarter of a second after it; LF needs 120 s, HF 60 s.",
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
    },
    Analysis {
        signal: Signal::Ppg,
        feature: Some(Documented {
            name: "pulse",
            doc: "Pulse rate, its variability, the shape of pulse waves, and the quality of the PPG.",
            summary: "Pulse waves, their rate, shape and variability, from a PPG.",
            measures: "each pulse (as an event with its interval [ms]), and of each window the pulse rate, its \
                variability, amplitude, rise time and width of the waves, and the quality of the PPG.",
            windows: SLOW,
            reference: "Elgendi et al. (2013), doi:10.1371/journal.pone.0076585.",
            limits: "a pulse is known about half a second after it; motion lowers the quality of windows.",
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
    },
    Analysis {
        signal: Signal::Eda,
        feature: Some(Documented {
            name: "skin",
            doc: "Level and responses of the skin's conductance, and its quality.",
            summary: "Level and responses of the skin's conductance.",
            measures: "each response (as an event with its amplitude [µS]), and of each window the level, its \
                slope, how many responses there were and how large, and the quality.",
            windows: "",
            reference: "Boucsein et al. (2012), doi:10.1111/j.1469-8986.2012.01384.x.",
            limits: "a response is known 1.1 s after its peak; split causally, while `extract` offers cvxEDA.",
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
    },
    Analysis {
        signal: Signal::Emg,
        feature: Some(Documented {
            name: "muscle",
            doc: "Loudness, frequencies and bursts of each channel of an EMG, and its quality.",
            summary: "Activity of muscles, from an EMG of any number of channels.",
            measures: "each burst (as an event), and of each channel and window its loudness, frequencies, \
                bursts and quality.",
            windows: "",
            reference: "Phinyomark et al. (2012), doi:10.1016/j.eswa.2012.01.102.",
            limits: "in the unit of the input; no share of a maximum, which nobody measured.",
        }),
        events: &[Happening {
            kind: "burst",
            leaf: "bursts",
            word: EventKind::Burst,
            value: "peak_envelope",
            duration: "duration_secs",
        }],
        table: Tabled {
            help: "Electromyogram, one column a channel",
            columns: &["emg"],
            files: &["emg"],
            channels: None,
            least_hz: 50.0,
        },
        causal: |chosen, rate_hz| emg::analysis::causal(&muscles(chosen), rate_hz),
        whole: |chosen, recording| emg::analysis::whole(&muscles(chosen), recording),
    },
    Analysis {
        signal: Signal::Eeg,
        feature: Some(Documented {
            name: "brain",
            doc: "Bands, indices, blinks and quality of an EEG.",
            summary: "Bands, indices and blinks of an EEG of any number of channels.",
            measures: "each blink (as an event), and of each channel and window the powers of the bands, the \
                indices of engagement, workload and asymmetry where the channels for them are there, and the \
                quality.",
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
            help: "Electroencephalogram [µV], one column a channel",
            columns: &["eeg", "exg", "raw_"],
            files: &["eeg"],
            channels: None,
            least_hz: 50.0,
        },
        causal: |chosen, rate_hz| eeg::analysis::causal(&scalp(chosen), rate_hz),
        whole: |chosen, recording| eeg::analysis::whole(&scalp(chosen), recording),
    },
    Analysis {
        signal: Signal::Respiration,
        feature: Some(Documented {
            name: "breath",
            doc: "Rate, depth and variability of breathing, and the quality of the signal.",
            summary: "Breathing, from a belt.",
            measures: "each breath (as an event with its length), and of each window the rate, the depth, the \
                times of inhalation and exhalation, their variability, and the quality.",
            windows: "",
            reference: "Khodadad et al. (2018), doi:10.1088/1361-6579/aad7e6.",
            limits: "a breath is known when the next one begins; depth is in the unit of the belt.",
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
    },
    Analysis {
        signal: Signal::Temperature,
        feature: Some(Documented {
            name: "skin_temperature",
            doc: "Temperature of the skin, its slope, and whether the sensor is on it.",
            summary: "Temperature of the skin, and whether the sensor is on it.",
            measures: "of each window mean, spread, extremes and slope of the readings on skin.",
            windows: "",
            reference: "none; the limits of what skin can be stand in the `method`.",
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
    },
    Analysis {
        signal: Signal::Acceleration,
        feature: Some(Documented {
            name: "movement",
            doc: "Movement, posture and motion that spoils signals.",
            summary: "Movement and posture, from three axes of acceleration.",
            measures: "of each window the magnitude of acceleration, ENMO, activity, tilt, and how much of it \
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
    },
    Analysis {
        signal: Signal::Activity,
        feature: Some(Documented {
            name: "dynamics",
            doc: "How somebody types, points and steers, and how long they do nothing of it.",
            summary: "Typing, mouse and gamepad dynamics, from summaries of seconds that hold no key.",
            measures: "of each window: of a keyboard the rate of presses, mean and spread of holds and of intervals between \
                presses, the share of corrections; of a mouse its speed and path, clicks and wheel; of a gamepad presses \
                and deflection; of each the share of time that is idle.",
            windows: "",
            reference: "Epp, Lippold & Mandryk (2011), doi:10.1145/1978942.1979046.",
            limits: "holds and intervals are known in groups of five, up to 10 s after they were; nothing is known of \
                what is typed, so that games and texts look alike.",
        }),
        events: &[],
        table: Tabled {
            help: "Summaries of what was done at a keyboard, mouse or gamepad, with its channels as columns",
            columns: &["presses", "path"],
            files: &["activity"],
            channels: None,
            least_hz: 0.0,
        },
        causal: |chosen, rate_hz| activity::analysis::causal(&names(chosen), rate_hz),
        whole: |chosen, recording| activity::analysis::whole(&names(chosen), recording),
    },
    Analysis {
        signal: Signal::Interval,
        feature: Some(Documented {
            name: "intervals",
            doc: "Heart rate variability of intervals.",
            summary: "Variability of heart beat intervals that a strap reports.",
            measures: "each beat (as an event with its interval [ms]), and of each window the variability of \
                corrected intervals in time, frequency and geometry.",
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
            help: "Intervals between heart beats [ms], one a line",
            columns: &["rr", "rri", "ibi", "interval", "nn", "pp", "ppi"],
            files: &["ibi", "rr", "rri", "ppi"],
            channels: Some(1),
            least_hz: 0.2,
        },
        causal: |chosen, rate_hz| hrv::analysis::causal(&intervals(chosen), rate_hz),
        whole: |chosen, recording| hrv::analysis::whole(&intervals(chosen), recording),
    },
    Analysis {
        signal: Signal::Video,
        feature: Some(Documented {
            name: "view",
            doc: "The pulse in the colour of the skin, as a camera sees it, presence and movement.",
            summary: "What a camera sees of a person, from numbers of its frames (the worker `frames`): the pulse in the \
                colour of the skin, whether somebody is there, and how much moves.",
            measures: "of each window the pulse rate from the colour of skin with its uncertainty and its ratio of signal \
                to noise, the share of time with somebody in view, the share of the view that moves, and the quality of \
                the pulse.",
            windows: "",
            reference: "Wang et al. (2017), doi:10.1109/TBME.2016.2609282.",
            limits: "a pulse needs 15 s of a face that keeps its place, at 12 frames a second or more, and steady light; \
                measured on synthetic faces only. Presence is of somebody with bare skin who moves once in 20 s.",
        }),
        events: &[],
        table: Tabled {
            help: "Numbers of the frames of a camera, as the worker `frames` offers them",
            columns: &view::CHANNELS,
            files: &["frames"],
            channels: None,
            least_hz: 1.0,
        },
        causal: |chosen, _| Ok(view::analysis::causal(&chosen.channels)),
        whole: |chosen, recording| Ok(view::analysis::whole(&chosen.channels, recording)),
    },
    Analysis {
        signal: Signal::Audio,
        feature: Some(Documented {
            name: "voice",
            doc: "Level, activity, pitch, rate, pauses, jitter, shimmer and tilt of a voice, and its quality.",
            summary: "The voice of a person, from a microphone: how they speak, not what they say.",
            measures: "of each window the level of speech and of the noise beneath, the share of time in speech, pitch \
                and its spread, speaking and articulation rates, pauses, jitter, shimmer, the tilt of the spectrum, \
                and the quality.",
            windows: "",
            reference: "Boersma (1993), Proc. IFA 17:97; de Jong & Wempe (2009), doi:10.3758/BRM.41.2.385.",
            limits: "samples at 8 to 96 kHz, of which 1 is full scale; one person a microphone: of two voices the \
                louder one has the pitch; a loud steady hum looks like a voice.",
        }),
        events: &[],
        table: Tabled {
            help: "Sound of a microphone (1 is full scale)",
            columns: &["audio", "mic", "sound", "voice"],
            files: &["audio", "microphone"],
            channels: Some(1),
            least_hz: 8_000.0,
        },
        causal: |chosen, rate_hz| {
            if are_frames(chosen) {
                return Ok(voice::analysis::of_frames());
            }
            voice::analysis::causal(&voice::Settings::default(), rate_hz)
        },
        whole: |chosen, recording| {
            if are_frames(chosen) {
                return Ok(voice::analysis::whole_of_frames(recording));
            }
            voice::analysis::whole(&voice::Settings::default(), recording)
        },
    },
    Analysis {
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
    },
];

fn heart(chosen: &Chosen) -> ecg::analysis::Settings {
    ecg::analysis::Settings { mains_hz: chosen.mains_hz, ..Default::default() }
}

fn pulse(chosen: &Chosen) -> ppg::analysis::Settings {
    ppg::analysis::Settings { unit: chosen.unit.clone().into(), ..Default::default() }
}

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

fn intervals(chosen: &Chosen) -> hrv::analysis::Settings {
    hrv::analysis::Settings {
        treatment: chosen.artefacts,
        most_astray_secs: chosen.most_astray_secs,
        ..Default::default()
    }
}

/// The names of the channels.
fn names(chosen: &Chosen) -> Vec<&str> {
    chosen.channels.iter().map(String::as_str).collect()
}

/// Whether a stream has the [frames](voice::Frame) of a sound, made where it was heard, in place of its samples.
fn are_frames(chosen: &Chosen) -> bool {
    chosen.channels.iter().map(String::as_str).eq(voice::CHANNELS.map(|(name, _)| name))
}

fn any(chosen: &Chosen) -> descriptive::analysis::Settings {
    let channel = |name: &String| descriptive::analysis::Channel {
        name: name.clone(),
        unit: chosen.unit.clone(),
    };
    descriptive::analysis::Settings { channels: chosen.channels.iter().map(channel).collect() }
}
