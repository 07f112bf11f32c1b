//! What an analysis finds, kept for machines or shown to people as it becomes known.

use teampulse_signal::analysis::{Event, Measured, Span, Value};

use super::printed::{self, Heading};
use super::table::Oddity;
use crate::output;

/// What becomes of events and windows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// They are kept, to be told at the end as one object.
    Kept,
    /// Windows are shown.
    Windows,
    /// Events are shown, a line each.
    Events,
}

/// What an analysis found so far.
pub struct Found {
    purpose: Purpose,
    /// What the values of each window are.
    pub values: Vec<Value>,
    /// Events in the order of their becoming known, if they are kept.
    pub events: Vec<Event>,
    /// Each window with what it told, if they are kept.
    pub windows: Vec<(Span, Measured)>,
    heading: Heading,
    scored: Option<&'static str>,
    /// Where events of the kind lie that is scored [samples].
    pub places: Vec<f64>,
    /// How many events there were of each kind.
    pub counts: Vec<(&'static str, usize)>,
    /// When the last one was [ns].
    pub last_event_ns: i64,
    /// What was said of the table on standard error.
    pub notes: Vec<String>,
    /// How many samples are missing by their times.
    pub missing: usize,
    /// Rows that were left out, because they are not after the one before them.
    pub left_out: Oddity,
}

impl Found {
    /// Nothing yet; of events of a `scored` kind, the places are kept.
    pub fn new(purpose: Purpose, scored: Option<&'static str>) -> Found {
        Found {
            purpose,
            values: Vec::new(),
            events: Vec::new(),
            windows: Vec::new(),
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

    /// Says a word of the table on standard error.
    pub fn note(&mut self, note: String) {
        output::note(format!("note: {note}"));
        self.notes.push(note);
    }

    /// Takes in an event.
    pub fn event(&mut self, event: Event) {
        match self.counts.iter_mut().find(|(kind, _)| *kind == event.kind) {
            Some((_, count)) => *count += 1,
            None => self.counts.push((event.kind, 1)),
        }
        self.last_event_ns = self.last_event_ns.max(event.at_ns);
        if self.scored == Some(event.kind) {
            self.places.push(event.sample);
        }
        match self.purpose {
            Purpose::Kept => self.events.push(event),
            Purpose::Events => self.heading.show(&event),
            Purpose::Windows => {}
        }
    }

    /// Takes in what a window told.
    pub fn window(&mut self, span: Span, measured: Measured) {
        match self.purpose {
            Purpose::Kept => self.windows.push((span, measured)),
            Purpose::Windows => printed::window(&self.values, span, &measured),
            Purpose::Events => {}
        }
    }

    /// Counts how many samples were missing before the row of a line; `None` for one that was left out.
    pub fn count(&mut self, missing: Option<usize>, line: usize) {
        match missing {
            Some(missing) => self.missing += missing,
            None => self.left_out.add(1, line),
        }
    }
}
