//! A person as lines: the last of each signal that matters at a glance.

use std::collections::BTreeMap;

use teampulse_core::data::{FeatureValues, Reason};
use teampulse_core::stream::Stream;
use teampulse_core::time::Time;

/// What is shown of a signal: by the feature that tells it, what it is called, its channel, how it is
/// written, and what is said beside it.
const FIGURES: &[Figure] = &[
    Figure { family: "heart", word: "heart", channel: "ECG_Rate_Mean", write: rate, beside: "" },
    Figure { family: "intervals", word: "heart", channel: "HRV_MeanHR", write: rate, beside: "" },
    Figure { family: "pulse", word: "heart", channel: "PPG_Rate_Mean", write: rate, beside: "" },
    Figure { family: "breath", word: "breath", channel: "RSP_Rate_Mean", write: rate, beside: "" },
    Figure {
        family: "skin",
        word: "skin",
        channel: "EDA_Tonic_Mean",
        write: |level_us| format!("{level_us:.2} µS"),
        beside: "SCR_Peaks_Rate",
    },
];

/// Of less than this share of data, or at less than this quality, that is said.
const POOR: f32 = 0.5;
/// A figure that is older than this is no longer one of now [s].
const OLD_SECS: f64 = 10.0;

#[derive(Debug)]
struct Figure {
    family: &'static str,
    word: &'static str,
    channel: &'static str,
    write: fn(f64) -> String,
    beside: &'static str,
}

fn rate(per_min: f64) -> String {
    format!("{per_min:.0} /min")
}

/// The last figures of a person: of each signal, in the order in which they are shown.
#[derive(Debug, Default)]
pub(super) struct Person(BTreeMap<(usize, String), Windows>);

/// What the windows of one signal told last, each by its name.
type Windows = BTreeMap<String, Told>;

#[derive(Debug)]
struct Told {
    at: Time,
    value: Result<f64, Reason>,
    beside: Option<f64>,
    coverage: f32,
    quality: f32,
}

impl Person {
    /// Takes those values of a feature that are shown: never what is estimated of a person's state,
    /// which would tell an experimenter what to expect.
    pub fn take(&mut self, stream: &Stream, values: &FeatureValues, at: Time) {
        let Some((place, input, window)) = shown(stream) else { return };
        let figure = &FIGURES[place];
        let of = |channel| stream.channels.iter().position(|each| each == channel);
        let number = |k: usize| values.values.get(k).copied().filter(|value| value.is_finite());
        let Some(k) = of(figure.channel) else { return };
        let reason = values.reasons.get(k).copied().unwrap_or(Reason::Missing);
        let told = Told {
            at,
            value: number(k).ok_or(reason),
            beside: of(figure.beside).and_then(number),
            coverage: values.coverage,
            quality: values.quality,
        };
        self.0.entry((place, input.to_owned())).or_default().insert(window.to_owned(), told);
    }

    /// A line for each signal: its figure, how old that is and whence, and what is to be said of it.
    pub fn lines(&self, now: Time) -> impl Iterator<Item = String> {
        self.0.iter().filter_map(move |((place, input), windows)| {
            // The first window that has a value; else why the first has none.
            let known = windows.values().find(|told| told.value.is_ok());
            let told = known.or_else(|| windows.values().next())?;
            Some(line(&FIGURES[*place], input, told, now))
        })
    }
}

/// Which figure a stream tells, of which signal and over which window; `None` for any other stream.
fn shown(stream: &Stream) -> Option<(usize, &str, &str)> {
    let [input] = stream.inputs.as_slice() else { return None };
    let (family, window) = stream.name.strip_prefix(input)?.strip_prefix('/')?.split_once('/')?;
    let place = FIGURES.iter().position(|figure| figure.family == family)?;
    let signal = input.rsplit('/').next().unwrap_or(input);
    window.starts_with('w').then_some((place, signal, window))
}

fn line(figure: &Figure, input: &str, told: &Told, now: Time) -> String {
    let age_secs = now.secs_since(told.at);
    let (value, remark) = match told.value {
        _ if age_secs > OLD_SECS => ("-".to_owned(), "nothing new".to_owned()),
        Ok(value) => ((figure.write)(value), remark(told)),
        Err(reason) => ("-".to_owned(), reason.to_string()),
    };
    let word = figure.word;
    let line = format!("  {word:<7} {value:>8}  age {age_secs:>4.1} s  {input:<12} {remark}");
    line.trim_end().to_owned()
}

/// What is to be said beside a figure: how good it is where it is poor, and what belongs to it.
fn remark(told: &Told) -> String {
    let Told { coverage, quality, .. } = told;
    let beside = told.beside.map(|per_min| format!("{per_min:.0} responses/min"));
    let little = (*coverage < POOR).then(|| format!("{:.0} % of data", 100.0 * coverage));
    let poor = (*quality < POOR).then(|| format!("poor quality {quality:.2}"));
    [beside, little, poor].into_iter().flatten().collect::<Vec<_>>().join("  ")
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{About, Shape, Subject};

    use super::*;

    fn stream(name: &str, channels: &[(&str, &str)]) -> Stream {
        let subject = Subject { about: About::Person, id: "p001".into() };
        let (input, leaf) = name.rsplit_once(':').unwrap();
        let input = Stream::raw(format!("/humans/persons/p001/{input}"), subject, Shape::Wave);
        Stream::derived(&input, leaf, Shape::Feature).with_channels(channels)
    }

    fn values(values: &[f64], reason: Reason, quality: f32) -> FeatureValues {
        FeatureValues {
            window_secs: 30.0,
            coverage: 0.4,
            quality,
            values: values.to_vec(),
            sigmas: Vec::new(),
            reasons: vec![reason; values.len()],
        }
    }

    fn secs(secs: f64) -> Time {
        Time::from_nanos((secs * 1e9) as i64)
    }

    fn lines(person: &Person, now_secs: f64) -> String {
        person.lines(secs(now_secs)).collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn each_signal_is_a_line_with_its_age_and_why_there_is_nothing() {
        let mut person = Person::default();
        let mut take = |name: &str, channels: &[(&str, &str)], told: &FeatureValues| {
            person.take(&stream(name, channels), told, secs(8.0));
        };
        let heart = [("ECG_Rate_Mean", "bpm")];
        take("strap/ecg:heart/w30", &heart, &values(&[81.5], Reason::Ok, 0.9));
        take("e4/ppg:pulse/w30", &[("PPG_Rate_Mean", "1/min")], &values(&[79.9], Reason::Ok, 0.3));
        let breath = [("RSP_Rate_Mean", "1/min")];
        take("belt/respiration:breath/w30", &breath, &values(&[f64::NAN], Reason::Quality, 0.1));
        let skin = [("EDA_Tonic_Mean", "µS"), ("SCR_Peaks_Rate", "1/min")];
        take("e4/eda:skin/w30", &skin, &values(&[3.84, 4.0], Reason::Ok, 1.0));
        insta::assert_snapshot!(lines(&person, 8.6), @r"
          heart    82 /min  age  0.6 s  ecg          40 % of data
          heart    80 /min  age  0.6 s  ppg          40 % of data  poor quality 0.30
          breath         -  age  0.6 s  respiration  data too poor
          skin     3.84 µS  age  0.6 s  eda          4 responses/min  40 % of data
        ");
        assert!(lines(&person, 8.6).lines().all(|line| line.chars().count() < 80));
    }

    #[test]
    fn a_figure_of_long_ago_is_not_one_of_now() {
        let mut person = Person::default();
        let heart = stream("strap/ecg:heart/w30", &[("ECG_Rate_Mean", "bpm")]);
        person.take(&heart, &values(&[81.5], Reason::Ok, 0.9), secs(8.0));
        assert!(lines(&person, 9.0).contains("82 /min"));
        let later = lines(&person, 30.0);
        assert!(!later.contains("82") && later.contains("nothing new"), "{later}");
    }

    #[test]
    fn a_figure_is_of_the_first_window_that_has_it() {
        let mut person = Person::default();
        for (window, rate) in [("w30", f64::NAN), ("w60", 70.0)] {
            let heart = stream(&format!("strap/ecg:heart/{window}"), &[("ECG_Rate_Mean", "bpm")]);
            person.take(&heart, &values(&[rate], Reason::Short, 0.9), secs(8.0));
        }
        assert!(lines(&person, 9.0).contains("70 /min"));
    }

    #[test]
    fn what_is_estimated_of_a_person_is_not_shown() {
        let mut person = Person::default();
        let channels = [("ECG_Rate_Mean", "bpm"), ("workload", "1")];
        for leaf in ["state/w30", "estimates/w30", "statistics/w30", "heart/phases"] {
            let told = values(&[81.0, 0.7], Reason::Ok, 1.0);
            person.take(&stream(&format!("strap/ecg:{leaf}"), &channels), &told, secs(8.0));
        }
        assert_eq!(lines(&person, 8.0), "");
    }
}
