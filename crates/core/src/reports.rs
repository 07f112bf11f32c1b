//! Reports as events, formatted and parsed: people's ratings of their own workload, and notes of the session.

use std::ops::RangeInclusive;

use crate::data::{Event, EventKind};

/// The label of a report of the Instantaneous Self-Assessment.
pub const ISA: &str = "isa";
/// The scale of the Instantaneous Self-Assessment, from idle to overloaded.
pub const SCALE: RangeInclusive<f64> = 1.0..=5.0;

/// A report of the Instantaneous Self-Assessment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Isa<'a> {
    /// The id of the person named in the label: `p001` for `isa p001`; empty for `isa`.
    pub person: &'a str,
    /// The reported workload.
    pub value: f64,
}

impl Isa<'_> {
    /// The report in an event; `None` for any other event.
    pub fn read(event: &Event) -> Option<Isa<'_>> {
        let mut words = event.label.split_whitespace();
        let is_isa = words.next()?.eq_ignore_ascii_case(ISA) && event.kind == EventKind::Report;
        is_isa.then(|| Isa { person: words.next().unwrap_or(""), value: event.value })
    }

    /// The event of this report.
    pub fn event(&self) -> Event {
        let Isa { person, value } = *self;
        let label = format!("{ISA} {person}").trim_end().to_owned();
        Event { kind: EventKind::Report, label, value, duration_secs: 0.0 }
    }

    /// Whether the value is on the scale; other values can't be used.
    pub fn is_on_scale(&self) -> bool {
        SCALE.contains(&self.value)
    }
}

/// A self-report on any scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rating<'a> {
    /// The scale: the first word of the label.
    pub scale: &'a str,
    /// The id of the person named in the label: `p001` for `nasa_tlx p001`; empty for `nasa_tlx`.
    pub person: &'a str,
    /// The reported number.
    pub value: f64,
}

impl Rating<'_> {
    /// The report in an event; `None` for any other event, such as a note, which has no number.
    pub fn read(event: &Event) -> Option<Rating<'_>> {
        if let Some(Isa { person, value }) = Isa::read(event) {
            return Some(Rating { scale: ISA, person, value });
        }
        let mut words = event.label.split_whitespace();
        let (scale, person) = (words.next()?, words.next().unwrap_or(""));
        let is_rating = event.kind == EventKind::Report && event.value.is_finite();
        (is_rating && words.next().is_none()).then_some(Rating {
            scale,
            person,
            value: event.value,
        })
    }
}

/// A component that writes its own notes, rather than those of a person.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Noting {
    /// The recording.
    Bag,
    /// The phases of the study.
    Phases,
}

impl Noting {
    const ALL: [Noting; 2] = [Noting::Bag, Noting::Phases];

    /// The event of a note.
    pub fn event(self, text: &str) -> Event {
        let label = format!("{}{text}", self.start());
        Event { kind: EventKind::Report, label, value: f64::NAN, duration_secs: 0.0 }
    }

    /// The component that wrote a note; `None` for any other event, such as a person's note.
    pub fn of(event: &Event) -> Option<Noting> {
        let is_its = |noting: &Noting| event.label.starts_with(noting.start());
        Noting::ALL.into_iter().find(|noting| event.kind == EventKind::Report && is_its(noting))
    }

    fn start(self) -> &'static str {
        match self {
            Noting::Bag => "bag note ",
            Noting::Phases => "phases note ",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_note_of_the_session_is_nobody_s() {
        for noting in Noting::ALL {
            assert_eq!(Noting::of(&noting.event("the last 3 s are in /d")), Some(noting));
        }
        let note = Event { label: "dashboard note phases note".into(), ..Noting::Bag.event("") };
        assert_eq!(Noting::of(&note), None);
    }

    #[test]
    fn a_report_is_read_as_it_was_written() {
        for person in ["p001", ""] {
            let report = Isa { person, value: 3.0 };
            assert_eq!(Isa::read(&report.event()), Some(report));
        }
        let other = |label: &str| Event {
            label: label.to_owned(),
            ..Isa { person: "", value: 3.0 }.event()
        };
        assert_eq!(Isa::read(&other("ISA p001")).map(|isa| isa.person), Some("p001"));
        assert_eq!(Isa::read(&other("tlx")), None);
    }

    #[test]
    fn a_rating_on_any_scale_names_its_person() {
        let read = |label: &str, value| {
            let event = Event { label: label.to_owned(), ..Isa { person: "", value }.event() };
            Rating::read(&event).map(|rating| (rating.scale.to_owned(), rating.person.to_owned()))
        };
        let rating = |scale: &str, person: &str| Some((scale.to_owned(), person.to_owned()));
        assert_eq!(read("nasa_tlx p001", 50.0), rating("nasa_tlx", "p001"));
        assert_eq!(read("kss", 3.0), rating("kss", ""));
        assert_eq!(read("ISA p001", f64::NAN), rating("isa", "p001"));
        assert_eq!(read("dashboard note", f64::NAN), None);
        assert_eq!(read("how hard it was", 3.0), None);
    }

    #[test]
    fn a_report_is_on_its_scale_or_not() {
        assert_eq!(
            [0.0, 1.0, 5.0, 7.0, f64::NAN].map(|value| Isa { person: "", value }.is_on_scale()),
            [false, true, true, false, false]
        );
    }
}
