//! Event columns of a table.

use std::collections::VecDeque;

use teampulse_core::data::Event;

use crate::csv::{cell, number};

/// The texts of events, by number: the aligner's rows contain only values, so they refer to an event by its number.
#[derive(Debug, Default)]
pub(super) struct EventCells {
    /// The number of events that are no longer kept.
    before: u64,
    /// The kind and label of each event that is still kept.
    waiting: VecDeque<(String, String)>,
}

impl EventCells {
    /// The aligner's channels of an event: its number, value and duration [s].
    pub(super) const CHANNELS: usize = 3;
    /// The columns of an event in the table.
    pub(super) const COLUMNS: [&'static str; 4] = ["kind", "label", "value", "duration_secs"];

    /// Adds an event; returns the values that represent it in the aligner.
    pub(super) fn push(&mut self, event: &Event) -> [f64; EventCells::CHANNELS] {
        let place = self.before + self.waiting.len() as u64;
        self.waiting.push_back((event.kind.to_string(), cell(&event.label)));
        [place as f64, event.value, event.duration_secs]
    }

    /// Returns the cells of a row's event. Rows are in order of time, and so mostly in the order in which events
    /// arrived: only the newest events are kept, and the text of an older one is left empty.
    pub(super) fn cells(&mut self, values: &[f64]) -> String {
        let [place, value, duration_secs] = values else { return ",,,".to_owned() };
        let place = (*place as u64).checked_sub(self.before);
        let event = place.and_then(|place| self.waiting.get(usize::try_from(place).ok()?));
        let (kind, label) = event.cloned().unwrap_or_default();
        while self.waiting.len() > MOST_WAITING {
            self.waiting.pop_front();
            self.before += 1;
        }
        format!("{kind},{label},{},{}", number(*value), number(*duration_secs))
    }
}

/// The maximum number of events kept for rows that wait for other streams.
const MOST_WAITING: usize = 65_536;

#[cfg(test)]
mod tests {
    use teampulse_core::data::EventKind;

    use super::*;

    #[test]
    fn an_event_is_found_again_by_its_number() {
        let mut cells = EventCells::default();
        let event = |label: &str| {
            let label = label.to_owned();
            Event { kind: EventKind::Marker, label, value: f64::NAN, duration_secs: 0.0 }
        };
        let [first, second] = ["=a,b", "c"].map(|label| cells.push(&event(label)));
        assert_eq!(cells.cells(&second), "marker,c,,0");
        assert_eq!(cells.cells(&first), "marker,\"'=a,b\",,0");
        assert_eq!(cells.cells(&[9.0, 1.0, 2.0]), ",,1,2");
    }
}
