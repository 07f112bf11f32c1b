//! Analyses of the signal crate as features: of every stream of one signal, and over phases.

use std::borrow::Cow;
use std::collections::BTreeMap;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;
use teampulse_core::feature::{Extractor, Feature, Outputs, Scope};
use teampulse_core::phases::Phases;
use teampulse_core::registry::{Component, Entry, SettingsError};
use teampulse_core::sample::{Sample, Turn};
use teampulse_core::stream::{About, Origin, Shape, Signal, Stream, StreamId};
use teampulse_core::time::Time;

use crate::analyses::{ANALYSES, Analysis, Documented};
use crate::context::FeatureContext;
use crate::running::Running;

/// A phase is reported this long after its end even if nothing has arrived on the stream since [ns].
const PATIENCE_NS: i64 = 10_000_000_000;

/// The highest plausible rate of a person's sensor [samples a second]; a stream with a higher one is not
/// analysed, as its windows would take too much memory.
const HIGHEST_RATE_HZ: f64 = 100_000.0;

/// The feature of a row of the table of analyses.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(transparent)]
pub struct Analysed<const ROW: usize>(Settings);

/// The settings of every feature that is an analysis.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Settings {
    /// The lengths of the windows [s]; by default those of the study.
    windows_secs: Option<Vec<f64>>,
}

impl<const ROW: usize> JsonSchema for Analysed<ROW> {
    fn schema_name() -> Cow<'static, str> {
        feature::<ROW>().name.into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = Settings::json_schema(generator);
        schema.insert("description".to_owned(), feature::<ROW>().text().into());
        schema
    }
}

impl<const ROW: usize> Component<dyn Feature, FeatureContext> for Analysed<ROW> {
    const EXAMPLE: &'static str = "windows_secs = [30, 60, 300]";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        start(&ANALYSES[ROW], self.0.windows_secs, context)
    }
}

/// The row in the table of features of the analysis with this index.
pub(crate) const fn entry<const ROW: usize>() -> Entry<dyn Feature, FeatureContext> {
    Entry::new::<Analysed<ROW>>(feature::<ROW>().name)
}

const fn feature<const ROW: usize>() -> Documented {
    ANALYSES[ROW].feature.expect("a row of the table of features has one")
}

/// Builds the feature that runs an analysis on each stream of its signal.
fn start(
    analysis: &'static Analysis,
    windows_secs: Option<Vec<f64>>,
    context: &FeatureContext,
) -> Result<Box<dyn Feature>, SettingsError> {
    let windows_secs = context.windows_or(windows_secs)?;
    let mains_hz = context.mains_hz.filter(|_| analysis.signal == Signal::Ecg);
    if let Some(wrong) = mains_hz.filter(|hz| ![50.0, 60.0].contains(hz)) {
        let message = format!("a mains frequency of {wrong} Hz: expected 50 or 60");
        let hint = "remove it to detect the mains frequency in the signal";
        return Err(SettingsError::new(message).with_hint(hint).at("mains_hz"));
    }
    Ok(Box::new(OfPeople { analysis, mains_hz, windows_secs }))
}
/// An analysis of people's streams, configured by a study.
struct OfPeople {
    analysis: &'static Analysis,
    mains_hz: Option<f64>,
    windows_secs: Vec<f64>,
}

impl OfPeople {
    fn analyses(&self, stream: &Stream) -> bool {
        stream.about == About::Person
            && stream.origin == Origin::Raw
            && stream.signal == self.analysis.signal
            && matches!(stream.shape, Shape::Sample | Shape::Wave)
            && !stream.channels.is_empty()
            && (stream.rate_hz > 0.0 || !self.analysis.is_even())
            && stream.rate_hz <= HIGHEST_RATE_HZ
    }
}

impl Feature for OfPeople {
    fn accepts(&self, stream: &Stream) -> bool {
        self.analyses(stream) || Phases::hears(stream)
    }

    /// All streams share one extractor: phases are reported in the order of their streams.
    fn scope(&self) -> Scope {
        Scope::Session
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        Box::new(Analyses {
            analysis: (self.analysis, self.mains_hz),
            windows_secs: self.windows_secs.clone(),
            running: BTreeMap::new(),
        })
    }
}

/// The analyses of all streams.
struct Analyses {
    analysis: (&'static Analysis, Option<f64>),
    windows_secs: Vec<f64>,
    running: BTreeMap<StreamId, Running>,
}

impl Extractor for Analyses {
    fn join(&mut self, id: StreamId, stream: &Stream, out: &mut Outputs) {
        if Phases::hears(stream) {
            return;
        }
        if let Some(running) = self.running.get_mut(&id) {
            running.join(stream, out);
        } else {
            let running = Running::begin(self.analysis, &self.windows_secs, stream, out);
            self.running.insert(id, running);
        }
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        if let Some(running) = self.running.get_mut(&sample.stream) {
            let phases = out.phases();
            running.push(sample, phases.of(&running.stream().subject()), out);
        }
    }

    /// The end of the session ends all windows and phases.
    fn phases_changed(&mut self, by: &Sample, out: &mut Outputs) {
        if by.turn == Turn::OnTime && out.phases().is_over() {
            self.running.values_mut().for_each(|running| running.finish(out));
            self.end_phases(by.measured, out);
        }
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        self.end_phases(Time::from_nanos(now.nanos().saturating_sub(PATIENCE_NS)), out);
    }
}

impl Analyses {
    fn end_phases(&mut self, now: Time, out: &mut Outputs) {
        let phases = out.phases();
        for running in self.running.values_mut() {
            running.end_phases(phases.of(&running.stream().subject()), now, out);
        }
    }
}

/// The feature of a signal, in windows of these lengths [s].
#[cfg(test)]
pub(crate) fn built(signal: Signal, windows_secs: Option<Vec<f64>>) -> Box<dyn Feature> {
    let analysis = Analysis::of(signal).unwrap();
    start(analysis, windows_secs, &FeatureContext::default()).unwrap()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use teampulse_core::data::{Data, Event, EventKind, FeatureValues, Reason, Wave};
    use teampulse_core::session_streams::{END, session_events};
    use teampulse_core::stream::Subject;

    use super::*;
    use crate::drive::alone;

    const RATE_HZ: f64 = 4.0;
    const INPUT: StreamId = StreamId(0);
    const EVENTS: StreamId = StreamId(1);

    /// Skin that warms by a hundredth of a degree per second, in a session with phases.
    struct Warming {
        extractor: Box<dyn Extractor>,
        out: Outputs,
        now_secs: f64,
    }

    impl Warming {
        fn new() -> Warming {
            let feature = built(Signal::Temperature, Some(vec![10.0]));
            let subject = Subject { about: About::Person, id: "p1".into() };
            let stream = Stream::raw("/humans/persons/p1/e4/temp", subject, Shape::Wave);
            let stream = Stream { signal: Signal::Temperature, rate_hz: RATE_HZ, ..stream };
            let stream = stream.with_channels(&[("temperature", "degC")]);
            let (mut extractor, mut out) = (alone(&*feature, &stream), Outputs::new());
            for (id, stream) in [(INPUT, stream), (EVENTS, session_events())] {
                assert!(feature.accepts(&stream));
                extractor.join(id, &stream, &mut out);
            }
            Warming { extractor, out, now_secs: 0.0 }
        }

        /// Pushes waves of this many samples, until a time.
        fn warm(&mut self, until_secs: f64, length: usize) {
            while self.now_secs < until_secs {
                let at = |place: usize| self.now_secs + place as f64 / RATE_HZ;
                let warmth: Arc<[f64]> =
                    (0..length).map(|place| 33.0 + at(place) / 100.0).collect();
                let wave = Wave { period_ns: 1e9 / RATE_HZ, channels: 1, samples: warmth };
                self.take(INPUT, self.now_secs, Data::Wave(wave));
                self.now_secs += length as f64 / RATE_HZ;
            }
        }

        fn happen(&mut self, secs: f64, kind: EventKind, label: &str, duration_secs: f64) {
            let event = Event { kind, label: label.to_owned(), value: f64::NAN, duration_secs };
            self.take(EVENTS, secs, Data::Event(Arc::new(event)));
        }

        fn take(&mut self, stream: StreamId, secs: f64, data: Data) {
            self.take_at(stream, secs, 1e9 / RATE_HZ, data);
        }

        fn take_at(&mut self, stream: StreamId, secs: f64, period_ns: f64, data: Data) {
            let measured = Time::from_nanos((secs * 1e9).round() as i64);
            let sample = Sample {
                stream,
                measured,
                log_time: measured,
                device_time: None,
                source_time: None,
                period_ns,
                index: 0,
                turn: Turn::OnTime,
                data,
            };
            self.extractor.push(&sample, &mut self.out);
        }

        /// The end [s] and the values of each window, or of each phase.
        fn reported(&mut self, leaf: &str) -> Vec<(f64, FeatureValues)> {
            self.values_of(&format!("/humans/persons/p1/e4/temp/skin_temperature/{leaf}"))
        }

        fn values_of(&mut self, name: &str) -> Vec<(f64, FeatureValues)> {
            let known = self.out.streams().iter().find(|stream| stream.name == name).cloned();
            let Some(id) = known.map(|stream| self.out.declare(stream)) else { return Vec::new() };
            let of = self.out.samples().filter(|(stream, ..)| *stream == id);
            of.map(|(_, at, data)| {
                let Data::Feature(values) = data else { panic!("no feature") };
                (at.secs(), (**values).clone())
            })
            .collect()
        }
    }

    fn phases(warming: &mut Warming) -> Vec<(f64, f64, f64)> {
        let windows = warming.reported("phases").into_iter();
        windows.map(|(end, values)| (end, values.window_secs, f64::from(values.coverage))).collect()
    }

    #[test]
    fn each_phase_is_reported_when_it_is_over_and_the_last_with_the_session() {
        let mut warming = Warming::new();
        warming.happen(0.0, EventKind::Phase, "baseline", 60.0);
        warming.warm(90.0, 3);
        warming.happen(90.0, EventKind::Phase, "task", f64::NAN);
        warming.warm(120.0, 3);
        warming.happen(120.0, EventKind::Phase, "rest", f64::NAN);
        warming.warm(140.0, 3);
        assert_eq!(phases(&mut warming), [(60.0, 60.0, 1.0), (120.0, 30.0, 1.0)]);
        warming.happen(140.0, EventKind::Clock, END, 0.0);
        assert_eq!(phases(&mut warming)[2..], [(140.0, 20.0, 1.0)]);
    }

    /// The number of intervals in a phase of this many seconds of an ECG with a beat every 0.8 s; the
    /// beats are at 0.3 s, 1.1 s and so on.
    fn intervals_in(phase_secs: f64) -> f64 {
        const RATE_HZ: f64 = 130.0;
        let bump = |secs: f64, at: f64, width: f64| {
            let from = (secs - at + 0.4).rem_euclid(0.8) - 0.4;
            (-(from / width).powi(2) / 2.0).exp()
        };
        let volts = |secs: f64| bump(secs, 0.3, 0.012) + 0.2 * bump(secs, 0.55, 0.05);
        let subject = Subject { about: About::Person, id: "p1".into() };
        let stream = Stream::raw("/humans/persons/p1/strap/ecg", subject, Shape::Wave);
        let stream = Stream { signal: Signal::Ecg, rate_hz: RATE_HZ, ..stream };
        let stream = stream.with_channels(&[("ecg", "mV")]);
        let feature = built(Signal::Ecg, Some(vec![10.0]));
        let (mut extractor, mut out) = (alone(&*feature, &stream), Outputs::new());
        extractor.join(INPUT, &stream, &mut out);
        extractor.join(EVENTS, &session_events(), &mut out);
        let mut heart = Warming { extractor, out, now_secs: 0.0 };
        heart.happen(0.0, EventKind::Phase, "task", phase_secs);
        for wave in 0..50 {
            let at = |k: i32| f64::from(wave) + f64::from(k) / RATE_HZ;
            let samples = (0..130).map(|k| volts(at(k))).collect();
            let wave = Wave { period_ns: 1e9 / RATE_HZ, channels: 1, samples };
            heart.take_at(INPUT, at(0), 1e9 / RATE_HZ, Data::Wave(wave));
        }
        let phases = "/humans/persons/p1/strap/ecg/heart/phases";
        let known = heart.out.streams().iter().find(|stream| stream.name == phases).unwrap();
        let place = known.place_of("HRV_N").unwrap();
        heart.values_of(phases)[0].1.values[place]
    }

    #[test]
    fn the_last_beat_of_a_phase_belongs_to_it() {
        // No beat lies between 40.3 s and 41.1 s.
        let (after_a_beat, later) = (intervals_in(40.4), intervals_in(40.9));
        assert!(later > 40.0, "{later}");
        assert_eq!(after_a_beat, later);
    }

    #[test]
    fn a_phase_is_the_same_for_any_chunking_and_whenever_its_end_becomes_known() {
        let reported = |length, lag_secs| {
            let mut warming = Warming::new();
            warming.happen(0.0, EventKind::Phase, "baseline", f64::NAN);
            warming.warm(60.0 + lag_secs, length);
            warming.happen(60.0, EventKind::Phase, "task", f64::NAN);
            warming.warm(80.0, length);
            warming.reported("phases")
        };
        let usual = reported(1, 0.0);
        assert_eq!(usual.len(), 1);
        for (length, lag_secs) in [(1, 5.0), (7, 0.0), (16, 3.0), (240, 0.0)] {
            assert_eq!(format!("{:?}", reported(length, lag_secs)), format!("{usual:?}"));
        }
    }

    #[test]
    fn a_window_that_ends_with_the_session_is_reported_and_a_shorter_one_is_not() {
        let ends = |secs: f64| {
            let mut warming = Warming::new();
            warming.warm(secs, 1);
            warming.happen(secs, EventKind::Clock, END, 0.0);
            let windows = warming.reported("w10");
            (windows.len(), windows.last().unwrap().0)
        };
        assert_eq!(ends(20.0), (20, 20.0));
        assert_eq!(ends(20.25), (20, 20.0));
        assert_eq!(ends(19.75), (19, 19.0));
    }

    #[test]
    fn phases_change_no_window() {
        let reported = |has_phases: bool| {
            let mut warming = Warming::new();
            if has_phases {
                warming.happen(3.0, EventKind::Phase, "baseline", f64::NAN);
            }
            warming.warm(100.0, 5);
            format!("{:?}", warming.reported("w10"))
        };
        assert_eq!(reported(true), reported(false));
    }

    #[test]
    fn a_stream_that_fell_silent_is_reported_up_to_its_silence() {
        let mut warming = Warming::new();
        warming.happen(0.0, EventKind::Phase, "baseline", 60.0);
        warming.warm(45.0, 4);
        let ticks = |range: std::ops::Range<i64>| range.map(|k| Time::from_nanos(k * 100_000_000));
        for tick in ticks(450..700) {
            warming.extractor.tick(tick, &mut warming.out);
        }
        assert!(phases(&mut warming).is_empty());
        warming.extractor.tick(Time::from_stamp(70, 0), &mut warming.out);
        assert_eq!(phases(&mut warming), [(60.0, 60.0, 0.75)]);
        warming.warm(90.0, 4);
        assert_eq!(phases(&mut warming).len(), 1);
    }

    #[test]
    fn a_phase_before_the_stream_or_without_length_is_not_reported() {
        let mut warming = Warming::new();
        warming.happen(0.0, EventKind::Phase, "baseline", 60.0);
        warming.happen(100.0, EventKind::Phase, "task", f64::NAN);
        warming.happen(100.0, EventKind::Phase, "task", f64::NAN);
        warming.now_secs = 80.0;
        warming.warm(110.0, 4);
        warming.happen(110.0, EventKind::Phase, "rest", f64::NAN);
        warming.warm(120.0, 4);
        assert_eq!(phases(&mut warming), [(110.0, 10.0, 1.0)]);
    }

    #[test]
    fn a_phase_with_few_samples_is_short() {
        let mut warming = Warming::new();
        warming.happen(0.0, EventKind::Phase, "baseline", 60.0);
        warming.now_secs = 50.0;
        warming.warm(70.0, 4);
        let windows = warming.reported("phases");
        assert!(windows[0].1.reasons.iter().all(|reason| *reason == Reason::Short));
    }

    #[test]
    fn a_long_phase_is_reported_by_its_last_ten_minutes() {
        let mut warming = Warming::new();
        warming.happen(0.0, EventKind::Phase, "baseline", f64::NAN);
        warming.warm(1000.0, 40);
        warming.happen(1000.0, EventKind::Phase, "task", f64::NAN);
        warming.warm(1010.0, 40);
        assert_eq!(phases(&mut warming), [(1000.0, 600.0, 1.0)]);
    }
}
