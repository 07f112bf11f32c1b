//! Converting records to messages for a browser.

use teampulse_core::alerts::{Alert, holds_alerts};
use teampulse_core::command::Accepted;
use teampulse_core::data::{self, EventKind, FeatureValues, Reason};
use teampulse_core::status::{State, StreamStatus};
use teampulse_core::stream::Stream;

use crate::wire::{self, known};

/// The verbs of written reports that are not commands.
pub const WRITTEN: [&str; 3] = ["note", "acknowledge", "show_estimates"];

/// Converts the health of a stream.
pub fn health(stream: u32, status: &StreamStatus) -> wire::StreamHealth {
    let state = match status.state {
        State::Never => "never",
        State::Ok => "ok",
        State::Degraded => "degraded",
        State::Stale => "stale",
        State::Dead => "dead",
    };
    let clocks = ["host", "one_way", "two_way", "sample_index", "remote"];
    wire::StreamHealth {
        stream,
        state,
        reason: status.reason.clone(),
        rate_hz: if status.rate_hz.is_finite() { status.rate_hz } else { 0.0 },
        age_secs: known(status.age_secs),
        received: status.received,
        lost_source: status.lost_source,
        lost_queue: status.lost_queue,
        late: status.late,
        duplicates: status.duplicates,
        clock: clocks.get(usize::from(status.clock)).copied().unwrap_or("host"),
        epoch: status.epoch,
        offset_secs: known(status.offset_secs),
        skew_ppm: known(status.skew_ppm),
        jitter_secs: known(status.jitter_secs),
        uncertainty_secs: known(status.uncertainty_secs()),
        latency_secs: known(status.latency_secs),
    }
}

/// Converts the values of a feature at a time [s].
pub fn feature(stream: u32, t: f64, feature: &FeatureValues) -> wire::Feature {
    let reason = |reason: &Reason| match reason {
        Reason::Ok => "ok",
        Reason::Short => "short",
        Reason::Gap => "gap",
        Reason::Quality => "quality",
        Reason::Missing => "missing",
        Reason::Undefined => "undefined",
        Reason::NoBaseline => "no_baseline",
        Reason::Nothing => "nothing",
        Reason::BriefBaseline => "brief_baseline",
    };
    wire::Feature {
        stream,
        t,
        window_secs: feature.window_secs,
        coverage: known(f64::from(feature.coverage)),
        quality: known(f64::from(feature.quality)),
        values: feature.values.iter().copied().map(known).collect(),
        sigmas: feature.sigmas.iter().copied().map(known).collect(),
        reasons: feature.reasons.iter().map(reason).collect(),
    }
}

/// Converts an event at a time [s]; `number` counts all events.
pub fn event(number: u64, id: u32, t: f64, stream: &Stream, event: &data::Event) -> wire::Event {
    let alert = holds_alerts(stream).then(|| Alert::read(&event.label)).flatten();
    wire::Event {
        number,
        stream: id,
        t,
        kind: event.kind.word(),
        label: event.label.clone(),
        value: known(event.value),
        duration: known(event.duration_secs),
        request: request(stream, event),
        alert: alert.map(|alert| wire::Alert {
            tier: alert.urgency().word(),
            is_of_study: alert.tier.is_some(),
            who: alert.who,
            why: alert.why.to_string(),
            stage: alert.stage.word(),
        }),
    }
}

/// Whether an event is a frequent one of the body, such as a beat or a blink, which a slow client may miss.
pub fn is_minor(event: &data::Event) -> bool {
    use EventKind::{Beat, Blink, Breath, Burst, Response};
    matches!(event.kind, Beat | Response | Breath | Burst | Blink)
}

/// Returns the command, note or acknowledgement that an event records.
fn request(stream: &Stream, event: &data::Event) -> Option<wire::Request> {
    let asked = |who: String, verb: &str, text: &str| wire::Request {
        who,
        verb: verb.to_owned(),
        text: text.to_owned(),
    };
    if let Some(Accepted { sender, command }) =
        Accepted::of(stream, &data::Data::Event(event.clone().into()))
    {
        let verb = command.verb();
        let text = command.to_string();
        return Some(asked(sender.to_string(), verb, text[verb.len()..].trim_start()));
    }
    let is_report =
        stream.about == teampulse_core::stream::About::Session && event.kind == EventKind::Report;
    let (who, rest) = event.label.split_once(' ').filter(|_| is_report)?;
    let (verb, text) = rest.split_once(' ').unwrap_or((rest, ""));
    WRITTEN.contains(&verb).then(|| asked(who.to_owned(), verb, text))
}

#[cfg(test)]
mod tests {
    use teampulse_core::command::{Command, Sender};
    use teampulse_core::session_streams::session_events;

    use super::*;

    #[test]
    fn who_asked_for_what_is_said_and_a_label_is_kept_as_it_is() {
        let sender = Sender::through("dashboard", "tablet");
        let of = |event: &data::Event| super::event(1, 2, 3.0, &session_events(), event);
        let mark =
            Accepted { sender, command: Command::Mark("robot <b>2</b> lost".into()) }.event();
        let request = of(&mark).request.unwrap();
        assert_eq!((&*request.who, &*request.verb), ("dashboard:tablet", "mark"));
        assert_eq!(request.text, "robot <b>2</b> lost");
        let report = |label: &str| {
            let (kind, label) = (EventKind::Report, label.to_owned());
            data::Event { kind, label, value: f64::NAN, duration_secs: 0.0 }
        };
        let note = of(&report("dashboard note lights were off"));
        assert_eq!(note.request.unwrap().text, "lights were off");
        assert_eq!(note.value, None);
        assert!(of(&report("isa p001")).request.is_none());
    }
}
