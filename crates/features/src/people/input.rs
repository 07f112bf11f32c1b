//! How much a person does at keys, mice and controls.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::{Data, Reason};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs, Scope};
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::stream::{About, Origin, Shape, Signal, Stream, StreamId};
use teampulse_core::time::Time;
use teampulse_signal::estimate::Estimate;
use teampulse_signal::window::Window;

use crate::context::FeatureContext;
use crate::value::{Value, defined, window_of};
use crate::whole_seconds::WholeSeconds;
use crate::windows::window_name;

/// So many moments of a window are told apart; events at one moment are added up.
const MOST_MOMENTS: usize = 600;

/// How much a person does at keys, mice and controls.
///
/// - Measures: the events of all streams of a person whose signal is `input`, and the reaction time
///   where the numbers of the events are in seconds.
/// - Formula: `input_rate` is events over the length of the window; `reaction_time` is the mean of the
///   finite numbers of events, of the streams that declare theirs in s.
/// - Unit: 1/min, s.
/// - Window: `windows_secs`, once a second, from when the first such stream is known. Silence is a rate
///   of 0, not missing.
/// - Reference: none; counts.
/// - Limits: who has put the hands away and whose keyboard has come off are the same silence. Which key
///   it was is nowhere.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Input {
    /// The lengths of the windows [s]; without it those of the study.
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
        stream.about == About::Person
            && !stream.id.is_empty()
            && stream.origin == Origin::Raw
            && stream.signal == Signal::Input
            && stream.shape == Shape::Event
    }

    fn scope(&self) -> Scope {
        Scope::Subject
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        let window = |&secs: &f64| (secs, Window::new((secs * 1e9) as i64, MOST_MOMENTS));
        Box::new(Activity {
            windows: self.windows_secs.iter().map(window).collect(),
            outputs: Vec::new(),
            sources: Vec::new(),
            seconds: WholeSeconds::default(),
            begin: None,
        })
    }
}

/// What a person did, in windows of several lengths.
struct Activity {
    windows: Vec<(f64, Window<Deeds>)>,
    outputs: Vec<OutputId>,
    sources: Vec<Source>,
    seconds: WholeSeconds,
    /// When this was first looked at.
    begin: Option<Time>,
}

/// A stream of events.
struct Source {
    id: StreamId,
    name: String,
    /// Whether the numbers of its events are reaction times.
    is_timed: bool,
}

/// What was done at one moment.
#[derive(Clone, Copy, Debug, Default)]
struct Deeds {
    count: u32,
    timed: u32,
    reaction_secs: f64,
}

impl Extractor for Activity {
    fn join(&mut self, id: StreamId, stream: &Stream, out: &mut Outputs) {
        let is_timed = stream.units.first().is_some_and(|unit| unit == "s");
        let source = Source { id, name: stream.name.clone(), is_timed };
        match self.sources.iter_mut().find(|known| known.id == id) {
            Some(known) => *known = source,
            None => self.sources.push(source),
        }
        let declare = |(secs, _): &(f64, _)| out.declare(self.output(stream, *secs));
        self.outputs = self.windows.iter().map(declare).collect();
    }

    fn push(&mut self, sample: &Sample, _: &mut Outputs) {
        let Data::Event(event) = &sample.data else { return };
        let known = self.sources.iter().find(|source| source.id == sample.stream);
        let is_timed = known.is_some_and(|source| source.is_timed) && event.value.is_finite();
        let (timed, reaction_secs) = if is_timed { (1, event.value) } else { (0, 0.0) };
        let deed = Deeds { count: 1, timed, reaction_secs };
        for (_, window) in &mut self.windows {
            window.insert_merged(sample.measured.nanos(), deed, Deeds::add);
        }
    }

    fn push_late(&mut self, sample: &Sample, out: &mut Outputs) {
        self.push(sample, out);
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        let begin = *self.begin.get_or_insert(now);
        let Some(end) = self.seconds.passed(now) else { return };
        for ((secs, window), output) in self.windows.iter_mut().zip(&self.outputs) {
            window.advance(end.nanos());
            let is_full = end.secs_since(begin) >= *secs;
            out.emit(*output, end, summary(window, *secs, is_full));
        }
    }
}

impl Activity {
    fn output(&self, stream: &Stream, secs: f64) -> Stream {
        let name = format!("/humans/persons/{}/input/{}", stream.id, window_name(secs));
        let output = Stream::raw(name, stream.subject(), Shape::Feature);
        Stream {
            signal: Signal::Input,
            origin: Origin::Derived,
            inputs: self.sources.iter().map(|source| source.name.clone()).collect(),
            rate_hz: 1.0,
            method: format!(
                "windows of {secs} s; input_rate: events over length, 0 in silence; reaction_time: \
                 mean of the finite numbers of events that are in s"
            ),
            doc: format!("How much {} does at keys, mice and controls.", stream.id),
            ..output.with_channels(&[("input_rate", "1/min"), ("reaction_time", "s")])
        }
    }
}

impl Deeds {
    fn add(&mut self, other: Deeds) {
        self.count += other.count;
        self.timed += other.timed;
        self.reaction_secs += other.reaction_secs;
    }
}

fn summary(window: &Window<Deeds>, secs: f64, is_full: bool) -> Data {
    let mut all = Deeds::default();
    window.iter().for_each(|(_, deeds)| all.add(*deeds));
    let values: [Value; 2] = if is_full {
        let rate_per_min = f64::from(all.count) * 60.0 / secs;
        let reaction_secs = all.reaction_secs / f64::from(all.timed);
        let reaction = if all.timed == 0 {
            Err(Reason::Missing)
        } else {
            defined(Some(Estimate::unstated(reaction_secs)))
        };
        [Ok(Estimate::unstated(rate_per_min)), reaction]
    } else {
        [Err(Reason::Short); 2]
    };
    window_of(secs, if is_full { 1.0 } else { 0.0 }, 1.0, &values)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use teampulse_core::data::{Event, EventKind};
    use teampulse_core::stream::Subject;

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
        let told = drive.features(OUTPUT);
        for (secs, values) in told {
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
    fn numbers_that_are_no_seconds_are_no_reaction_times() {
        let mut drive = drive(&presses().with_channels(&[]));
        drive.take(40.0, press(3.0));
        drive.until(45.0);
        assert_eq!(drive.last(OUTPUT).reasons, [Reason::Ok, Reason::Missing]);
    }

    #[test]
    fn only_input_of_people_is_accepted() {
        let feature = built::<Input>("");
        assert!(!feature.accepts(&Stream { signal: Signal::Event, ..presses() }));
        assert!(!feature.accepts(&Stream { about: About::Robot, ..presses() }));
        assert!(!feature.accepts(&Stream { shape: Shape::Sample, ..presses() }));
    }
}
