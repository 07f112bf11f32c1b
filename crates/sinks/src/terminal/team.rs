//! The team as one line: who is there, and which robots need someone.

use std::collections::BTreeMap;

use teampulse_core::alerts::{ALERTS, Alert, Stage};
use teampulse_core::data::{Event, FeatureValues};
use teampulse_core::stream::{About, Stream};

/// The last that is known of the team.
#[derive(Debug, Default)]
pub(super) struct Team {
    /// By channel.
    state: BTreeMap<String, f64>,
    /// Why each robot needs someone whom nobody has answered.
    needs: BTreeMap<String, Vec<String>>,
}

impl Team {
    /// Takes the state of the team, if it is that.
    pub fn take(&mut self, stream: &Stream, values: &FeatureValues) {
        if stream.about == About::Team && stream.name == "/team/state" {
            let named = stream.channels.iter().cloned();
            self.state = named.zip(values.values.iter().copied()).collect();
        }
    }

    /// Takes an alert, if it is one.
    pub fn take_event(&mut self, stream: &Stream, event: &Event) {
        let alert = Alert::read(&event.label).filter(|_| stream.name == ALERTS);
        let Some(Alert { robot, why, stage }) = alert else { return };
        let needs = self.needs.entry(robot).or_default();
        needs.retain(|other| *other != why);
        if stage == Stage::Raised {
            needs.push(why);
        }
    }

    /// The team's line; `None` while nothing is known.
    pub fn line(&self) -> Option<String> {
        let count = |channel| self.known(channel).map(|count| count as u64);
        let mut parts = vec!["team".to_owned(), counted(count("people")?, "person", "people")];
        let online = count("robots_online").map(|count| counted(count, "robot", "robots"));
        parts.extend(online.map(|robots| format!("{robots} online")));
        let oldest = self.known("unanswered_secs");
        parts.extend(oldest.map(|secs| format!("unanswered for {secs:.0} s")));
        let needs = self.needs.iter().filter(|(_, needs)| !needs.is_empty());
        parts.extend(needs.map(|(robot, why)| format!("{robot}: {}", why.join(", "))));
        Some(parts.join("  "))
    }

    fn known(&self, channel: &str) -> Option<f64> {
        self.state.get(channel).copied().filter(|value| value.is_finite())
    }
}

fn counted(count: u64, one: &str, several: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}

#[cfg(test)]
mod tests {
    use teampulse_core::data::EventKind;
    use teampulse_core::stream::{Shape, Subject};

    use super::*;

    fn state(team: &mut Team, values: [f64; 3]) {
        let channels = [("people", "1"), ("robots_online", "1"), ("unanswered_secs", "s")];
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

    fn alert(team: &mut Team, robot: &str, why: &str, stage: Stage) {
        let alert = Alert { robot: robot.to_owned(), why: why.to_owned(), stage };
        let (kind, label) = (EventKind::Fault, alert.label());
        let event = Event { kind, label, value: f64::NAN, duration_secs: f64::NAN };
        team.take_event(&Stream::raw(ALERTS, Subject::team(), Shape::Event), &event);
    }

    #[test]
    fn the_team_is_one_line_with_who_needs_someone_and_why() {
        let mut team = Team::default();
        assert_eq!(team.line(), None);
        alert(&mut team, "robot2", "offline", Stage::Raised);
        alert(&mut team, "robot3", "poor link", Stage::Raised);
        alert(&mut team, "robot3", "wifi is stuck", Stage::Raised);
        state(&mut team, [1.0, 4.0, 12.4]);
        insta::assert_snapshot!(team.line().unwrap(), @"team  1 person  4 robots online  unanswered for 12 s  robot2: offline  robot3: poor link, wifi is stuck");
        alert(&mut team, "robot3", "poor link", Stage::Answered);
        alert(&mut team, "robot3", "wifi is stuck", Stage::Over);
        alert(&mut team, "robot2", "offline", Stage::Answered);
        state(&mut team, [0.0, f64::NAN, f64::NAN]);
        assert_eq!(team.line().unwrap(), "team  0 people");
    }
}
