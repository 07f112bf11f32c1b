//! How often a person uses keyboard, mouse and other controls.

mod activity;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::feature::{Extractor, Feature, Outputs, Scope};
use teampulse_core::phases::Phases;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::stream::{About, Origin, Shape, Signal, Stream, StreamId, Subject};
use teampulse_core::time::Time;

use crate::context::FeatureContext;
use crate::whole_seconds::WholeSeconds;

use activity::Activity;

/// A phase is reported this long after its end [ns]: input at its end may arrive late.
const SETTLED_NS: i64 = 1_000_000_000;

/// How often a person uses keyboard, mouse and other controls, and the reaction times.
///
/// - Measures: the events of all streams of a person whose signal is `input`, and the reaction time
///   if the numbers of the events are in seconds.
/// - Formula: `input_rate` is the number of events divided by the length of the window; `reaction_time` is the mean of
///   the finite numbers of events, for streams that declare them in s.
/// - Unit: 1/min, s.
/// - Window: `windows_secs`, once a second, from when the first such stream is known; and each phase when it is over,
///   of a long phase only the last 600 s. Silence is a rate of 0, not missing.
/// - Reference: none; these are counts.
/// - Limits: a person who does nothing and a keyboard that is disconnected give the same silence. The
///   keys themselves are not recorded.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Input {
    /// The lengths of the windows [s]; by default those of the study.
    pub windows_secs: Option<Vec<f64>>,
}

impl Component<dyn Feature, FeatureContext> for Input {
    const EXAMPLE: &'static str = "windows_secs = [30, 60]";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        Ok(Box::new(Inputs { windows_secs: context.windows_or(self.windows_secs)? }))
    }
}

struct Inputs {
    windows_secs: Vec<f64>,
}

impl Feature for Inputs {
    fn accepts(&self, stream: &Stream) -> bool {
        is_input(stream) || Phases::hears(stream)
    }

    /// One extractor for the session: phases are reported in the order of people.
    fn scope(&self) -> Scope {
        Scope::Session
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        Box::new(InputExtractor {
            windows_secs: self.windows_secs.clone(),
            whose: BTreeMap::new(),
            people: BTreeMap::new(),
            seconds: WholeSeconds::default(),
        })
    }
}

/// The input of all people.
struct InputExtractor {
    windows_secs: Vec<f64>,
    /// The person of each stream of input.
    whose: BTreeMap<StreamId, Subject>,
    people: BTreeMap<Subject, Activity>,
    seconds: WholeSeconds,
}

impl Extractor for InputExtractor {
    fn join(&mut self, id: StreamId, stream: &Stream, out: &mut Outputs) {
        if is_input(stream) {
            let known = self.people.entry(stream.subject());
            let person = known.or_insert_with(|| Activity::new(&self.windows_secs));
            person.join(id, stream, out);
            self.whose.insert(id, stream.subject());
        }
    }

    fn push(&mut self, sample: &Sample, _: &mut Outputs) {
        let whose = self.whose.get(&sample.stream);
        if let Some(person) = whose.and_then(|subject| self.people.get_mut(subject)) {
            person.push(sample);
        }
    }

    /// The end of the session ends all phases.
    fn phases_changed(&mut self, by: &Sample, out: &mut Outputs) {
        if out.phases().is_over() {
            self.end_phases(by.measured, out);
        }
    }

    fn push_late(&mut self, sample: &Sample, out: &mut Outputs) {
        self.push(sample, out);
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        let second = self.seconds.passed(now);
        for person in self.people.values_mut() {
            person.tick(now, second, out);
        }
        self.end_phases(Time::from_nanos(now.nanos().saturating_sub(SETTLED_NS)), out);
    }
}

impl InputExtractor {
    fn end_phases(&mut self, now: Time, out: &mut Outputs) {
        let phases = out.phases();
        for (subject, person) in &mut self.people {
            person.end_phases(phases.of(subject), now, out);
        }
    }
}

fn is_input(stream: &Stream) -> bool {
    stream.about == About::Person
        && !stream.id.is_empty()
        && stream.origin == Origin::Raw
        && stream.signal == Signal::Input
        && stream.shape == Shape::Event
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use teampulse_core::data::{Data, Event, EventKind, Reason};
    use teampulse_core::session_streams::{END, session_events};

    use super::*;
    use crate::drive::{Drive, built};

    const OUTPUT: &str = "/humans/persons/p1/input/w30";

    fn presses() -> Stream {
        let subject = Subject { about: About::Person, id: "p1".into() };
        let stream = Stream::raw("/humans/persons/p1/task/presses", subject, Shape::Event);
        Stream { signal: Signal::Input, ..stream }.with_channels(&[("reaction_time", "s")])
    }

    fn drive(stream: &Stream) -> Drive {
        Drive::new(built::<Input>("").as_ref(), stream)
    }

    fn press(reaction_secs: f64) -> Data {
        Data::Event(Arc::new(Event {
            kind: EventKind::Marker,
            label: "match".into(),
            value: reaction_secs,
            duration_secs: 0.0,
        }))
    }

    #[test]
    fn silence_is_a_rate_of_zero_once_the_window_is_full() {
        let mut drive = drive(&presses());
        drive.until(60.0);
        let windows = drive.features(OUTPUT);
        for (secs, values) in windows {
            let expected = if secs < 30.0 { Reason::Short } else { Reason::Ok };
            assert_eq!(values.reasons[0], expected, "{secs}");
            assert!(secs < 30.0 || (values.values[0] == 0.0 && values.values[1].is_nan()));
        }
    }

    #[test]
    fn presses_are_counted_and_their_reaction_times_averaged() {
        let mut drive = drive(&presses());
        for (place, reaction_secs) in [0.5, 0.7, f64::NAN].into_iter().enumerate() {
            drive.take(40.25 + place as f64, press(reaction_secs));
        }
        drive.until(45.0);
        let last = drive.last(OUTPUT);
        assert_eq!(last.values, [6.0, 0.6]);
    }

    #[test]
    fn two_presses_at_one_moment_are_two() {
        let mut drive = drive(&presses());
        drive.take(40.0, press(0.5));
        drive.take(40.0, press(0.5));
        drive.until(45.0);
        assert_eq!(drive.last(OUTPUT).values[0], 4.0);
    }

    #[test]
    fn only_numbers_in_seconds_are_reaction_times() {
        let mut drive = drive(&presses().with_channels(&[]));
        drive.take(40.0, press(3.0));
        drive.until(45.0);
        assert_eq!(drive.last(OUTPUT).reasons, [Reason::Ok, Reason::Missing]);
    }

    #[test]
    fn only_input_of_people_is_counted() {
        let feature = built::<Input>("");
        assert!(!feature.accepts(&Stream { shape: Shape::Sample, ..presses() }));
        for other in [
            Stream { signal: Signal::Event, ..presses() },
            Stream { about: About::Robot, ..presses() },
        ] {
            let (mut extractor, mut out) = (feature.start(&other), Outputs::new());
            extractor.join(StreamId(0), &other, &mut out);
            assert!(out.streams().is_empty());
        }
    }

    #[test]
    fn a_phase_is_reported_when_it_is_over_and_the_last_with_the_session() {
        let mut drive = drive(&presses());
        let events = StreamId(1);
        drive.join(events, &session_events());
        let happen = |kind, label: &str| {
            let (label, value, duration_secs) = (label.to_owned(), f64::NAN, f64::NAN);
            Data::Event(Arc::new(Event { kind, label, value, duration_secs }))
        };
        drive.take_on(events, 10.0, happen(EventKind::Phase, "baseline"));
        for secs in [12.0, 20.0, 38.0] {
            drive.take(secs, press(0.5));
        }
        drive.take_on(events, 40.0, happen(EventKind::Phase, "task"));
        drive.take(41.0, press(0.7));
        let windows = drive.features("/humans/persons/p1/input/phases");
        assert_eq!(windows.len(), 1);
        assert_eq!((windows[0].0, windows[0].1.window_secs), (40.0, 30.0));
        assert_eq!(windows[0].1.values, [6.0, 0.5]);
        drive.take_on(events, 60.0, happen(EventKind::Clock, END));
        assert_eq!(drive.last("/humans/persons/p1/input/phases").values, [3.0, 0.7]);
    }
}
