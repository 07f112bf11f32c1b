//! Conventions of a battery's driver, each reported once.

use std::fmt;
use std::sync::Arc;

use teampulse_core::data::{Data, EventKind};
use teampulse_core::feature::{OutputId, Outputs};
use teampulse_core::stream::{Shape, Signal, Stream};
use teampulse_core::time::Time;

use super::estimates::PowerMethod;
use crate::value::moment;

/// A convention of a battery's driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Note {
    PercentAsHundred,
    PositiveDischarge,
    Power(PowerMethod),
}

/// The notes about one battery.
#[derive(Debug, Default)]
pub(super) struct Notes {
    input: String,
    output: Option<OutputId>,
    said: Vec<Note>,
}

impl Notes {
    /// Declares `<input>/notes`.
    pub(super) fn declare(&mut self, input: &Stream, out: &mut Outputs) {
        self.input.clone_from(&input.name);
        self.output = Some(out.declare(Stream {
            signal: Signal::Event,
            device: input.device.clone(),
            method: "conventions of the driver, recognised from its numbers".to_owned(),
            doc: format!("Conventions of {}.", input.name),
            ..Stream::derived(input, "notes", Shape::Event)
        }));
    }

    /// Reports a note, unless it was reported before.
    pub(super) fn say(&mut self, note: Note, at: Time, out: &mut Outputs) {
        if self.said.contains(&note) {
            return;
        }
        self.said.push(note);
        let event = moment(note.kind(), format!("{}: {note}", self.input));
        if let Some(output) = self.output {
            out.emit(output, at, Data::Event(Arc::new(event)));
        }
    }
}

impl Note {
    fn kind(self) -> EventKind {
        match self {
            Note::PercentAsHundred | Note::PositiveDischarge => EventKind::Fault,
            Note::Power(_) => EventKind::Marker,
        }
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Note::PercentAsHundred => f.pad("percentage is given as 0–100"),
            Note::PositiveDischarge => f.pad("current is positive while discharging"),
            Note::Power(method) => method.fmt(f),
        }
    }
}
