//! Interventions: how often people command robots.

use std::collections::BTreeMap;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::{Data, Event, EventKind, Reason};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs, Scope};
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::session_streams::{END, session_events};
use teampulse_core::stream::{About, Origin, Shape, Signal, Stream, StreamId, Subject, Window};
use teampulse_core::time::Time;
use teampulse_signal::estimate::Estimate;

use crate::context::{FeatureContext, duration_setting};
use crate::inputs::Inputs;
use crate::value::{Value, window_of};
use crate::whole_seconds::WholeSeconds;

/// The stream of interventions.
const NAME: &str = "/team/interventions";
/// The family of the streams of interventions.
const FAMILY: &str = "interventions";
/// The share of a window that must have been recorded before a rate is given.
const LEAST_WATCHED: f64 = 0.5;

/// Interventions: how often people command robots.
///
/// - Measures: each intervention (as an event at its start, reported when it is over; its value is the
///   number of its messages), and for each window how often people intervened, how many robots they
///   commanded, and the time since the last intervention.
/// - Formula: messages of one topic that are at most `pause_secs` apart are one intervention, so that
///   driving a robot by hand at 20 Hz is one, not twenty a second. Rate is the number of those that began in the
///   window, divided by its length.
/// - Unit: 1/min, 1, s.
/// - Window: `windows_secs`, once a second.
/// - Reference: Steinfeld et al. (2006), "Common metrics for human-robot interaction",
///   doi:10.1145/1121241.1121249; the time since the last one is the neglect time of Olsen & Wood (2004),
///   doi:10.1145/985692.985722, of the team as a whole.
/// - Limits: only topics that the study names in `commands` of its robots are read. Whether a robot obeyed
///   is not checked, and who sent the command is not known. A message that arrives after its intervention is over is
///   ignored.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Interventions {
    /// The lengths of the windows [s]; by default the study's.
    pub windows_secs: Option<Vec<f64>>,
    /// The longest pause within one intervention [s].
    pub pause_secs: f64,
}

impl Default for Interventions {
    fn default() -> Interventions {
        Interventions { windows_secs: None, pause_secs: 2.0 }
    }
}

impl Component<dyn Feature, FeatureContext> for Interventions {
    const EXAMPLE: &'static str = "pause_secs = 2";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        let pause_secs = duration_setting("pause_secs", self.pause_secs)?;
        let windows_secs = context.windows_or(self.windows_secs)?;
        Ok(Box::new(Steps { pause_ns: (pause_secs * 1e9) as i64, windows_secs }))
    }
}

/// Whether people command a robot on this stream.
pub(super) fn is_command(stream: &Stream) -> bool {
    stream.about == About::Robot
        && stream.origin == Origin::Raw
        && stream.signal == Signal::Input
        && !stream.id.is_empty()
}

struct Steps {
    pause_ns: i64,
    windows_secs: Vec<f64>,
}

impl Feature for Steps {
    fn accepts(&self, stream: &Stream) -> bool {
        is_command(stream) || contains_end(stream)
    }

    fn scope(&self) -> Scope {
        Scope::Session
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        let longest_secs = self.windows_secs.last().copied().unwrap_or_default();
        Box::new(InterventionsExtractor {
            pause_ns: self.pause_ns,
            lengths_secs: self.windows_secs.clone(),
            longest_ns: (longest_secs * 1e9) as i64,
            topics: BTreeMap::new(),
            begun: Vec::new(),
            commanded: BTreeMap::new(),
            inputs: Inputs::default(),
            outputs: None,
            seconds: WholeSeconds::default(),
            since: None,
        })
    }
}

/// Whether the end of the session is published on this stream.
fn contains_end(stream: &Stream) -> bool {
    stream.name == session_events().name && stream.origin == Origin::Raw
}

struct InterventionsExtractor {
    pause_ns: i64,
    lengths_secs: Vec<f64>,
    longest_ns: i64,
    topics: BTreeMap<StreamId, Topic>,
    /// When the interventions in the longest window began.
    begun: Vec<Time>,
    /// When each robot was last commanded.
    commanded: BTreeMap<String, Time>,
    inputs: Inputs,
    outputs: Option<(OutputId, Vec<OutputId>)>,
    seconds: WholeSeconds,
    /// The start of the recording.
    since: Option<Time>,
}

/// A topic on which people command a robot.
struct Topic {
    robot: String,
    label: String,
    run: Option<Run>,
}

/// Messages of a topic in close succession: an intervention that may continue.
#[derive(Clone, Copy)]
struct Run {
    begin: Time,
    last: Time,
    last_arrival: Time,
    count: u32,
}

impl Extractor for InterventionsExtractor {
    fn join(&mut self, id: StreamId, stream: &Stream, out: &mut Outputs) {
        if !is_command(stream) {
            return;
        }
        self.topics.entry(id).or_insert_with(|| Topic::of(stream));
        self.inputs.join(stream);
        if self.outputs.is_none() {
            self.declare(out);
        }
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        if self.topics.contains_key(&sample.stream) {
            self.take(sample, out);
        } else if is_end(&sample.data) {
            self.finish(out, |_| true);
        }
    }

    fn push_late(&mut self, sample: &Sample, _: &mut Outputs) {
        let topic = self.topics.get_mut(&sample.stream);
        if let Some(run) = topic.and_then(|topic| topic.run.as_mut()) {
            run.goes_on(sample, self.pause_ns);
        }
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        self.since.get_or_insert(now);
        let pause_ns = self.pause_ns;
        self.finish(out, |run| now.nanos_since(run.last_arrival) > pause_ns);
        if let Some(second) = self.seconds.passed(now) {
            self.declare(out);
            self.report_windows(second, out);
        }
    }
}

impl InterventionsExtractor {
    fn take(&mut self, sample: &Sample, out: &mut Outputs) {
        let Some(topic) = self.topics.get_mut(&sample.stream) else { return };
        let commanded = self.commanded.entry(topic.robot.clone()).or_insert(sample.measured);
        *commanded = sample.measured.max(*commanded);
        if topic.run.as_mut().is_some_and(|run| run.goes_on(sample, self.pause_ns)) {
            return;
        }
        let over = topic.run.replace(Run::begun(sample));
        self.begun.push(sample.measured);
        if let (Some(run), Some((events, _))) = (over, &self.outputs) {
            out.emit(*events, run.begin, topic.reported(run));
        }
    }

    /// Reports the interventions that are over.
    fn finish(&mut self, out: &mut Outputs, is_over: impl Fn(&Run) -> bool) {
        let Some((events, _)) = &self.outputs else { return };
        for topic in self.topics.values_mut() {
            if let Some(run) = topic.run.take_if(|run| is_over(run)) {
                out.emit(*events, run.begin, topic.reported(run));
            }
        }
    }

    fn report_windows(&mut self, end: Time, out: &mut Outputs) {
        let (Some((_, windows)), Some(since)) = (&self.outputs, self.since) else { return };
        self.begun.retain(|begin| end.nanos_since(*begin) < self.longest_ns);
        let watched_secs = end.secs_since(since);
        for (secs, output) in self.lengths_secs.iter().zip(windows) {
            let coverage = (watched_secs / secs).clamp(0.0, 1.0);
            out.emit(
                *output,
                end,
                window_of(*secs, coverage, 1.0, &self.values(end, *secs, coverage)),
            );
        }
    }

    /// Interventions per minute, robots that were commanded, and time since the last command [s].
    fn values(&self, end: Time, secs: f64, coverage: f64) -> [Value; 3] {
        let is_within = |at: &&Time| (0.0..secs).contains(&end.secs_since(**at));
        let count = |times: &mut dyn Iterator<Item = &Time>| times.filter(is_within).count() as f64;
        let began = count(&mut self.begun.iter());
        let robots = count(&mut self.commanded.values());
        let watched = |value: f64| {
            let is_enough = coverage >= LEAST_WATCHED;
            is_enough.then(|| Estimate::unstated(value)).ok_or(Reason::Short)
        };
        let last = self.commanded.values().max();
        let since_last = |last: &Time| Estimate::unstated(end.secs_since(*last).max(0.0));
        [
            watched(60.0 * began / (secs * coverage.max(LEAST_WATCHED))),
            watched(robots),
            last.map(since_last).ok_or(Reason::Nothing),
        ]
    }

    fn declare(&mut self, out: &mut Outputs) {
        let Some(inputs) = self.inputs.take_news() else { return };
        let events = out.declare(events_stream(&inputs, self.pause_ns));
        let window = |secs: &f64| out.declare(window_stream(&inputs, *secs));
        self.outputs = Some((events, self.lengths_secs.iter().map(window).collect()));
    }
}

impl Topic {
    fn of(stream: &Stream) -> Topic {
        let label = format!("{} {}", stream.id, stream.subject().within(&stream.name));
        Topic { robot: stream.id.clone(), label, run: None }
    }

    fn reported(&self, run: Run) -> Data {
        Data::Event(Arc::new(Event {
            kind: EventKind::Intervention,
            label: self.label.clone(),
            value: f64::from(run.count),
            duration_secs: run.last.secs_since(run.begin),
        }))
    }
}

impl Run {
    fn begun(sample: &Sample) -> Run {
        let (begin, last_arrival) = (sample.measured, sample.log_time);
        Run { begin, last: begin, last_arrival, count: 1 }
    }

    /// Takes in a message; returns whether it belongs to the same intervention.
    fn goes_on(&mut self, sample: &Sample, pause_ns: i64) -> bool {
        let measured = sample.measured;
        let is_same = measured.nanos_since(self.last) <= pause_ns
            && self.begin.nanos_since(measured) <= pause_ns;
        if is_same {
            self.begin = self.begin.min(measured);
            self.last = self.last.max(measured);
            self.last_arrival = sample.log_time;
            self.count += 1;
        }
        is_same
    }
}

fn is_end(data: &Data) -> bool {
    matches!(data, Data::Event(event) if event.kind == EventKind::Clock && event.label == END)
}

fn events_stream(inputs: &[String], pause_ns: i64) -> Stream {
    Stream {
        signal: Signal::Event,
        inputs: inputs.to_vec(),
        method: format!(
            "messages of one topic at most {} s apart are one intervention",
            pause_ns as f64 / 1e9
        ),
        doc: "When people commanded robots; the value is the number of messages.".to_owned(),
        ..Stream::concluded(NAME, Subject::team(), FAMILY, Shape::Event)
    }
}

fn window_stream(inputs: &[String], secs: f64) -> Stream {
    let channels =
        [("interventions_per_min", "1/min"), ("robots_commanded", "1"), ("since_last_secs", "s")];
    Stream {
        inputs: inputs.to_vec(),
        rate_hz: 1.0,
        method: format!(
            "number of interventions that began in a window of {secs} s, divided by its length; number of robots \
             commanded in the window; time since the last command"
        ),
        doc: format!("How often people commanded robots in the last {secs} s."),
        ..Stream::concluded(NAME, Subject::team(), FAMILY, Shape::Feature)
            .over(Window::of_secs(secs))
            .with_channels(&channels)
    }
}

#[cfg(test)]
mod tests;
