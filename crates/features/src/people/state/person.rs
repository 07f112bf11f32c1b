//! The state of one person.

use std::collections::BTreeMap;

use teampulse_core::data::FeatureValues;
use teampulse_core::feature::Outputs;
use teampulse_core::phases::{BASELINE, Phase};
use teampulse_core::stream::{Stream, StreamId, Subject, Window};
use teampulse_core::time::Time;

use super::track::Span;
use super::whole::Whole;
use super::windows::Windows;

/// A baseline is evaluated this long after its end: its last windows arrive a little later [ns].
const SETTLED_NS: i64 = 2_000_000_000;

/// The state of one person.
pub(super) struct Person {
    subject: Subject,
    /// The baseline whose windows are held.
    held: Option<Held>,
    windows: BTreeMap<Window, Windows>,
    whole: Whole,
}

/// A baseline whose windows are held.
struct Held {
    /// The index of the baseline's phase.
    number: usize,
    span: Span,
    is_judged: bool,
}

impl Person {
    pub(super) fn new(subject: Subject) -> Person {
        Person { subject, held: None, windows: BTreeMap::new(), whole: Whole::default() }
    }

    pub(super) fn subject(&self) -> &Subject {
        &self.subject
    }

    /// Adds a stream of windows or phases.
    pub(super) fn join(&mut self, id: StreamId, stream: &Stream, window: Window) {
        match window {
            Window::Phases => self.whole.join(id, stream),
            Window::Of(_) => self.windows.entry(window).or_default().join(id, stream),
        }
    }

    /// Takes in a window or a phase that a stream has finished.
    pub(super) fn take(&mut self, at: (StreamId, Time), window: Window, values: &FeatureValues) {
        let baseline = self.held.as_ref().map(|held| held.span);
        if window == Window::Phases {
            self.whole.take(at, values);
        } else if let Some(windows) = self.windows.get_mut(&window) {
            windows.take(at, values, baseline);
        }
    }

    /// Takes in a change of the person's phases.
    pub(super) fn heed(&mut self, phases: &[Phase]) {
        let Some(number) = phases.iter().rposition(|phase| phase.label == BASELINE) else { return };
        let span = (phases[number].begin, phases[number].end);
        match &mut self.held {
            Some(held) if held.number == number => held.span = span,
            _ => {
                self.windows.values_mut().for_each(Windows::begin_anew);
                self.held = Some(Held { number, span, is_judged: false });
            }
        }
    }

    /// Evaluates a baseline that is over, after its last windows have arrived; immediately at the end of a session.
    pub(super) fn judge(
        &mut self,
        phases: &[Phase],
        phases_from: &str,
        settled_by: Time,
        out: &mut Outputs,
    ) {
        let Some(held) = self.held.as_mut().filter(|held| !held.is_judged) else { return };
        let Some(end) = held.span.1.filter(|end| *end <= settled_by) else { return };
        held.is_judged = true;
        let phase = &phases[held.number];
        for windows in self.windows.values_mut() {
            windows.judge(&self.subject, (phase, end), phases_from, out);
        }
        let shortest =
            self.windows.values().min_by(|a, b| a.length_secs().total_cmp(&b.length_secs()));
        if let Some(shortest) = shortest {
            self.whole.judge((held.number, phase), shortest);
        }
    }

    /// Advances by a whole second.
    pub(super) fn report(
        &mut self,
        phases: &[Phase],
        phases_from: &str,
        (second, stale_secs): (Time, f64),
        out: &mut Outputs,
    ) {
        let settled_by = Time::from_nanos(second.nanos().saturating_sub(SETTLED_NS));
        self.judge(phases, phases_from, settled_by, out);
        self.windows.values().for_each(|windows| windows.report(second, stale_secs, out));
        self.report_phases(phases, phases_from, second, out);
    }

    /// Reports the phases that are over at `now`.
    pub(super) fn report_phases(
        &mut self,
        phases: &[Phase],
        phases_from: &str,
        now: Time,
        out: &mut Outputs,
    ) {
        self.whole.report((&self.subject, phases_from), phases, now, out);
    }
}
