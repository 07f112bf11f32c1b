//! The meaning of each measure, in a sentence.

mod heart;
mod body;
mod team;

use teampulse_signal::analysis::Value;
use teampulse_signal::statistics::Comparison;

/// A measure and its meaning.
type Meaning = (&'static str, &'static str);

/// The tables of teampulse's own measures, by name without the channel.
const TABLES: [&[Meaning]; 4] =
    [heart::SIGNALS, heart::VARIABILITY, body::MEANINGS, team::MEANINGS];

/// Returns the meaning of a measure in a sentence; measures of other programs share a general sentence.
pub(super) fn meaning_of(name: &str) -> String {
    let (base, channel) = Value::parts(name);
    let meaning = known(base).unwrap_or_else(|| {
        "A measure specific to this study; the method is the one that its stream declares."
            .to_owned()
    });
    match channel {
        Some(channel) => format!("{} Of channel {channel}.", meaning.trim_end()),
        None => meaning,
    }
}

/// Returns the meaning of a measure; `None` for a measure of another program.
fn known(base: &str) -> Option<String> {
    if let Some(meaning) = listed(base) {
        return Some(meaning.to_owned());
    }
    Comparison::read(base).find_map(|(measure, comparison)| {
        let of = listed(measure)?.trim_end_matches('.');
        Some(format!("{of}, {}.", compared(comparison)))
    })
}

fn compared(comparison: Comparison) -> &'static str {
    match comparison {
        Comparison::Difference => "minus its value in the baseline",
        Comparison::Z => "minus its mean in the baseline, divided by the standard deviation there",
        Comparison::RobustZ => {
            "minus its median in the baseline, divided by 1.4826 times the median absolute deviation there"
        }
    }
}

fn listed(base: &str) -> Option<&'static str> {
    let mut all = TABLES.iter().flat_map(|table| table.iter());
    all.find(|(name, _)| *name == base).map(|(_, meaning)| *meaning)
}

#[cfg(test)]
mod tests {
    use teampulse_signal::{acceleration, ecg, eda, eeg, emg, hrv, ppg, respiration, temperature};

    use super::*;

    #[test]
    fn what_is_compared_with_the_baseline_says_so() {
        assert_eq!(
            meaning_of("heart_rate_z"),
            "Mean heart rate, minus its mean in the baseline, divided by the standard deviation there."
        );
        assert_eq!(
            meaning_of("EMG_RMS/flexor"),
            format!("{} Of channel flexor.", meaning_of("EMG_RMS"))
        );
        assert!(meaning_of("pupil").starts_with("A measure specific to this study"));
    }

    /// Every value that an analysis of a person's signal computes.
    fn values_of_analyses() -> Vec<Value> {
        let channels = ["F3", "F4", "Fz", "Pz", "Fp1"].map(str::to_owned).to_vec();
        let eeg_settings = eeg::analysis::Settings { channels, ..Default::default() };
        let muscle = |name: &str| emg::analysis::Channel { name: name.to_owned(), mvc: None };
        let emg_settings = emg::analysis::Settings {
            channels: vec![muscle("flexor"), muscle("extensor")],
            antagonists: vec![[0, 1]],
            ..Default::default()
        };
        let analyses = [
            ecg::analysis::causal(&ecg::analysis::Settings::default(), 130.0),
            ppg::analysis::causal(&ppg::analysis::Settings::default(), 64.0),
            eda::analysis::causal(&eda::analysis::Settings::default(), 4.0),
            eeg::analysis::causal(&eeg_settings, 256.0),
            emg::analysis::causal(&emg_settings, 1000.0),
            respiration::analysis::causal(&respiration::analysis::Settings::default(), 50.0),
            temperature::analysis::causal(&temperature::analysis::Settings::default(), 4.0),
            acceleration::analysis::causal(&acceleration::analysis::Settings::default(), 32.0),
            hrv::analysis::causal(&hrv::analysis::Settings::default(), 0.0),
        ];
        analyses.into_iter().flat_map(|analysis| analysis.unwrap().values().to_vec()).collect()
    }

    #[test]
    fn every_value_of_an_analysis_has_its_meaning() {
        let values = values_of_analyses();
        assert!(values.len() > 300);
        for Value { name, .. } in values {
            assert!(known(Value::parts(&name).0).is_some(), "{name} has no meaning");
        }
    }

    #[test]
    fn no_measure_is_listed_twice_and_each_meaning_is_a_sentence() {
        let all: Vec<&Meaning> = TABLES.iter().flat_map(|table| table.iter()).collect();
        let names: std::collections::BTreeSet<&str> = all.iter().map(|(name, _)| *name).collect();
        assert_eq!(names.len(), all.len());
        assert!(all.iter().all(|(_, meaning)| meaning.ends_with('.')));
    }
}
