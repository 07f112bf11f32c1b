//! The lines of a person: the newest figure of each signal.

use std::collections::BTreeMap;

use teampulse_core::data::{FeatureValues, Reason};
use teampulse_core::stream::{Stream, Window};
use teampulse_core::time::Time;

use super::format::for_so_long;
use super::styled_line::{Style, StyledLine};

/// The signals shown: the feature that computes each, its name, its channel, its format, and the value shown
/// next to it.
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

/// The quality below which a figure is marked as poor.
const POOR: f32 = 0.5;
/// The coverage of a window below which the coverage is shown.
const WHOLE: f32 = 0.95;
/// The column at which a figure's input is shown.
const INPUT_COLUMN: usize = 60;
/// The age above which a figure is no longer current [s].
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

/// The newest figures of a person by signal, in the order shown.
#[derive(Debug, Default)]
pub(super) struct Person(BTreeMap<(usize, String), Signal>);

/// The state of one signal.
#[derive(Debug, Default)]
struct Signal {
    /// The name of the signal's input within the person.
    input: String,
    /// The newest value of each window.
    windows: BTreeMap<Window, WindowValue>,
    /// The last value, and its time.
    last: Option<(f64, Time)>,
}

#[derive(Debug)]
struct WindowValue {
    at: Time,
    value: Result<f64, Reason>,
    beside: Option<f64>,
    window_secs: f64,
    coverage: f32,
    quality: f32,
}

/// How long a stream that should arrive has been silent [s], by its name.
pub(super) type Silent<'a> = &'a dyn Fn(&str) -> Option<f64>;

impl Person {
    /// Takes the values of a feature that are shown. Estimates of a person's state are never shown here, as they would
    /// bias an experimenter.
    pub fn take(&mut self, stream: &Stream, values: &FeatureValues, at: Time) {
        let Some((place, input, window)) = shown(stream) else { return };
        let figure = &FIGURES[place];
        let of = |channel| stream.place_of(channel);
        let number = |k: usize| values.values.get(k).copied().filter(|value| value.is_finite());
        let Some(k) = of(figure.channel) else { return };
        let reason = values.reasons.get(k).copied().unwrap_or(Reason::Missing);
        let reported = WindowValue {
            at,
            value: number(k).ok_or(reason),
            beside: of(figure.beside).and_then(number),
            window_secs: values.window_secs,
            coverage: values.coverage,
            quality: values.quality,
        };
        let signal = self.0.entry((place, input.to_owned())).or_default();
        signal.last = reported.value.ok().map(|value| (value, at)).or(signal.last);
        signal.windows.insert(window, reported);
        stream.subject().within(input).clone_into(&mut signal.input);
    }

    /// A line for each signal: its figure, window, quality, age and input, or why there is none.
    pub fn lines(&self, now: Time, silent: Silent<'_>, detail: Detail) -> Vec<StyledLine> {
        let mut lines: Vec<(&str, bool, StyledLine)> = Vec::new();
        for ((place, input), signal) in &self.0 {
            // The first window that has a value, or else the reason of the first window.
            let known = signal.windows.values().find(|reported| reported.value.is_ok());
            let Some(reported) = known.or_else(|| signal.windows.values().next()) else { continue };
            let figure = &FIGURES[*place];
            let silent_secs = silent(input);
            let is_fresh = reported.value.is_ok() && silent_secs.is_none();
            let (figures, input) = line(figure, signal, reported, now, silent_secs);
            let whole = || figures.clone().up_to(INPUT_COLUMN).with_line(input);
            let line = if detail == Detail::Brief { figures.clone() } else { whole() };
            let same = lines.iter_mut().find(|(word, _, _)| *word == figure.word);
            match same.filter(|_| detail == Detail::Brief) {
                Some(known) if is_fresh && !known.1 => *known = (figure.word, is_fresh, line),
                Some(_) => {}
                None => lines.push((figure.word, is_fresh, line)),
            }
        }
        lines.into_iter().map(|(_, _, line)| line).collect()
    }
}

/// The detail shown of a person.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Detail {
    /// Each signal.
    Whole,
    /// The first one with a value among signals that measure the same.
    Brief,
}

/// The figure, the signal and the window of a stream; `None` for any other stream.
fn shown(stream: &Stream) -> Option<(usize, &str, Window)> {
    let [input] = stream.inputs.as_slice() else { return None };
    let place = FIGURES.iter().position(|figure| figure.family == stream.family)?;
    let window = stream.window.filter(|window| *window != Window::Phases)?;
    Some((place, input, window))
}

/// A figure and its input.
fn line(
    figure: &Figure,
    signal: &Signal,
    reported: &WindowValue,
    now: Time,
    silent_secs: Option<f64>,
) -> (StyledLine, StyledLine) {
    let age_secs = now.secs_since(reported.at);
    let is_old = silent_secs.is_some() || age_secs > OLD_SECS;
    let style = if is_old { Style::Grey } else { Style::Plain };
    let (value, style_of_value) = match (is_old, reported.value, signal.last) {
        (false, Ok(value), _) => ((figure.write)(value), Style::Strong),
        (true, _, Some((value, _))) => (format!("was {}", (figure.write)(value)), Style::Grey),
        _ => ("–".to_owned(), style),
    };
    let line = StyledLine::of(style, &format!("  {:<7}", figure.word));
    let line = line.with(style_of_value, &format!("{value:>12}"));
    let line = line.with(style, &format!("  {:<10}  ", window(reported)));
    let line = match (silent_secs, reported.value) {
        (Some(secs), _) => line.with(Style::Strong, &format!("silent {}", for_so_long(secs))),
        _ if is_old => {
            line.with(Style::Strong, &format!("nothing new for {}", for_so_long(age_secs)))
        }
        (None, Ok(_)) => quality(line, reported).with(style, &format!("{age_secs:>5.1} s ago")),
        (None, Err(reason)) => line.with(style, &why(reason, reported)),
    };
    let beside = reported.beside.filter(|_| !is_old);
    let beside = beside.map(|per_min| format!("  {per_min:.0} responses/min"));
    (line, StyledLine::of(style, &signal.input).with(style, &beside.unwrap_or_default()))
}

/// The window of a figure, and its coverage if incomplete.
fn window(reported: &WindowValue) -> String {
    let WindowValue { window_secs, coverage, .. } = reported;
    if *coverage >= WHOLE {
        format!("{window_secs:.0} s")
    } else {
        format!("{:.0} of {window_secs:.0} s", f64::from(*coverage) * window_secs)
    }
}

fn quality(line: StyledLine, reported: &WindowValue) -> StyledLine {
    let quality = reported.quality;
    if quality < POOR {
        line.with(Style::Warning, &format!("poor    {quality:.2}"))
    } else {
        line.with(Style::Plain, &format!("quality {quality:.2}"))
    }
}

/// Why a value is missing; an incomplete window is shown next to it.
fn why(reason: Reason, reported: &WindowValue) -> String {
    match reason {
        Reason::Short if reported.coverage < WHOLE => "fills its window".to_owned(),
        reason => reason.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{About, Shape, Subject};

    use super::*;

    fn stream(name: &str, channels: &[(&str, &str)]) -> Stream {
        let subject = Subject { about: About::Person, id: "p001".into() };
        let (input, family) = name.rsplit_once(':').unwrap();
        let input = Stream::raw(format!("/humans/persons/p001/{input}"), subject, Shape::Wave);
        let stream = Stream::derived(&input, family, Shape::Feature);
        stream.over(Window::of_secs(30.0)).with_channels(channels)
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
        shown_lines(person, now_secs, None)
    }

    fn shown_lines(person: &Person, now_secs: f64, silent_secs: Option<f64>) -> String {
        let silent = move |_: &str| silent_secs;
        let lines = person.lines(secs(now_secs), &silent, Detail::Whole);
        lines.iter().map(StyledLine::text).collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn each_signal_is_a_line_with_window_quality_and_age_or_why_there_is_nothing() {
        let mut person = Person::default();
        let mut take = |name: &str, channels: &[(&str, &str)], reported: &FeatureValues| {
            person.take(&stream(name, channels), reported, secs(8.0));
        };
        let heart = [("ECG_Rate_Mean", "bpm")];
        let whole = |reported| FeatureValues { coverage: 1.0, ..reported };
        take("strap/ecg:heart", &heart, &whole(values(&[81.5], Reason::Ok, 0.9)));
        take("e4/ppg:pulse", &[("PPG_Rate_Mean", "1/min")], &values(&[79.9], Reason::Ok, 0.3));
        let breath = [("RSP_Rate_Mean", "1/min")];
        take("belt/respiration:breath", &breath, &values(&[f64::NAN], Reason::Quality, 0.1));
        let skin = [("EDA_Tonic_Mean", "µS"), ("SCR_Peaks_Rate", "1/min")];
        take("e4/eda:skin", &skin, &whole(values(&[3.84, 4.0], Reason::Ok, 1.0)));
        insta::assert_snapshot!(lines(&person, 8.6), @r"
          heart       82 /min  30 s        quality 0.90  0.6 s ago  strap/ecg
          heart       80 /min  12 of 30 s  poor    0.30  0.6 s ago  e4/ppg
          breath            –  12 of 30 s  data too poor            belt/respiration
          skin        3.84 µS  30 s        quality 1.00  0.6 s ago  e4/eda  4 responses/min
        ");
        assert!(lines(&person, 8.6).lines().take(3).all(|line| line.chars().count() < 80));
    }

    #[test]
    fn in_brief_each_figure_is_one_line_of_the_first_signal_that_has_it() {
        let mut person = Person::default();
        let heart = [("ECG_Rate_Mean", "bpm")];
        let none = values(&[f64::NAN], Reason::Quality, 0.1);
        person.take(&stream("strap/ecg:heart", &heart), &none, secs(8.0));
        let pulse = stream("e4/ppg:pulse", &[("PPG_Rate_Mean", "1/min")]);
        person.take(&pulse, &values(&[79.9], Reason::Ok, 0.9), secs(8.0));
        let lines = person.lines(secs(8.6), &|_| None, Detail::Brief);
        let [line] = lines.as_slice() else { panic!("{lines:?}") };
        assert!(line.text().contains("80 /min") && line.width() < 60, "{line:?}");
    }

    #[test]
    fn a_window_that_is_not_full_says_how_much_it_has() {
        let mut person = Person::default();
        let heart = stream("strap/ecg:heart", &[("ECG_Rate_Mean", "bpm")]);
        person.take(&heart, &values(&[f64::NAN], Reason::Short, 0.9), secs(8.0));
        let line = lines(&person, 9.0);
        assert!(line.contains("–  12 of 30 s") && line.contains("fills its window"), "{line}");
    }

    #[test]
    fn a_figure_of_long_ago_is_not_one_of_now() {
        let mut person = Person::default();
        let heart = stream("strap/ecg:heart", &[("ECG_Rate_Mean", "bpm")]);
        person.take(&heart, &values(&[81.5], Reason::Ok, 0.9), secs(8.0));
        assert!(lines(&person, 9.0).contains(" 82 /min"));
        let later = lines(&person, 30.0);
        assert!(later.contains("was 82 /min") && later.contains("nothing new for 22 s"), "{later}");
    }

    #[test]
    fn of_a_silent_stream_it_is_said_for_how_long_instead_of_what_its_windows_lack() {
        let mut person = Person::default();
        let heart = stream("strap/ecg:heart", &[("ECG_Rate_Mean", "bpm")]);
        person.take(&heart, &values(&[71.0], Reason::Ok, 0.9), secs(8.0));
        person.take(&heart, &values(&[f64::NAN], Reason::Short, 0.9), secs(16.0));
        let silent = shown_lines(&person, 17.7, Some(9.7));
        assert!(silent.contains("was 71 /min") && silent.contains("silent 9.7 s"), "{silent}");
        assert!(!silent.contains("too short"), "{silent}");
    }

    #[test]
    fn a_figure_is_of_the_first_window_that_has_it() {
        let mut person = Person::default();
        for (window_secs, rate) in [(30.0, f64::NAN), (60.0, 70.0)] {
            let heart = stream("strap/ecg:heart", &[("ECG_Rate_Mean", "bpm")]);
            let heart = Stream { window: Some(Window::of_secs(window_secs)), ..heart };
            person.take(&heart, &values(&[rate], Reason::Short, 0.9), secs(8.0));
        }
        assert!(lines(&person, 9.0).contains("70 /min"));
    }

    #[test]
    fn what_is_estimated_of_a_person_is_not_shown() {
        let mut person = Person::default();
        let channels = [("ECG_Rate_Mean", "bpm"), ("workload", "1")];
        let reported = values(&[81.0, 0.7], Reason::Ok, 1.0);
        let heart = stream("strap/ecg:heart", &channels);
        person.take(&Stream { window: Some(Window::Phases), ..heart }, &reported, secs(8.0));
        for family in ["state", "estimates", "statistics"] {
            person.take(&stream(&format!("strap/ecg:{family}"), &channels), &reported, secs(8.0));
        }
        assert_eq!(lines(&person, 8.0), "");
    }
}
