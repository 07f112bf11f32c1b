//! The signals that tables can have, and the options for analysing them.

use clap::ValueEnum;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use teampulse_features::analyses::{ANALYSES, Analysis};
use teampulse_signal::error::SignalError;
use teampulse_signal::{eda, hrv};

use super::table::{Decimal, Wanted};
use crate::exit::Exit;
use crate::failure::Failure;

/// The largest allowed difference between the sum of intervals and the times of their beats [s]: rounding errors add
/// up, and no interval is this short.
pub const BEATS_ASTRAY_SECS: f64 = 0.1;

/// How skin conductance is split into tonic and phasic components.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Phasic {
    /// High-pass filter: the phasic component is what changes faster than 0.05 Hz
    HighPass,
    /// Convex optimisation (cvxEDA)
    Cvxeda,
}

/// How artefacts among intervals are treated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Artefacts {
    /// Artefacts stay and are only counted
    Kept,
    /// Artefacts are corrected (Lipponen and Tarvainen)
    Corrected,
}

impl From<Phasic> for eda::analysis::Phasic {
    fn from(phasic: Phasic) -> eda::analysis::Phasic {
        match phasic {
            Phasic::HighPass => eda::analysis::Phasic::HighPass,
            Phasic::Cvxeda => eda::analysis::Phasic::CvxEda,
        }
    }
}

impl From<Artefacts> for hrv::Treatment {
    fn from(artefacts: Artefacts) -> hrv::Treatment {
        match artefacts {
            Artefacts::Kept => hrv::Treatment::AsTheyAre,
            Artefacts::Corrected => hrv::Treatment::Corrected,
        }
    }
}

/// Parses the name of a signal, as listed in the table of analyses.
pub fn signal() -> impl TypedValueParser<Value = &'static Analysis> {
    let value = |each: &Analysis| PossibleValue::new(each.word()).help(each.table.help);
    let words = PossibleValuesParser::new(ANALYSES.iter().map(value));
    words.try_map(|word| ANALYSES.iter().find(|each| each.word() == word).ok_or("unknown signal"))
}

/// Returns what an analysis needs from a table.
pub fn wanted(
    analysis: &Analysis,
    columns: Vec<String>,
    time: Option<String>,
    decimal: Option<Decimal>,
) -> Wanted {
    Wanted {
        signal: analysis.word(),
        words: analysis.table.columns,
        takes_all: analysis.table.channels != Some(1),
        channels: analysis.table.channels,
        unit: analysis.unit(),
        is_even: analysis.is_even(),
        least_hz: analysis.table.least_hz,
        columns,
        time,
        decimal,
    }
}

/// Returns the names of the channels; the name of a single unnamed column is empty.
pub fn named(channels: &[String]) -> Vec<String> {
    match channels {
        [name] if name.starts_with("ch") => vec![String::new()],
        named => named.to_vec(),
    }
}

/// Explains to the user why a signal can't be analysed.
pub fn failure(analysis: &Analysis, error: SignalError) -> Failure {
    let (exit, hint) = match error {
        SignalError::Rate { .. } | SignalError::Setting { .. } | SignalError::Frequency { .. } => (
            Exit::BadArguments,
            "check --rate (samples per second), or the unit of --time, as in --time timer:ms",
        ),
        SignalError::TooShort { .. } => (Exit::Failed, "a longer recording is needed"),
        SignalError::NothingFinite => {
            (Exit::Failed, "the column holds no numbers: choose another with --column")
        }
        _ => (Exit::Failed, ""),
    };
    Failure::new(format!("failed to analyse the signal as {}: {error}", analysis.word()))
        .hint(hint)
        .exit(exit)
}
