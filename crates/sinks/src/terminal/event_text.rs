//! Events as text for the terminal.

use teampulse_core::alerts::{Alert, holds_alerts};
use teampulse_core::command::{Accepted, Command};
use teampulse_core::computers::UNTOLD;
use teampulse_core::data::{Event, EventKind};
use teampulse_core::loss::Loss;
use teampulse_core::session_streams::{CLOCKS, END};
use teampulse_core::stream::{About, Origin, Stream};

use crate::text::shown;

/// The text of an event; `None` for events that are too frequent or are shown elsewhere.
pub(super) fn event_text(stream: &Stream, event: &Event) -> Option<String> {
    // An alert states who needs someone, and is not a fault.
    if holds_alerts(stream) && Alert::read(&event.label).is_some() {
        return Some(shown(&event.label));
    }
    let is_note = stream.family == "notes" && event.kind != EventKind::Fault;
    let is_counted = Loss::of_stream(stream).is_some() || is_of_body(event.kind);
    let is_input = UNTOLD.contains(&stream.name.as_str());
    // The marker itself is shown by the command that set it.
    let is_marked =
        matches!(Accepted::read(event), Some(Accepted { command: Command::Mark(_), .. }));
    if is_note || is_counted || is_input || is_marked || is_of_task(stream, event.kind) {
        return None;
    }
    let sentence = shown(&sentence(stream, event));
    Some(if stream.about == About::Person {
        format!("{}: {sentence}", stream.id)
    } else {
        sentence
    })
}

/// Whether an event is a step of a person's task, such as a key press, which may occur every second.
fn is_of_task(stream: &Stream, kind: EventKind) -> bool {
    stream.about == About::Person && kind == EventKind::Marker
}

fn sentence(stream: &Stream, event: &Event) -> String {
    let Event { kind, label, value, .. } = event;
    if let Some(Accepted { sender, command }) = Accepted::read(event) {
        return format!("command from {sender}: {command}");
    }
    match kind {
        EventKind::Fault if is_silence(stream, *value) => format!("fault: {label} for {value} s"),
        EventKind::Fault => format!("fault: {label}"),
        EventKind::Clock if label == END => "session ended".into(),
        EventKind::Clock if stream.name == CLOCKS => format!("clock: {label}"),
        EventKind::Clock if value.is_finite() => format!("{label} of {value:+.3} s"),
        EventKind::Clock => format!("clock: {label}"),
        EventKind::Report if value.is_finite() => format!("report: {label} {value}"),
        EventKind::Phase if label.is_empty() => "phase ended".into(),
        EventKind::Intervention => format!("intervention: {label}"),
        _ if stream.origin == Origin::Derived => label.clone(),
        _ => format!("{kind}: {label}"),
    }
}

/// Whether events of this kind occur in a body all the time.
fn is_of_body(kind: EventKind) -> bool {
    use EventKind::{Beat, Blink, Breath, Burst, Response};
    matches!(kind, Beat | Blink | Breath | Burst | Response)
}

/// Whether the value of a fault is how long a robot has been silent [s].
fn is_silence(stream: &Stream, value: f64) -> bool {
    stream.family == "deployment" && value.is_finite()
}

#[cfg(test)]
mod tests {
    use teampulse_core::alerts::ALERTS;
    use teampulse_core::stream::{Shape, Subject};

    use super::*;

    fn text_of(name: &str, origin: Origin, kind: EventKind, label: &str, value: f64) -> String {
        let family = if name.contains("deployment") { "deployment" } else { "" };
        let raw = Stream::concluded(name, Subject::robot("robot2"), family, Shape::Event);
        let event = Event { kind, label: label.into(), value, duration_secs: f64::NAN };
        event_text(&Stream { origin, ..raw }, &event).unwrap_or_default()
    }

    #[test]
    fn a_label_commands_no_terminal() {
        let marked = text_of("/session/events", Origin::Raw, EventKind::Marker, "\u{1b}[2J", 0.0);
        assert_eq!(marked, "marker:  [2J");
    }

    #[test]
    fn what_was_computed_speaks_for_itself() {
        let deployment = |kind, label, value| {
            text_of("/r/deployment/events", Origin::Derived, kind, label, value)
        };
        assert_eq!(deployment(EventKind::Marker, "robot2 online", f64::NAN), "robot2 online");
        assert_eq!(
            deployment(EventKind::Fault, "robot2 offline", 5.0),
            "fault: robot2 offline for 5 s"
        );
    }

    #[test]
    fn a_number_is_shown_only_where_its_meaning_is_known() {
        let fault = EventKind::Fault;
        let level = text_of("/r/level/w10/events", Origin::Derived, fault, "/r: error", 2.0);
        assert_eq!(level, "fault: /r: error");
        let session = |kind, label, value| text_of("/s", Origin::Raw, kind, label, value);
        assert_eq!(
            session(EventKind::Clock, "wall clock step", 2.5),
            "wall clock step of +2.500 s"
        );
        assert_eq!(session(EventKind::Report, "effort", 7.0), "report: effort 7");
    }

    #[test]
    fn what_a_person_marks_is_named_as_such() {
        let session = |kind, label| text_of("/s", Origin::Raw, kind, label, f64::NAN);
        assert_eq!(session(EventKind::Marker, "a"), "marker: a");
        assert_eq!(session(EventKind::Phase, "baseline"), "phase: baseline");
        assert_eq!(session(EventKind::Clock, "end"), "session ended");
    }

    #[test]
    fn clock_events_are_worded_as_clock_events() {
        let text = text_of(CLOCKS, Origin::Derived, EventKind::Clock, "laptop2 is +1.5 s off", 1.5);
        assert_eq!(text, "clock: laptop2 is +1.5 s off");
    }

    #[test]
    fn of_a_person_it_is_said_who_and_not_each_press_of_a_key() {
        let person = Subject { about: About::Person, id: "p001".into() };
        let stream = Stream::raw("/humans/persons/p001/task/reports", person, Shape::Event);
        let event = |kind, label: &str, value| {
            let event = Event { kind, label: label.into(), value, duration_secs: 0.0 };
            event_text(&stream, &event)
        };
        assert_eq!(event(EventKind::Report, "isa", 4.0).unwrap(), "p001: report: isa 4");
        assert_eq!(event(EventKind::Phase, "2-back", f64::NAN).unwrap(), "p001: phase: 2-back");
        assert_eq!(event(EventKind::Marker, "match", 0.7), None);
        let subject = Subject::person("p001");
        let alerts =
            Stream::concluded("/humans/persons/p001/alerts", subject, "alerts", Shape::Event);
        let label = "p001 no longer needs someone: HR above 120 1/min".to_owned();
        let over =
            Event { kind: EventKind::Marker, label: label.clone(), value: 0.0, duration_secs: 3.0 };
        assert_eq!(event_text(&alerts, &over), Some(label));
    }

    #[test]
    fn an_alert_reads_the_same_of_a_robot_and_of_a_person() {
        let alerts = |subject| Stream::concluded(ALERTS, subject, "alerts", Shape::Event);
        let happens = |stream: &Stream, label: &str| {
            let (kind, label) = (EventKind::Fault, label.to_owned());
            event_text(stream, &Event { kind, label, value: 0.1, duration_secs: f64::NAN }).unwrap()
        };
        let raised = "robot2 needs someone soon: battery below 20 %";
        assert_eq!(happens(&alerts(Subject::team()), raised), raised);
        assert_eq!(happens(&alerts(Subject::person("p001")), raised), raised);
        let idle = "alert 1 of the study watches nothing";
        assert_eq!(happens(&alerts(Subject::team()), idle), format!("fault: {idle}"));
    }

    #[test]
    fn frequent_events_are_not_shown() {
        for input in UNTOLD {
            assert_eq!(text_of(input, Origin::Raw, EventKind::Clock, "laptop2", 0.1), "");
        }
        let beat = text_of("/p/ecg/beats", Origin::Derived, EventKind::Beat, "beat", f64::NAN);
        assert_eq!(beat, "");
    }
}
