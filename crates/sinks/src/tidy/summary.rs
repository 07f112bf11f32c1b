//! The usable part of a session, on one page.

mod page;
mod table;
mod usable;
mod alerts;
mod faults;
mod stream_summary;
mod rates;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use teampulse_core::alerts::{Alert, holds_alerts};
use teampulse_core::computers::UNTOLD;
use teampulse_core::data::{Data, Event, EventKind, FeatureValues, Reason};
use teampulse_core::loss::Loss;
use teampulse_core::reports::{Isa, Noting};
use teampulse_core::sample::Record;
use teampulse_core::session_streams::SESSION_EVENTS;
use teampulse_core::status::StreamStatus;
use teampulse_core::stream::{About, Origin, Shape, Signal, Stream, Subject};
use teampulse_core::streams::Streams;

use self::alerts::AlertCounts;
use self::faults::FaultCounts;
use self::page::Page;
pub use self::page::{LOST_OR_WRONG, NOTHING_NOTICED};
use self::stream_summary::StreamSummary;
use self::usable::usable_share;
use super::features::Window;
use super::file::{Unwritten, write};
use super::intervals::Kept;
use super::measures::{is_of_phases, is_of_statistics};
use super::timeline::{Timeline, is_self_report};

/// The name of the file.
pub(super) const NAME: &str = "summary.md";
/// The coverage from which a window has a value, unless it is too short [0..1].
const ENOUGH: f32 = 0.5;

/// The content of the page, collected during the session.
#[derive(Debug, Default)]
pub(super) struct Summary {
    /// The streams with a health status, by subject and name.
    watched: BTreeMap<(Subject, String), StreamSummary>,
    /// The feature whose windows judge each raw stream, by the name of the raw stream.
    judges: BTreeMap<String, Arc<Stream>>,
    /// The faults, with their times and counts.
    faults: FaultCounts,
    /// The alerts, with their counts and durations.
    alerts: AlertCounts,
    counts: Counts,
    /// What was lost to damage in the underlying recording.
    pub(super) damage: Option<String>,
}

/// The numbers of events of each kind.
#[derive(Debug, Default)]
struct Counts {
    /// Markers among the session's own events.
    markers: u64,
    /// Markers of wearables, files and other programs.
    other_markers: u64,
    /// Reports with a number, or of the Instantaneous Self-Assessment.
    reports: u64,
    /// Reports in words, without a number.
    notes: u64,
    /// The numbers of unused reports: about an unknown person, not a number, or off their scale.
    about_nobody: u64,
    no_number: u64,
    off_scale: u64,
    interventions: u64,
}

impl Summary {
    pub(super) fn take(&mut self, record: &Record, timeline: &Timeline, streams: &Streams) {
        match &record.sample.data {
            Data::Description(stream) => self.describe(stream),
            Data::Status(status) => self.take_status(status, timeline, streams),
            Data::Feature(values) => self.take_window(record, values, timeline, streams),
            Data::Event(event) => self.take_event(record, event, timeline),
            _ => {}
        }
    }

    #[cfg(test)]
    pub(super) fn is_judged_by(&self, stream: &str, feature: &str) -> bool {
        self.judges.get(stream).is_some_and(|judge| judge.name == feature)
    }

    /// Whether there was neither a stream with a rate nor an event of a person or a robot.
    fn is_empty(&self) -> bool {
        let Counts { markers, other_markers, reports, notes, interventions, .. } = self.counts;
        let events = markers + other_markers + reports + notes + interventions;
        self.watched.is_empty() && events == 0
    }

    /// Writes the page.
    pub(super) fn finish(
        &self,
        (folder, session): (&Path, &str),
        timeline: &Timeline,
        intervals: &[Kept],
    ) -> Result<(), Unwritten> {
        let path = folder.join(NAME);
        let page = Page { folder, session, timeline, summary: self, intervals };
        write(&path, page.to_string())
    }

    /// Chooses the feature that judges a raw stream: the first one that is computed from it. Statistics, which know
    /// nothing about the signal, judge a stream only if it has no other feature.
    fn describe(&mut self, stream: &Arc<Stream>) {
        if let (Shape::Feature, Some(input)) = (&stream.shape, stream.input())
            && !is_of_phases(stream)
        {
            let judge = self.judges.entry(input.to_owned()).or_insert_with(|| Arc::clone(stream));
            if is_of_statistics(judge) && !is_of_statistics(stream) {
                judge.clone_from(stream);
            }
        }
    }

    fn take_status(&mut self, status: &StreamStatus, timeline: &Timeline, streams: &Streams) {
        let Some(stream) = raw(streams, &status.name) else { return };
        let subject = stream.subject();
        let phase = timeline.section(&subject, timeline.now()).phase;
        let key = (subject.clone(), status.name.clone());
        let watched = self.watched.entry(key).or_default();
        watched.take_status(status);
        if !stream.is_irregular() {
            watched.take_state(status.state, phase);
        }
    }

    fn take_window(
        &mut self,
        record: &Record,
        values: &FeatureValues,
        timeline: &Timeline,
        streams: &Streams,
    ) {
        let of = &record.stream;
        let is_phase = is_of_phases(&record.stream);
        let judge = of.inputs.first().and_then(|input| self.judges.get(input));
        let is_judge = judge.is_some_and(|judge| {
            let is_alike = judge.windowless_name() == of.windowless_name();
            judge.name == of.name || is_phase && is_alike
        });
        let is_coverage = is_phase && is_of_statistics(of);
        if !(is_judge || is_coverage) {
            return;
        }
        let Some(stream) = of.inputs.first().and_then(|input| raw(streams, input)) else { return };
        let window = Window::of(record.sample.measured, values);
        // Windows of a stream that is reported on change are mostly empty.
        if !window.is_after(timeline.began()) || stream.is_reported_on_change() {
            return;
        }
        let subject = stream.subject();
        let section = timeline.section(&subject, window.middle());
        let watched = self.watched.entry((subject, stream.name.clone())).or_default();
        let (worth, secs) = (usable_share(of, values), values.window_secs);
        // Values of a long phase are those of its last part.
        if is_phase && !section.is_covered_by(secs, timeline.now()) {
            return;
        }
        match section.phase {
            Some(phase) if is_phase && !is_judge => {
                watched.take_coverage(f64::from(values.coverage), secs, phase);
            }
            _ if is_too_short(values) => {}
            Some(phase) if is_phase => watched.take_phase(worth, secs, phase),
            None if is_phase => {}
            phase => watched.take_window(worth, phase.filter(|_| window.lies_in(section))),
        }
    }

    fn take_event(&mut self, record: &Record, event: &Event, timeline: &Timeline) {
        let stream = &record.stream;
        self.alerts.take(stream, event, record.sample.measured);
        let is_of_people = stream.about != About::Robot && stream.origin == Origin::Raw;
        match event.kind {
            EventKind::Intervention => self.counts.interventions += 1,
            EventKind::Marker if stream.name == SESSION_EVENTS => self.counts.markers += 1,
            EventKind::Marker if is_of_people => self.counts.other_markers += 1,
            EventKind::Report if Noting::of(event).is_some() => {}
            EventKind::Report if !is_self_report(event) => self.counts.notes += 1,
            EventKind::Report => {
                self.counts.reports += 1;
                self.counts.take_unused(event, is_about_nobody(stream, event, timeline));
            }
            EventKind::Fault if !is_reported_elsewhere(stream, event) => {
                self.faults.take(&event.label, record.sample.measured);
            }
            _ => {}
        }
    }
}

impl Counts {
    /// Counts an unused report by its first defect.
    fn take_unused(&mut self, report: &Event, is_about_nobody: bool) {
        let off_scale = Isa::read(report).filter(|isa| !isa.is_on_scale());
        match off_scale {
            _ if is_about_nobody => self.about_nobody += 1,
            Some(isa) if isa.value.is_nan() => self.no_number += 1,
            Some(_) => self.off_scale += 1,
            None => {}
        }
    }
}

/// Whether a report that should be about a person is about an unknown person.
fn is_about_nobody(stream: &Stream, report: &Event, timeline: &Timeline) -> bool {
    Isa::read(report).is_some() && timeline.whom(stream, report).about == About::Session
}

/// Whether a window is too short for any value, and so says nothing about its data.
fn is_too_short(values: &FeatureValues) -> bool {
    values.coverage >= ENOUGH && values.reasons.iter().all(|reason| *reason == Reason::Short)
}

/// Whether a fault is counted elsewhere, repeats other faults, or is an alert that someone was needed.
fn is_reported_elsewhere(stream: &Stream, fault: &Event) -> bool {
    let name = stream.name.as_str();
    let is_alert = holds_alerts(stream) && Alert::read(&fault.label).is_some();
    is_alert || UNTOLD.contains(&name) || Loss::of_stream(stream).is_some()
}

/// The raw stream with this name, if it has samples of a signal: events and commands have no expected rate.
fn raw(streams: &Streams, name: &str) -> Option<Arc<Stream>> {
    let (_, stream) = streams.find(name)?;
    let is_happening = stream.shape == Shape::Event || stream.signal == Signal::Input;
    (stream.origin == Origin::Raw && !is_happening).then_some(stream)
}
