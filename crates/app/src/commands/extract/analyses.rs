//! The analysis of each signal.

use clap::ValueEnum;
use teampulse_core::{stream, units};
use teampulse_signal::analysis::{Causal, Recording, Whole};
use teampulse_signal::error::SignalError;
use teampulse_signal::{
    acceleration, descriptive, ecg, eda, eeg, emg, hrv, ppg, respiration, temperature,
};

use super::table::{Decimal, Wanted};
use crate::exit::Exit;
use crate::failure::Failure;

/// How far the sum of intervals may be from the times of their beats [s]: rounding errors add up, and no
/// interval is as short.
const BEATS_ASTRAY_SECS: f64 = 0.1;

/// The measured signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Signal {
    /// Electrocardiogram, in any unit
    Ecg,
    /// Photoplethysmogram (blood volume pulse), in any unit
    Ppg,
    /// Skin conductance [µS]
    Eda,
    /// Electromyogram, one column a channel
    Emg,
    /// Electroencephalogram [µV], one column a channel
    Eeg,
    /// Breathing, from a belt
    Respiration,
    /// Skin temperature [°C]
    Temperature,
    /// Acceleration [g], three columns
    Acceleration,
    /// Intervals between heart beats [ms], one a line
    Interval,
    /// Any other numbers
    Other,
}

/// How skin conductance is split into tonic and phasic components.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Phasic {
    /// High-pass filter: what changes faster than 0.05 Hz
    HighPass,
    /// Convex optimisation (cvxEDA)
    Cvxeda,
}

/// How artefacts among intervals are treated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Artefacts {
    /// Artefacts stay, and are only counted
    Kept,
    /// Artefacts are corrected (Lipponen and Tarvainen)
    Corrected,
}

/// The user's choices for the analyses.
#[derive(Clone, Debug)]
pub struct Settings {
    /// How skin conductance is split.
    pub phasic: Phasic,
    /// How artefacts among intervals are treated.
    pub artefacts: Artefacts,
    /// The mains frequency [Hz]; `None` to detect it.
    pub mains_hz: Option<f64>,
    /// The unit of the samples; `1` when unknown.
    pub unit: String,
    /// Whether intervals come with the times of the beats that end them.
    pub are_of_beats: bool,
}

impl Signal {
    /// The word for it in a stream's description.
    pub fn word(self) -> &'static str {
        match self {
            Signal::Ecg => "ecg",
            Signal::Ppg => "ppg",
            Signal::Eda => "eda",
            Signal::Emg => "emg",
            Signal::Eeg => "eeg",
            Signal::Respiration => "respiration",
            Signal::Temperature => "temperature",
            Signal::Acceleration => "acceleration",
            Signal::Interval => "interval",
            Signal::Other => "other",
        }
    }

    /// Words that occur in the names of its columns.
    pub fn column_words(self) -> &'static [&'static str] {
        match self {
            Signal::Ecg => &["ecg", "ekg"],
            Signal::Ppg => &["ppg", "bvp", "pleth", "pulse", "channel 0"],
            Signal::Eda => &["eda", "gsr", "scl", "skin"],
            Signal::Emg => &["emg"],
            Signal::Eeg => &["eeg", "exg", "raw_"],
            Signal::Respiration => &["resp", "rsp", "breath"],
            Signal::Temperature => &["temp"],
            Signal::Acceleration => &["acc"],
            Signal::Interval => &["rr", "rri", "ibi", "interval", "nn", "pp", "ppi"],
            Signal::Other => &[],
        }
    }

    /// Whether all columns of a table are its channels.
    pub fn takes_all_columns(self) -> bool {
        matches!(self, Signal::Emg | Signal::Eeg | Signal::Acceleration | Signal::Other)
    }

    /// How many channels it has; `None` for any number.
    pub fn channels(self) -> Option<usize> {
        match self {
            Signal::Emg | Signal::Eeg | Signal::Other => None,
            Signal::Acceleration => Some(3),
            _ => Some(1),
        }
    }

    /// The columns that it needs from a table.
    pub fn wanted(
        self,
        columns: Vec<String>,
        time: Option<String>,
        decimal: Option<Decimal>,
    ) -> Wanted {
        Wanted {
            signal: self.word(),
            words: self.column_words(),
            takes_all: self.takes_all_columns(),
            channels: self.channels(),
            unit: self.unit(),
            is_even: self.is_even(),
            least_hz: self.least_hz(),
            columns,
            time,
            decimal,
        }
    }

    /// The unit in which it is analysed; `None` if any will do.
    pub fn unit(self) -> Option<&'static str> {
        units::worked_in(self.kind())
    }

    /// The corresponding signal of streams.
    pub fn kind(self) -> stream::Signal {
        match self {
            Signal::Ecg => stream::Signal::Ecg,
            Signal::Ppg => stream::Signal::Ppg,
            Signal::Eda => stream::Signal::Eda,
            Signal::Emg => stream::Signal::Emg,
            Signal::Eeg => stream::Signal::Eeg,
            Signal::Respiration => stream::Signal::Respiration,
            Signal::Temperature => stream::Signal::Temperature,
            Signal::Acceleration => stream::Signal::Acceleration,
            Signal::Interval => stream::Signal::Interval,
            Signal::Other => stream::Signal::Other,
        }
    }

    /// The lowest plausible sampling rate of the signal [Hz]: where times have no unit, a unit that gives a
    /// lower rate is rejected.
    pub fn least_hz(self) -> f64 {
        match self {
            Signal::Ecg | Signal::Emg | Signal::Eeg => 50.0,
            Signal::Ppg => 10.0,
            Signal::Acceleration => 5.0,
            Signal::Respiration => 2.0,
            Signal::Eda => 0.9,
            Signal::Interval => 0.2,
            Signal::Temperature | Signal::Other => 0.0,
        }
    }

    /// Whether its samples come at an even rate.
    pub fn is_even(self) -> bool {
        self != Signal::Interval
    }

    /// The events that are scored against true ones.
    pub fn main_event(self) -> Option<&'static str> {
        match self {
            Signal::Ecg | Signal::Interval => Some("beat"),
            Signal::Ppg => Some("pulse"),
            Signal::Eda => Some("response"),
            Signal::Emg => Some("burst"),
            Signal::Eeg => Some("blink"),
            Signal::Respiration => Some("breath"),
            Signal::Temperature | Signal::Acceleration | Signal::Other => None,
        }
    }
}

impl Settings {
    /// A causal analysis, sample by sample.
    pub fn causal(
        &self,
        signal: Signal,
        channels: &[String],
        rate_hz: f64,
    ) -> Result<Box<dyn Causal + Send>, SignalError> {
        match signal {
            Signal::Ecg => ecg::analysis::causal(&self.heart(), rate_hz),
            Signal::Ppg => ppg::analysis::causal(&self.pulse(), rate_hz),
            Signal::Eda => eda::analysis::causal(&self.skin(), rate_hz),
            Signal::Emg => emg::analysis::causal(&self.muscles(channels), rate_hz),
            Signal::Eeg => eeg::analysis::causal(&scalp(channels), rate_hz),
            Signal::Respiration => respiration::analysis::causal(&self.breath(), rate_hz),
            Signal::Temperature => {
                temperature::analysis::causal(&temperature::analysis::Settings::default(), rate_hz)
            }
            Signal::Acceleration => acceleration::analysis::causal(
                &acceleration::analysis::Settings::default(),
                rate_hz,
            ),
            Signal::Interval => hrv::analysis::causal(&self.intervals(), rate_hz),
            Signal::Other => descriptive::analysis::causal(&self.any(channels), rate_hz),
        }
    }

    /// The analysis of a whole recording.
    pub fn whole(
        &self,
        signal: Signal,
        channels: &[String],
        recording: &Recording<'_>,
    ) -> Result<Whole, SignalError> {
        match signal {
            Signal::Ecg => ecg::analysis::whole(&self.heart(), recording),
            Signal::Ppg => ppg::analysis::whole(&self.pulse(), recording),
            Signal::Eda => eda::analysis::whole(&self.skin(), recording),
            Signal::Emg => emg::analysis::whole(&self.muscles(channels), recording),
            Signal::Eeg => eeg::analysis::whole(&scalp(channels), recording),
            Signal::Respiration => respiration::analysis::whole(&self.breath(), recording),
            Signal::Temperature => {
                temperature::analysis::whole(&temperature::analysis::Settings::default(), recording)
            }
            Signal::Acceleration => {
                let settings = acceleration::analysis::Settings::default();
                acceleration::analysis::whole(&settings, recording)
            }
            Signal::Interval => hrv::analysis::whole(&self.intervals(), recording),
            Signal::Other => descriptive::analysis::whole(&self.any(channels), recording),
        }
    }

    fn heart(&self) -> ecg::analysis::Settings {
        ecg::analysis::Settings { mains_hz: self.mains_hz, ..ecg::analysis::Settings::default() }
    }

    fn pulse(&self) -> ppg::analysis::Settings {
        let unit = self.unit.clone().into();
        ppg::analysis::Settings { unit, ..ppg::analysis::Settings::default() }
    }

    fn skin(&self) -> eda::analysis::Settings {
        let phasic = match self.phasic {
            Phasic::HighPass => eda::analysis::Phasic::HighPass,
            Phasic::Cvxeda => eda::analysis::Phasic::CvxEda,
        };
        eda::analysis::Settings { phasic, ..eda::analysis::Settings::default() }
    }

    fn breath(&self) -> respiration::analysis::Settings {
        let unit = self.unit.clone();
        respiration::analysis::Settings { unit, ..respiration::analysis::Settings::default() }
    }

    fn muscles(&self, channels: &[String]) -> emg::analysis::Settings {
        let channel = |name| emg::analysis::Channel { name, mvc: None };
        let channels = named(channels).into_iter().map(channel).collect();
        let unit = self.unit.clone();
        emg::analysis::Settings { channels, unit, ..emg::analysis::Settings::default() }
    }

    fn intervals(&self) -> hrv::analysis::Settings {
        let treatment = match self.artefacts {
            Artefacts::Kept => hrv::Treatment::AsTheyAre,
            Artefacts::Corrected => hrv::Treatment::Corrected,
        };
        let strap = hrv::analysis::Settings::default();
        let most_astray_secs =
            if self.are_of_beats { BEATS_ASTRAY_SECS } else { strap.most_astray_secs };
        hrv::analysis::Settings { treatment, most_astray_secs, ..strap }
    }

    fn any(&self, channels: &[String]) -> descriptive::analysis::Settings {
        let channel = |name| descriptive::analysis::Channel { name, unit: self.unit.clone() };
        descriptive::analysis::Settings {
            channels: named(channels).into_iter().map(channel).collect(),
        }
    }
}

/// Electrode positions, from the names of columns.
fn scalp(channels: &[String]) -> eeg::analysis::Settings {
    eeg::analysis::Settings { channels: named(channels), ..eeg::analysis::Settings::default() }
}

/// Names of channels; a single column without a name has none.
fn named(channels: &[String]) -> Vec<String> {
    match channels {
        [name] if name.starts_with("ch") => vec![String::new()],
        named => named.to_vec(),
    }
}

/// Why a signal can't be analysed, for the user.
pub fn failure(signal: Signal, error: SignalError) -> Failure {
    let (exit, hint) = match error {
        SignalError::Rate { .. } | SignalError::Setting { .. } | SignalError::Frequency { .. } => (
            Exit::BadArguments,
            "check --rate (samples a second), or the unit of --time, as in --time timer:ms",
        ),
        SignalError::TooShort { .. } => (Exit::Failed, "a longer recording is needed"),
        SignalError::NothingFinite => {
            (Exit::Failed, "the column holds no number: choose another with --column")
        }
        _ => (Exit::Failed, ""),
    };
    Failure::new(format!("failed to analyse the signal as {}: {error}", signal.word()))
        .hint(hint)
        .exit(exit)
}
