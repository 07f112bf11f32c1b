//! The results of an analysis: kept for JSON, or printed as they become known.

use teampulse_signal::analysis::{Event, Measured, Span, Value};

use super::around::Around;
use super::printed::{self, Heading};
use super::table::Oddity;
use crate::output;

/// The values that count artefacts among intervals.
const ARTEFACTS: [&str; 4] = ["HRV_Ectopic", "HRV_Missed", "HRV_Extra", "HRV_LongShort"];

/// How events and windows are reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Events and windows are kept, and reported at the end as one JSON object.
    Kept,
    /// Windows are printed.
    Windows,
    /// Events are printed, one per line.
    Events,
}

/// The results of an analysis so far.
pub struct Found {
    purpose: Purpose,
    /// The name, unit and recipe of each value.
    pub values: Vec<Value>,
    /// Events in the order in which they were detected, if they are kept.
    pub events: Vec<Event>,
    /// Each window with its results, if they are kept.
    pub windows: Vec<(Span, Measured)>,
    /// The values around events.
    pub around: Around,
    /// The number of artefacts among intervals, in windows that do not overlap.
    pub artefacts: usize,
    /// The end of the last window whose artefacts were counted [ns].
    artefacts_until_ns: i64,
    heading: Heading,
    scored: Option<&'static str>,
    /// Sample positions of the events of the scored kind.
    pub places: Vec<f64>,
    /// The number of events of each kind.
    pub counts: Vec<(&'static str, usize)>,
    /// The time of the latest event [ns].
    pub last_event_ns: i64,
    /// Notes on the table that were printed on standard error.
    pub notes: Vec<String>,
    /// The number of samples that are missing according to their times.
    pub missing: usize,
    /// Rows that were skipped because they are not later than the row before them.
    pub left_out: Oddity,
}

impl Found {
    /// Creates empty results; for events of a `scored` kind, the sample positions are kept.
    pub fn new(purpose: Purpose, scored: Option<&'static str>) -> Found {
        Found {
            purpose,
            values: Vec::new(),
            events: Vec::new(),
            windows: Vec::new(),
            around: Around::default(),
            artefacts: 0,
            artefacts_until_ns: i64::MIN,
            heading: Heading::default(),
            scored,
            places: Vec::new(),
            counts: Vec::new(),
            last_event_ns: i64::MIN,
            notes: Vec::new(),
            missing: 0,
            left_out: Oddity::default(),
        }
    }

    /// Prints a note on the table on standard error.
    pub fn note(&mut self, note: String) {
        output::note(format!("note: {note}"));
        self.notes.push(note);
    }

    /// Adds an event.
    pub fn event(&mut self, event: Event) {
        match self.counts.iter_mut().find(|(kind, _)| *kind == event.kind) {
            Some((_, count)) => *count += 1,
            None => self.counts.push((event.kind, 1)),
        }
        self.last_event_ns = self.last_event_ns.max(event.at_ns);
        if self.scored == Some(event.kind) {
            // A skin response is reported at its peak, but scored at its onset.
            let is_response = event.kind == "response";
            let onset =
                event.details.iter().find(|(name, _)| is_response && *name == "onset_sample");
            self.places.push(onset.map_or(event.sample, |(_, onset)| *onset));
        }
        match self.purpose {
            Purpose::Kept => self.events.push(event),
            Purpose::Events => self.heading.show(&event),
            Purpose::Windows => {}
        }
    }

    /// Completes the printed table of events, if events are printed.
    pub fn end_events(&self) {
        if self.purpose == Purpose::Events {
            self.heading.end();
        }
    }

    /// Adds the results of a window.
    pub fn window(&mut self, span: Span, measured: Measured) {
        if span.begin_ns >= self.artefacts_until_ns {
            self.artefacts += artefacts(&self.values, &measured);
            self.artefacts_until_ns = span.end_ns;
        }
        match self.purpose {
            Purpose::Kept => self.windows.push((span, measured)),
            Purpose::Windows => printed::window(&self.values, span, &measured),
            Purpose::Events => {}
        }
    }

    /// Counts the samples that are missing before the row in a line; `None` marks a row that was skipped.
    pub fn count(&mut self, missing: Option<usize>, line: usize) {
        match missing {
            Some(missing) => self.missing += missing,
            None => self.left_out.add(1, line),
        }
    }
}

/// Returns the number of artefacts counted in a window.
fn artefacts(values: &[Value], measured: &Measured) -> usize {
    let counted = values.iter().zip(&measured.values);
    let counted = counted.filter(|(value, _)| ARTEFACTS.contains(&&*value.name));
    counted.filter_map(|(_, count)| count.ok()).sum::<f64>() as usize
}
