//! The team: who is present, and who needs attention.

use std::collections::{BTreeMap, BTreeSet};

use teampulse_core::alerts::{Alert, Stage, Tier, Why, holds_alerts};
use teampulse_core::counted::counted;
use teampulse_core::data::{Event, EventKind, FeatureValues};
use teampulse_core::stream::{About, Stream};
use teampulse_core::time::Time;

/// The text between the person and the alert in an acknowledgement.
const ACKNOWLEDGE: &str = " acknowledge ";

/// The newest state of the team.
#[derive(Debug, Default)]
pub(super) struct Team {
    /// The state of the team, by channel.
    state: BTreeMap<String, f64>,
    /// The open alerts of each robot and person.
    needs: BTreeMap<String, Vec<Open>>,
}

/// An open alert.
#[derive(Debug)]
struct Open {
    why: Why,
    tier: Option<Tier>,
    since: Time,
    /// Whether the value still arrives.
    is_known: bool,
    /// The person who has acknowledged the alert.
    seen_by: Option<String>,
}

impl Open {
    fn words(&self) -> String {
        let lost = if self.is_known { "" } else { ", but no value arrives" };
        let seen = self.seen_by.as_ref().map(|who| format!(", seen by {who}"));
        format!("{}{lost}{}", self.why, seen.unwrap_or_default())
    }
}

/// A robot or a person that needs attention.
#[derive(Debug)]
pub(super) struct Need<'a> {
    /// The robot or person.
    pub who: &'a str,
    /// The urgency, if the study states it.
    pub tier: Option<Tier>,
    /// The reasons, in words.
    pub why: String,
    /// The time since when attention has been needed.
    pub since: Time,
}

impl Need<'_> {
    /// The words for the need of the robot or person.
    pub fn words(&self) -> &'static str {
        if self.tier == Some(Tier::Note) { "is worth a look" } else { "needs someone" }
    }
}

impl Team {
    /// Takes the state of the team from a record of its stream.
    pub fn take(&mut self, stream: &Stream, values: &FeatureValues) {
        if stream.about == About::Team && stream.name == "/team/state" {
            let named = stream.channels.iter().map(|channel| channel.name.clone());
            self.state = named.zip(values.values.iter().copied()).collect();
        }
    }

    /// Takes an alert or its acknowledgement, if it is one.
    pub fn take_event(&mut self, stream: &Stream, event: &Event, at: Time) {
        if stream.about == About::Session && event.kind == EventKind::Report {
            self.acknowledge(&event.label);
        }
        let alert = Alert::read(&event.label).filter(|_| holds_alerts(stream));
        let Some(Alert { who, why, stage, tier }) = alert else { return };
        let needs = self.needs.entry(who).or_default();
        let known = needs.iter().position(|open| open.why == why);
        match (stage, known) {
            (Stage::Raised, Some(place)) if !needs[place].is_known => needs[place].is_known = true,
            (Stage::Raised, known) => {
                known.map(|place| needs.remove(place));
                needs.push(Open { why, tier, since: at, is_known: true, seen_by: None });
            }
            (Stage::Unknown, Some(place)) => needs[place].is_known = false,
            (Stage::Answered | Stage::Over, Some(place)) => {
                needs.remove(place);
            }
            (_, None) => {}
        }
    }

    fn acknowledge(&mut self, report: &str) {
        let Some((who, label)) = report.split_once(ACKNOWLEDGE) else { return };
        let Some(alert) = Alert::read(label) else { return };
        let open = self.needs.get_mut(&alert.who).into_iter().flatten();
        for open in open.filter(|open| open.why == alert.why) {
            open.seen_by = Some(who.to_owned());
        }
    }

    /// Returns who needs attention, with all reasons of the same urgency.
    pub fn needs(&self) -> impl Iterator<Item = Need<'_>> {
        self.needs.iter().flat_map(|(who, needs)| {
            let tiers: BTreeSet<Option<Tier>> = needs.iter().map(|open| open.tier).collect();
            tiers.into_iter().filter_map(move |tier| {
                let of_tier = || needs.iter().filter(move |open| open.tier == tier);
                let since = of_tier().map(|open| open.since).min()?;
                let why: Vec<String> = of_tier().map(Open::words).collect();
                Some(Need { who, tier, why: why.join(", "), since })
            })
        })
    }

    /// The attendance, given the number of robots seen; `None` while it is unknown.
    pub fn line(&self, robots: usize) -> Option<String> {
        let people = counted(self.known("people")? as usize, "person", "people");
        let online = self.known("robots_online").map(|online| online as usize);
        Some(match online {
            Some(online) if online == robots => {
                format!("{people}, {} online", counted(robots, "robot", "robots"))
            }
            Some(online) => format!("{people}, {online} of {robots} robots online"),
            None => people,
        })
    }

    fn known(&self, channel: &str) -> Option<f64> {
        self.state.get(channel).copied().filter(|value| value.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use teampulse_core::alerts::ALERTS;
    use teampulse_core::session_streams::session_events;
    use teampulse_core::stream::{Shape, Subject};

    use super::*;

    fn state(team: &mut Team, values: [f64; 2]) {
        let channels = [("people", "1"), ("robots_online", "1")];
        let stream = Stream::raw("/team/state", Subject::team(), Shape::Feature);
        let values = FeatureValues {
            window_secs: 1.0,
            coverage: 1.0,
            quality: 1.0,
            values: values.to_vec(),
            sigmas: Vec::new(),
            reasons: Vec::new(),
        };
        team.take(&stream.with_channels(&channels), &values);
    }

    fn alert(team: &mut Team, secs: i32, (who, why): (&str, Why), stage: Stage) {
        let alert = Alert { who: who.to_owned(), why, stage, tier: None };
        let (kind, label) = (EventKind::Fault, alert.label());
        let event = Event { kind, label, value: f64::NAN, duration_secs: f64::NAN };
        let stream = Stream::raw(ALERTS, Subject::team(), Shape::Event);
        team.take_event(&stream, &event, Time::from_stamp(secs, 0));
    }

    fn poor_link() -> Why {
        Why::Limit("poor link".to_owned())
    }

    fn stuck() -> Why {
        Why::Stuck("wifi".to_owned())
    }

    fn needs(team: &Team) -> Vec<(String, String, f64)> {
        let needs = team.needs();
        needs.map(|need| (need.who.to_owned(), need.why, need.since.secs())).collect()
    }

    #[test]
    fn who_needs_someone_is_reported_with_why_and_since_when() {
        let mut team = Team::default();
        assert_eq!(team.line(5), None);
        alert(&mut team, 1, ("robot2", Why::Offline), Stage::Raised);
        alert(&mut team, 2, ("robot3", poor_link()), Stage::Raised);
        alert(&mut team, 3, ("robot3", stuck()), Stage::Raised);
        state(&mut team, [1.0, 4.0]);
        assert_eq!(team.line(5).unwrap(), "1 person, 4 of 5 robots online");
        let need = |robot: &str, why: &str, secs| (robot.to_owned(), why.to_owned(), secs);
        let both =
            [need("robot2", "offline", 1.0), need("robot3", "poor link, wifi is stuck", 2.0)];
        assert_eq!(needs(&team), both);
        alert(&mut team, 4, ("robot3", poor_link()), Stage::Answered);
        alert(&mut team, 4, ("robot3", stuck()), Stage::Over);
        alert(&mut team, 4, ("robot2", Why::Offline), Stage::Answered);
        assert_eq!(needs(&team), []);
        state(&mut team, [0.0, f64::NAN]);
        assert_eq!(team.line(0).unwrap(), "0 people");
    }

    #[test]
    fn an_alert_of_the_study_has_its_urgency_and_is_neither_kept_nor_dropped_unsaid() {
        let mut team = Team::default();
        let subject = Subject::person("p001");
        let stream =
            Stream::concluded("/humans/persons/p001/alerts", subject, "alerts", Shape::Event);
        let happens = |team: &mut Team, secs, stream: &Stream, kind, label: &str| {
            let event =
                Event { kind, label: label.to_owned(), value: f64::NAN, duration_secs: 0.0 };
            team.take_event(stream, &event, Time::from_stamp(secs, 0));
        };
        let say = |team: &mut Team, secs, label: &str| {
            happens(team, secs, &stream, EventKind::Fault, label);
        };
        say(&mut team, 1, "p001 needs someone now: HR above 120 1/min");
        say(&mut team, 2, "p001 is worth a look: skin dry");
        let tiers: Vec<_> = team.needs().map(|need| (need.tier, need.why)).collect();
        let act = (Some(Tier::Act), "HR above 120 1/min".to_owned());
        assert_eq!(tiers, [act, (Some(Tier::Note), "skin dry".to_owned())]);
        assert!(team.needs().map(|need| need.words()).eq(["needs someone", "is worth a look"]));
        say(&mut team, 3, "p001 is no longer worth a look: skin dry");
        say(&mut team, 4, "p001 may still need someone, no value comes: HR above 120 1/min");
        let why = |team: &Team| needs(team).remove(0);
        let lost = "HR above 120 1/min, but no value arrives".to_owned();
        assert_eq!(why(&team), ("p001".to_owned(), lost, 1.0));
        say(&mut team, 5, "p001 needs someone now: HR above 120 1/min");
        let report = "dashboard acknowledge p001 needs someone now: HR above 120 1/min";
        happens(&mut team, 6, &session_events(), EventKind::Report, report);
        let seen = "HR above 120 1/min, seen by dashboard".to_owned();
        assert_eq!(why(&team), ("p001".to_owned(), seen, 1.0));
        say(&mut team, 7, "p001 no longer needs someone: HR above 120 1/min");
        assert_eq!(needs(&team), []);
    }
}
