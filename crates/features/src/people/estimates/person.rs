//! The estimates about one person.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use teampulse_core::data::{Data, Event, EventKind, FeatureValues};
use teampulse_core::feature::{OutputId, Outputs};
use teampulse_core::phases::Phase;
use teampulse_core::reports::Isa;
use teampulse_core::stream::{Stream, Subject, Window};
use teampulse_core::time::Time;

use super::combined::combined;
use super::output;
use super::physiology::{Physiology, Reading, without_state};
use super::reports::{JUST_ENDED_NS, Reports, Stretch};
use crate::people::state::measures_of;
use crate::value::{Value, moment, window_of};

/// How long after its end a phase waits for reports about it [ns]: as long as they are accepted, plus their transit
/// time.
const LISTENING_NS: i64 = JUST_ENDED_NS + 1_000_000_000;
/// The latest time after its end at which a phase is reported [ns]: its state takes up to 12 s.
const PATIENCE_NS: i64 = JUST_ENDED_NS + 5_000_000_000;

/// The number of newest phases that are held.
const MOST_PHASES: usize = 8;

/// The state of one person.
pub(super) struct Person {
    subject: Subject,
    /// The time after which the variance of a report has doubled [s].
    doubled_secs: f64,
    reports: Reports,
    /// Whether a fault about a report off the scale was published.
    is_off_scale_reported: bool,
    /// The streams of the reports and phases so far.
    of_stream: BTreeSet<String>,
    /// Whether measures of the body are present, with or without a state.
    measured: BTreeSet<&'static str>,
    states: BTreeMap<Window, State>,
    outputs: BTreeMap<Window, Output>,
    /// The index of the first phase that is not finished.
    next: usize,
}

/// A stream of states.
struct State {
    name: String,
    reading: Reading,
    /// The physiological estimates of the newest phases, by their ends.
    phases: VecDeque<(Time, Physiology)>,
}

/// An output, the inputs with which it was declared, and the end of its last value.
struct Output {
    id: OutputId,
    inputs: BTreeSet<String>,
    until: Time,
}

impl Person {
    pub(super) fn new(subject: Subject, doubled_secs: f64) -> Person {
        Person {
            subject,
            doubled_secs,
            reports: Reports::default(),
            is_off_scale_reported: false,
            of_stream: BTreeSet::new(),
            measured: BTreeSet::new(),
            states: BTreeMap::new(),
            outputs: BTreeMap::new(),
            next: 0,
        }
    }

    pub(super) fn subject(&self) -> &Subject {
        &self.subject
    }

    /// Notes that a stream contains windows of the person.
    pub(super) fn measure(&mut self, stream: &Stream) {
        self.measured.extend(measures_of(stream));
    }

    /// Notes that a stream contains states over these windows.
    pub(super) fn join(&mut self, stream: &Stream, window: Window) {
        let known = self.states.remove(&window);
        let phases = known.map_or_else(VecDeque::new, |known| known.phases);
        let state = State { name: stream.name.clone(), reading: Reading::of(stream), phases };
        self.states.insert(window, state);
    }

    /// Takes in an event that may be a report; the first one off the scale is published as a fault.
    pub(super) fn hear(&mut self, at: Time, event: &Event, stream: &str, out: &mut Outputs) {
        if self.reports.take(at, event) {
            self.of_stream.insert(stream.to_owned());
        } else if Isa::read(event).is_some()
            && !std::mem::replace(&mut self.is_off_scale_reported, true)
        {
            let output = out.declare(output::faults(&self.subject, stream));
            let label = output::off_scale(event.value);
            out.emit(output, at, Data::Event(Arc::new(moment(EventKind::Fault, label))));
        }
    }

    /// Notes that phases were published on a stream.
    pub(super) fn heed(&mut self, stream: &str) {
        self.of_stream.insert(stream.to_owned());
    }

    /// Takes in a state; for a window, the estimate follows at once.
    pub(super) fn take(
        &mut self,
        (over, end): (Window, Time),
        values: &FeatureValues,
        phases: &[Phase],
        out: &mut Outputs,
    ) {
        let Some(state) = self.states.get_mut(&over) else { return };
        if over == Window::Phases {
            // The scatter of a phase is contained in its sigma.
            state.phases.push_back((end, state.reading.read(values, 0.0)));
            if state.phases.len() > MOST_PHASES {
                state.phases.pop_front();
            }
            return;
        }
        let body = state.reading.read(values, 1.0);
        let window = before(end, values.window_secs);
        let report = self.reports.of_window(window, phases, self.doubled_secs);
        self.emit(over, window, (body, report), out);
    }

    /// Advances by a whole second: where only reports are known, the estimate follows from them.
    pub(super) fn report(
        &mut self,
        second: Time,
        windows: &[(Window, f64)],
        phases: &[Phase],
        out: &mut Outputs,
    ) {
        if !self.reports.is_empty() {
            for (over, secs) in windows {
                if !self.states.contains_key(over) {
                    let window = before(second, *secs);
                    let report = self.reports.of_window(window, phases, self.doubled_secs);
                    self.emit(*over, window, (without_state(&self.measured), report), out);
                }
            }
        }
        self.report_phases(second, false, phases, out);
    }

    /// Reports the phases that are over at `now`, as soon as all their inputs are known.
    pub(super) fn report_phases(
        &mut self,
        now: Time,
        is_last: bool,
        phases: &[Phase],
        out: &mut Outputs,
    ) {
        while let Some(phase) = phases.get(self.next) {
            let Some(end) = phase.end.filter(|end| *end <= now) else { return };
            let stretch = Stretch { begin: phase.begin, end };
            let mut body =
                self.states.get(&Window::Phases).into_iter().flat_map(|state| &state.phases);
            let body = body.find(|(at, _)| *at == end).map(|(_, body)| *body);
            let report = self.reports.of_phase(stretch, phases, self.doubled_secs);
            let since_ns = now.nanos_since(end);
            // A newer report may come, even where there is one already.
            let is_known = body.is_some() && (since_ns >= LISTENING_NS || is_last);
            let is_late = since_ns >= PATIENCE_NS;
            if !(is_known || is_late || is_last && self.states.is_empty()) {
                return;
            }
            self.next += 1;
            if body.is_some() || report.is_ok() {
                let body = body.unwrap_or_else(|| without_state(&self.measured));
                self.emit(Window::Phases, stretch, (body, report), out);
            }
        }
    }

    fn emit(
        &mut self,
        window: Window,
        over: Stretch,
        (body, report): (Physiology, Value),
        out: &mut Outputs,
    ) {
        let output = self.declare(window, out);
        if over.end <= output.until {
            return;
        }
        output.until = over.end;
        let values = [combined(body.workload, report), body.workload, report, body.arousal];
        let secs = over.end.secs_since(over.begin);
        out.emit(output.id, over.end, window_of(secs, body.coverage, body.quality, &values));
    }

    /// The output over these windows, declared with all its present inputs.
    fn declare(&mut self, window: Window, out: &mut Outputs) -> &mut Output {
        let state = self.states.get(&window).map(|state| &state.name);
        let count = self.of_stream.len() + usize::from(state.is_some());
        let known = self.outputs.get(&window);
        if known.is_none_or(|known| known.inputs.len() != count) {
            let until = known.map_or(Time::from_nanos(i64::MIN), |known| known.until);
            let inputs: BTreeSet<String> = self.of_stream.iter().chain(state).cloned().collect();
            let id =
                out.declare(output::estimates(&self.subject, window, &inputs, self.doubled_secs));
            self.outputs.insert(window, Output { id, inputs, until });
        }
        self.outputs.get_mut(&window).expect("it has just been declared")
    }
}

/// The stretch of a length [s] up to a time.
fn before(end: Time, secs: f64) -> Stretch {
    Stretch { begin: end - Duration::try_from_secs_f64(secs).unwrap_or_default(), end }
}
