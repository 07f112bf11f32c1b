//! The input of one person, in windows and over phases.

use std::collections::VecDeque;

use teampulse_core::data::{Data, Reason};
use teampulse_core::feature::{OutputId, Outputs};
use teampulse_core::phases::Phase;
use teampulse_core::sample::Sample;
use teampulse_core::stream::{Shape, Signal, Stream, StreamId, Window};
use teampulse_core::time::Time;
use teampulse_signal::analysis::LONGEST_HELD_NS;
use teampulse_signal::estimate::Estimate;
use teampulse_signal::window;

use crate::over::{OVER_PHASES, ReportedPhases, measured_span};
use crate::value::{Value, defined, window_of};

/// The most distinct times in a window that are counted separately; events at the same time are added up.
const MOST_MOMENTS: usize = 600;
/// The most events of a phase that are kept.
const MOST_OF_PHASE: usize = 20_000;

/// The input of a person, in windows of several lengths and in the present phase.
pub(super) struct Activity {
    windows: Vec<(f64, window::Window<Deeds>)>,
    outputs: Vec<OutputId>,
    sources: Vec<Source>,
    /// The stream that was declared last, from which all outputs are derived.
    stream: Option<Stream>,
    /// When the first stream of input was declared.
    begin: Option<Time>,
    /// Input since the start of the next phase to be reported, in the order of arrival.
    of_phase: VecDeque<(Time, Deeds)>,
    reported_phases: ReportedPhases,
}

/// A stream of events.
struct Source {
    id: StreamId,
    name: String,
    /// Whether the numbers of its events are reaction times.
    is_timed: bool,
}

/// The input at one time.
#[derive(Clone, Copy, Debug, Default)]
struct Deeds {
    count: u32,
    timed: u32,
    reaction_secs: f64,
}

impl Activity {
    pub(super) fn new(windows_secs: &[f64]) -> Activity {
        let window = |&secs: &f64| (secs, window::Window::new((secs * 1e9) as i64, MOST_MOMENTS));
        Activity {
            windows: windows_secs.iter().map(window).collect(),
            outputs: Vec::new(),
            sources: Vec::new(),
            stream: None,
            begin: None,
            of_phase: VecDeque::new(),
            reported_phases: ReportedPhases::default(),
        }
    }

    pub(super) fn join(&mut self, id: StreamId, stream: &Stream, out: &mut Outputs) {
        let is_timed = stream.channels.first().is_some_and(|channel| channel.unit == "s");
        let source = Source { id, name: stream.name.clone(), is_timed };
        match self.sources.iter_mut().find(|known| known.id == id) {
            Some(known) => *known = source,
            None => self.sources.push(source),
        }
        let declare = |(secs, _): &(f64, _)| out.declare(self.window(stream, *secs));
        self.outputs = self.windows.iter().map(declare).collect();
        self.stream = Some(stream.clone());
    }

    pub(super) fn push(&mut self, sample: &Sample) {
        let Data::Event(event) = &sample.data else { return };
        let known = self.sources.iter().find(|source| source.id == sample.stream);
        let is_timed = known.is_some_and(|source| source.is_timed) && event.value.is_finite();
        let (timed, reaction_secs) = if is_timed { (1, event.value) } else { (0, 0.0) };
        let deed = Deeds { count: 1, timed, reaction_secs };
        for (_, window) in &mut self.windows {
            window.insert_merged(sample.measured.nanos(), deed, Deeds::add);
        }
        if self.of_phase.len() == MOST_OF_PHASE {
            self.of_phase.pop_front();
        }
        self.of_phase.push_back((sample.measured, deed));
    }

    /// Reports windows at a whole `second` that has passed.
    pub(super) fn tick(&mut self, now: Time, second: Option<Time>, out: &mut Outputs) {
        let begin = *self.begin.get_or_insert(now);
        let Some(end) = second else { return };
        let unreacted = self.unreacted();
        for ((secs, window), output) in self.windows.iter_mut().zip(&self.outputs) {
            window.advance(end.nanos());
            let is_full = end.secs_since(begin) >= *secs;
            let deeds = window.iter().map(|(_, deeds)| deeds);
            out.emit(*output, end, summary(deeds, *secs, is_full, unreacted));
        }
    }

    /// Reports the phases that are over at `now`, and keeps the events that the next one needs.
    pub(super) fn end_phases(&mut self, phases: &[Phase], now: Time, out: &mut Outputs) {
        while let Some(phase) = self.reported_phases.next_over(phases, now.nanos()) {
            self.report_phase(phase, out);
        }
        let held_ns = now.nanos().saturating_sub(LONGEST_HELD_NS);
        let next_ns =
            self.reported_phases.next_begin_ns(phases).unwrap_or(now.nanos()).max(held_ns);
        while self.of_phase.front().is_some_and(|(at, _)| at.nanos() < next_ns) {
            self.of_phase.pop_front();
        }
    }

    fn report_phase(&self, phase: &Phase, out: &mut Outputs) {
        let (Some(stream), Some(since)) = (&self.stream, self.begin) else { return };
        let Some(span) = measured_span(phase, since.nanos(), i64::MIN) else { return };
        let inside = self.of_phase.iter().filter(|(at, _)| span.holds(at.nanos()));
        let deeds = inside.map(|(_, deeds)| deeds);
        let unseen_ns = since.nanos().saturating_sub(span.begin_ns);
        let is_full = unseen_ns as f64 / 1e9 < span.secs() / 2.0;
        let output = out.declare(self.output(stream, Window::Phases, OVER_PHASES));
        let data = summary(deeds, span.secs(), is_full, self.unreacted());
        out.emit(output, Time::from_nanos(span.end_ns), data);
    }

    /// The reason for a missing reaction time if there was no reaction.
    fn unreacted(&self) -> Reason {
        let is_timed = self.sources.iter().any(|source| source.is_timed);
        if is_timed { Reason::Nothing } else { Reason::Missing }
    }

    fn window(&self, stream: &Stream, secs: f64) -> Stream {
        let over = format!("windows of {secs} s");
        Stream { rate_hz: 1.0, ..self.output(stream, Window::of_secs(secs), &over) }
    }

    fn output(&self, stream: &Stream, window: Window, over: &str) -> Stream {
        let name = format!("/humans/persons/{}/input", stream.id);
        let output =
            Stream::concluded(name, stream.subject(), "input", Shape::Feature).over(window);
        Stream {
            signal: Signal::Input,
            inputs: self.sources.iter().map(|source| source.name.clone()).collect(),
            method: format!(
                "{over}; input_rate: events over length, 0 in silence; reaction_time: \
                 mean of the finite numbers of events that are in s"
            ),
            doc: format!(
                "How often {} uses keyboard, mouse and other controls, with reaction times.",
                stream.id
            ),
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

/// The values of a window or phase; `unreacted` is the reason for a missing reaction time if there was no reaction.
fn summary<'a>(
    deeds: impl Iterator<Item = &'a Deeds>,
    secs: f64,
    is_full: bool,
    unreacted: Reason,
) -> Data {
    let mut all = Deeds::default();
    deeds.for_each(|deeds| all.add(*deeds));
    let values: [Value; 2] = if is_full {
        let rate_per_min = f64::from(all.count) * 60.0 / secs;
        let reaction_secs = all.reaction_secs / f64::from(all.timed);
        let reaction = if all.timed == 0 {
            Err(unreacted)
        } else {
            defined(Some(Estimate::unstated(reaction_secs)))
        };
        [Ok(Estimate::unstated(rate_per_min)), reaction]
    } else {
        [Err(Reason::Short); 2]
    };
    window_of(secs, if is_full { 1.0 } else { 0.0 }, 1.0, &values)
}
