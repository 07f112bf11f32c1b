//! Responses to events: the heart rate, and skin responses, around each.

use std::path::Path;

use clap::Args;
use teampulse_core::counted::counted;
use teampulse_core::stream::Signal;
use teampulse_features::analyses::Analysis;
use teampulse_signal::analysis::{Event, Measured, Reason, Span, Value, Windows};
use teampulse_signal::eda::{EventWindow, Response};
use teampulse_signal::error::SignalError;
use teampulse_signal::hrv::{EventRate, EventSpans};
use teampulse_signal::intervals::{Beats, Correction};

use super::options::{failure, seconds};
use super::table::TableError;
use super::truth::{Axis, Events};
use crate::exit::Exit;
use crate::failure::Failure;

/// An interval longer than this is a gap between beats, across which nothing is corrected [s].
const LONGEST_INTERVAL_SECS: f64 = 2.5;
/// The minimum share of the span around an event that must have data; below it, the event's values are missing.
const LEAST_COVERAGE: f64 = 0.95;

/// The events around which values are computed, and the spans before and after each.
#[derive(Debug, Args)]
pub struct AroundArgs {
    /// A table of events (column `time_secs`, in seconds on the time axis of the table or as dates, or `sample`; also
    /// an `events.tsv`, or the events of an export): computes the heart rate around each event from an ECG, a PPG or
    /// intervals, or the skin's response to each event
    #[arg(long, value_name = "FILE")]
    around: Option<std::path::PathBuf>,
    /// Length of the baseline before each event [s], for the heart rate
    #[arg(long, value_name = "SECS", value_parser = seconds, requires = "around", default_value = "2")]
    baseline: f64,
    /// Time after each event [s]: by default 6 for the heart rate, and 4 for the skin, where it is the longest time to
    /// a response
    #[arg(long, value_name = "SECS", value_parser = seconds, requires = "around")]
    after: Option<f64>,
}

/// The values around each event.
#[derive(Default)]
pub struct Around {
    /// The name, unit and recipe of each value.
    pub values: Vec<Value>,
    /// The time of each event [s], and its values.
    pub events: Vec<(f64, Measured)>,
    /// The label of each event; empty where it has none.
    pub labels: Vec<String>,
    /// Notes on events without values: those without a time, or all of them if none lies within the recording.
    pub notes: Vec<String>,
}

/// A recording with its beats or responses.
pub struct Analysed<'a> {
    /// What was measured.
    pub signal: &'static Analysis,
    /// Samples per second [Hz].
    pub rate_hz: f64,
    /// The start of the recording [ns].
    pub begin_ns: i64,
    /// The end of the recording [ns].
    pub end_ns: i64,
    /// Whether artefacts among the beats are corrected.
    pub is_corrected: bool,
    /// The events found in the recording.
    pub events: &'a [Event],
    /// Computes the values of any span.
    pub windows: &'a dyn Windows,
}

impl AroundArgs {
    /// Whether values around events are requested.
    pub fn are_given(&self) -> bool {
        self.around.is_some()
    }

    /// Checks that a signal has values around events.
    pub fn check(&self, signal: &Analysis, is_causal: bool) -> Result<(), Failure> {
        let wrong = |message: String, hint: &str| {
            Err(Failure::new(message).hint(hint).exit(Exit::BadArguments))
        };
        if self.around.is_none() {
            return Ok(());
        }
        if kind(signal).is_none() {
            let message = format!("{} has no values around events", signal.word());
            return wrong(message, "--around is for ecg, ppg, interval and eda");
        }
        if is_causal {
            return wrong(
                "--around needs the signal after each event".to_owned(),
                "omit --method causal",
            );
        }
        let after_secs = self.after.unwrap_or(1.0);
        let (shortest, longest) =
            if signal.signal == Signal::Eda { (1.0, 60.0) } else { (1.0, 120.0) };
        if !(shortest..=longest).contains(&after_secs) || !(1.0..=120.0).contains(&self.baseline) {
            let message = format!(
                "--baseline must be between 1 and 120 s, and --after between 1 and {longest} s"
            );
            return wrong(message, "");
        }
        Ok(())
    }

    /// Computes the values around the events of the table; returns nothing if no table is given.
    pub fn find(&self, analysed: &Analysed<'_>) -> Result<Around, Failure> {
        let Some(path) = &self.around else { return Ok(Around::default()) };
        let Events { secs, labels, left_out, note } = events(path, analysed)?;
        let failed = |error: SignalError| Failure::new(error.to_string()).exit(Exit::BadArguments);
        let without_time = (left_out > 0).then(|| {
            let events = counted(left_out, "event", "events");
            format!("{events} of --around left out, for lack of a time")
        });
        let notes = note.into_iter().chain(without_time).chain(analysed.outside(&secs)).collect();
        let around = match kind(analysed.signal) {
            Some(Kind::Heart) => self.heart(analysed, secs).map_err(failed),
            _ => self.skin(analysed, secs).map_err(failed),
        };
        Ok(Around { labels, notes, ..around? })
    }

    fn heart(&self, analysed: &Analysed<'_>, events_secs: Vec<f64>) -> Result<Around, SignalError> {
        let after_secs = self.after.unwrap_or(EventSpans::default().after_secs).floor();
        let spans = EventSpans { baseline_secs: self.baseline, after_secs };
        let of_beats = |event: &&Event| Some(event.kind) == analysed.signal.main_event();
        let beats = analysed.events.iter().filter(of_beats);
        let beats_secs: Vec<f64> = beats.map(|beat| analysed.secs(beat.at_ns)).collect();
        let beats_secs = if analysed.is_corrected { corrected(&beats_secs) } else { beats_secs };
        let begin_secs = analysed.begin_ns as f64 / 1e9;
        let since_begin: Vec<f64> = events_secs.iter().map(|secs| secs - begin_secs).collect();
        let rates = spans.around(&beats_secs, &since_begin)?;
        let count = after_secs as usize;
        let events = events_secs.into_iter().zip(rates).map(|(secs, rate)| {
            let whole = analysed.measure(secs - self.baseline, secs + after_secs);
            let rate = usable(&whole).and(rate);
            let values = match rate {
                Ok(rate) => of_rate(&rate),
                Err(reason) => vec![Err(reason); 6 + count],
            };
            (secs, Measured { values, ..whole })
        });
        Ok(Around {
            events: events.collect(),
            values: heart_values(self.baseline, count, analysed),
            ..Around::default()
        })
    }

    fn skin(&self, analysed: &Analysed<'_>, events_secs: Vec<f64>) -> Result<Around, SignalError> {
        let usual = EventWindow::default();
        let window = EventWindow { to_secs: self.after.unwrap_or(usual.to_secs), ..usual };
        let responses: Vec<Response> = analysed.events.iter().filter_map(response).collect();
        let begin_secs = analysed.begin_ns as f64 / 1e9;
        let samples: Vec<f64> =
            events_secs.iter().map(|secs| (secs - begin_secs) * analysed.rate_hz).collect();
        let related = window.of(&responses, &samples, analysed.rate_hz)?;
        let events = events_secs.into_iter().zip(related).map(|(secs, related)| {
            let whole = analysed.measure(secs, secs + window.to_secs);
            let values = match usable(&whole) {
                Ok(()) => vec![
                    Ok(f64::from(u8::from(related.responded))),
                    Ok(related.amplitude_us),
                    related.latency_secs.ok_or(Reason::Undefined),
                    related.response.map(|response| response.rise_secs).ok_or(Reason::Undefined),
                ],
                Err(reason) => vec![Err(reason); 4],
            };
            (secs, Measured { values, ..whole })
        });
        let events = events.collect();
        Ok(Around { events, values: skin_values(window), ..Around::default() })
    }
}

/// The kind of response to an event.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Heart,
    Skin,
}

fn kind(signal: &Analysis) -> Option<Kind> {
    match signal.signal {
        Signal::Ecg | Signal::Ppg | Signal::Interval => Some(Kind::Heart),
        Signal::Eda => Some(Kind::Skin),
        _ => None,
    }
}

impl Analysed<'_> {
    /// Converts to a time since the start of the recording [s].
    fn secs(&self, at_ns: i64) -> f64 {
        at_ns.saturating_sub(self.begin_ns) as f64 / 1e9
    }

    /// Returns the note that no event lies within the recording, if so.
    fn outside(&self, events_secs: &[f64]) -> Option<String> {
        let [begin_secs, end_secs] = [self.begin_ns, self.end_ns].map(|at_ns| at_ns as f64 / 1e9);
        if events_secs.iter().any(|secs| (begin_secs..=end_secs).contains(secs)) {
            return None;
        }
        let first_secs = events_secs.iter().copied().reduce(f64::min)?;
        let last_secs = events_secs.iter().copied().reduce(f64::max)?;
        Some(format!(
            "no event of --around is within the recording: events are at {first_secs:.3} to {last_secs:.3} s, the \
             recording is from {begin_secs:.3} to {end_secs:.3} s; both need the same time axis, as `measured_secs` \
             of two tables that `teampulse export` wrote, or dates, as `time` of an `events.tsv`"
        ))
    }

    /// Measures the recording between two times [s]; a span that is not entirely within it has no values.
    fn measure(&self, from_secs: f64, to_secs: f64) -> Measured {
        let [begin_ns, end_ns] = [from_secs, to_secs].map(|secs| (secs * 1e9) as i64);
        if begin_ns < self.begin_ns || end_ns > self.end_ns || end_ns <= begin_ns {
            return Measured::nothing(0.0, 0.0, 0, Reason::Gap);
        }
        self.windows.measure(Span { begin_ns, end_ns })
    }
}

/// Whether a span has enough usable data; the reason if not.
fn usable(whole: &Measured) -> Result<(), Reason> {
    if whole.coverage < LEAST_COVERAGE {
        return Err(Reason::Gap);
    }
    let is_poor = |value: &Result<f64, Reason>| *value == Err(Reason::Quality);
    let (is_any_known, is_any_poor) =
        (whole.values.iter().any(Result::is_ok), whole.values.iter().any(is_poor));
    if is_any_poor && !is_any_known { Err(Reason::Quality) } else { Ok(()) }
}

/// Reads the events, with their times on the axis of the recording.
fn events(path: &Path, analysed: &Analysed<'_>) -> Result<Events, Failure> {
    let samples = |sample: f64| analysed.begin_ns as f64 / 1e9 + sample / analysed.rate_hz;
    let rate_hz = analysed.signal.is_even().then_some(analysed.rate_hz);
    let axis = Axis {
        within: analysed.begin_ns as f64 / 1e9..=analysed.end_ns as f64 / 1e9,
        of_sample: rate_hz.map(|_| &samples as &dyn Fn(f64) -> f64),
    };
    Events::read(path, &axis).map_err(|error| match error {
        TableError::NoColumn { .. } => failure(error).hint(
            "the table of --around needs the times of its events in a column `time_secs`, `onset`, `measured_secs` or \
             `sample`",
        ),
        error => failure(error),
    })
}

/// Corrects the artefacts among beats, separately in each stretch between gaps.
fn corrected(beats_secs: &[f64]) -> Vec<f64> {
    let is_hole = |before: f64, after: f64| after - before > LONGEST_INTERVAL_SECS;
    let stretches = Beats::detected(beats_secs).split(is_hole);
    let correct = |beats: &Beats| Correction::default().correct(beats).beats.times_secs().to_vec();
    stretches.iter().flat_map(correct).collect()
}

fn response(event: &Event) -> Option<Response> {
    let detail =
        |name: &str| event.details.iter().find(|(each, _)| *each == name).map(|(_, value)| *value);
    Some(Response {
        onset: detail("onset_sample")?,
        peak: event.sample,
        amplitude_us: detail("amplitude_us")?,
        rise_secs: detail("rise_secs")?,
        half_recovery_secs: detail("half_recovery_secs").filter(|secs| secs.is_finite()),
    })
}

fn of_rate(rate: &EventRate) -> Vec<Result<f64, Reason>> {
    let (most, most_secs) = rate.most_change();
    let (least, least_secs) = rate.least_change();
    let summary =
        [rate.baseline_per_min, rate.mean_change_per_min(), most, most_secs, least, least_secs];
    summary.into_iter().chain(rate.changes_per_min.iter().copied()).map(Ok).collect()
}

fn heart_values(baseline_secs: f64, count: usize, analysed: &Analysed<'_>) -> Vec<Value> {
    let prefix = match analysed.signal.signal {
        Signal::Ecg => "ECG_",
        Signal::Ppg => "PPG_",
        _ => "",
    };
    let beats = if analysed.is_corrected { "beats corrected" } else { "beats as detected" };
    let common = format!("intervals weighted by their overlap (Graham 1978), {beats}");
    let value = |name: String, unit: &'static str, recipe: String| Value {
        name: format!("{prefix}{name}").into(),
        unit: unit.into(),
        method: format!("{recipe}; {common}").into(),
    };
    let baseline = format!("mean rate of the {baseline_secs} s before the event");
    let mut values = vec![
        value("Rate_Baseline".into(), "1/min", baseline),
        value(
            "Rate_Change_Mean".into(),
            "1/min",
            format!("mean of the {count} s after the event, less the baseline"),
        ),
        value(
            "Rate_Change_Max".into(),
            "1/min",
            "second with the highest rate, less the baseline".into(),
        ),
        value("Rate_Change_Max_Time".into(), "s", "start of that second after the event".into()),
        value(
            "Rate_Change_Min".into(),
            "1/min",
            "second with the lowest rate, less the baseline".into(),
        ),
        value("Rate_Change_Min_Time".into(), "s", "start of that second after the event".into()),
    ];
    values.extend((1..=count).map(|second| {
        let recipe = format!("second {second} after the event, less the baseline");
        value(format!("Rate_Change_{second}"), "1/min", recipe)
    }));
    values
}

fn skin_values(window: EventWindow) -> Vec<Value> {
    let common = format!(
        "first response whose onset lies {} to {} s after the event (Boucsein et al. 2012)",
        window.from_secs, window.to_secs
    );
    let value = |name: &'static str, unit: &'static str, recipe: &str| Value {
        name: name.into(),
        unit: unit.into(),
        method: format!("{recipe}; {common}").into(),
    };
    vec![
        value("SCR_Event", "1", "1 with a response, 0 without one"),
        value(
            "SCR_Event_Amplitude",
            "uS",
            "from its onset to its peak; 0 without one, so that means are magnitudes",
        ),
        value("SCR_Event_Latency", "s", "from the event to its onset"),
        value("SCR_Event_RiseTime", "s", "from its onset to its peak"),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Nothing;

    impl Windows for Nothing {
        fn values(&self) -> &[Value] {
            &[]
        }

        fn measure(&self, _span: Span) -> Measured {
            Measured::nothing(0.0, 0.0, 0, Reason::Gap)
        }
    }

    /// A minute of EDA from this time [s] on.
    fn minute(begin_secs: i64) -> Analysed<'static> {
        Analysed {
            signal: Analysis::of(Signal::Eda).unwrap(),
            rate_hz: 4.0,
            begin_ns: begin_secs * 1_000_000_000,
            end_ns: (begin_secs + 60) * 1_000_000_000,
            is_corrected: true,
            events: &[],
            windows: &Nothing,
        }
    }

    fn times(name: &str, text: &str) -> Result<Vec<f64>, (String, String)> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let read = events(&path, &minute(10)).map_err(|failure| failure.words());
        read.map(|events| events.secs)
    }

    #[test]
    fn the_events_of_our_own_tables_are_read() {
        let tsv = "onset\tduration\ttrial_type\n12.5\tn/a\tmarker\n30\t5\tphase\n";
        assert_eq!(times("events.tsv", tsv), Ok(vec![12.5, 30.0]));
        let exported = "measured_secs,log_time_secs,index,kind,label\n\
                        1700000001.5,1700000001.6,0,marker,\"a, b\"\n";
        assert_eq!(times("session__events.csv", exported), Ok(vec![1_700_000_001.5]));
        assert_eq!(times("own.csv", "onset,time_secs\n1,2\n"), Ok(vec![2.0]));
        assert_eq!(times("samples.csv", "sample\n40\n"), Ok(vec![20.0]));
        let (_, hint) = times("other.csv", "when\n1\n").unwrap_err();
        assert!(hint.contains("`onset`") && !hint.contains("--column"), "{hint}");
    }

    #[test]
    fn events_that_are_all_outside_of_the_recording_are_noted() {
        assert_eq!(minute(10).outside(&[1.0, 20.0]), None);
        assert_eq!(minute(10).outside(&[]), None);
        let note = minute(1000).outside(&[1.0, 20.0]).unwrap();
        assert!(
            note.contains("events are at 1.000 to 20.000 s, the recording is from 1000.000"),
            "{note}"
        );
    }
}
