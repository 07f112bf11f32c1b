//! The table of analyses: how each signal of a person is analysed, live, by `extract` and by `import`.
//!
//! A new signal is an analysis in the crate `signal` and a row in the file of its family.

mod behaviour;
mod body;
mod heart;
mod other;

use teampulse_core::data::EventKind;
use teampulse_core::stream::Signal;
use teampulse_core::units::worked_in;
use teampulse_signal::analysis::{Causal, Recording, Whole};
use teampulse_signal::error::SignalError;
use teampulse_signal::{eda, hrv};

/// The analysis of one signal: a row of the table. The analysis declares its values, with units and recipes.
#[derive(Clone, Copy, Debug)]
pub struct Analysis {
    /// The signal.
    pub signal: Signal,
    /// The feature that runs the analysis on streams of people; `None` if it is for tables only.
    pub feature: Option<Documented>,
    /// The kinds of events that the analysis finds; `extract` scores the first kind.
    pub events: &'static [Happening],
    /// The form of the signal in a table of samples.
    pub table: Tabled,
    /// Starts a sample-by-sample analysis at a rate [Hz].
    pub causal: fn(&Chosen, f64) -> Begun,
    /// Analyses a whole recording.
    pub whole: fn(&Chosen, &Recording<'_>) -> Result<Whole, SignalError>,
}

/// A started analysis, or the reason why it can't start.
pub type Begun = Result<Box<dyn Causal + Send>, SignalError>;

/// The documentation of a feature.
#[derive(Clone, Copy, Debug)]
pub struct Documented {
    /// The feature's name in a study, and the name of its streams below their input.
    pub name: &'static str,
    /// A description of the values of windows, for readers.
    pub doc: &'static str,
    /// A description in one sentence.
    pub summary: &'static str,
    /// The events and values that are reported.
    pub measures: &'static str,
    /// Remarks on the windows.
    pub windows: &'static str,
    /// References.
    pub reference: &'static str,
    /// Limits.
    pub limits: &'static str,
}

/// Events of one kind.
#[derive(Clone, Copy, Debug)]
pub struct Happening {
    /// The name of the events in the analysis.
    pub kind: &'static str,
    /// The name of the events' stream below the input.
    pub leaf: &'static str,
    /// The kind of the events on the wire.
    pub word: EventKind,
    /// The detail that becomes the event's value.
    pub value: &'static str,
    /// The detail that becomes the event's duration [s]; empty for an instant.
    pub duration: &'static str,
}

/// A signal in a table of samples.
#[derive(Clone, Copy, Debug)]
pub struct Tabled {
    /// A description in a few words.
    pub help: &'static str,
    /// Words that occur in the names of the signal's columns.
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

    /// The unit in which the analysis works; `None` if any unit will do.
    pub fn unit(&self) -> Option<&'static str> {
        worked_in(self.signal)
    }

    /// Whether the signal's samples come at an even rate.
    pub fn is_even(&self) -> bool {
        !matches!(
            self.signal,
            Signal::Interval | Signal::Video | Signal::Face | Signal::Body | Signal::Expression
        )
    }

    /// The kind of the events that are scored against true ones.
    pub fn main_event(&self) -> Option<&'static str> {
        self.events.first().map(|event| event.kind)
    }
}

/// The index of a feature's row in the table.
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
    /// The documentation of the feature's settings, in the template of all features.
    pub fn text(&self) -> String {
        let Documented { summary, measures, windows, reference, limits, .. } = self;
        format!(
            "{summary}\n\n\
             - Measures: {measures}\n\
             - Formula: that of each value is in the stream's `method`.\n\
             - Unit: as declared for each value.\n\
             - Window: `windows_secs`, each second of the stream's own time{windows}; and each phase when it is \
               over.\n\
             - Reference: {reference}\n\
             - Limits: {limits}"
        )
    }
}

/// Every analysis. If a column of a table fits several, the first applies.
pub const ANALYSES: &[Analysis] = &[
    heart::ECG,
    heart::PPG,
    body::EDA,
    body::EMG,
    body::EEG,
    body::RESPIRATION,
    body::TEMPERATURE,
    body::ACCELERATION,
    behaviour::ACTIVITY,
    heart::INTERVAL,
    behaviour::VIDEO,
    behaviour::FACE,
    behaviour::BODY,
    behaviour::EXPRESSION,
    behaviour::AUDIO,
    other::OTHER,
];
