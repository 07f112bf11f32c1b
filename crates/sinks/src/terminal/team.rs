//! The team: who is present, and which robots need attention.

use std::collections::BTreeMap;

use teampulse_core::alerts::{ALERTS, Alert, Stage, Why};
use teampulse_core::data::{Event, FeatureValues};
use teampulse_core::stream::{About, Stream};
use teampulse_core::time::Time;

use super::format::counted;

/// The newest state of the team.
#[derive(Debug, Default)]
pub(super) struct Team {
    /// The state by channel.
    state: BTreeMap<String, f64>,
    /// The open alerts of each robot, with their times.
    needs: BTreeMap<String, Vec<(Why, Time)>>,
}

/// A robot that needs attention.
#[derive(Debug)]
pub(super) struct Need<'a> {
    /// The robot.
    pub robot: &'a str,
    /// Why, in words.
    pub why: String,
    /// Since when.
    pub since: Time,
}

impl Team {
    /// Takes the state of the team, if it is that.
    pub fn take(&mut self, stream: &Stream, values: &FeatureValues) {
        if stream.about == About::Team && stream.name == "/team/state" {
            let named = stream.channels.iter().map(|channel| channel.name.clone());
            self.state = named.zip(values.values.iter().copied()).collect();
        }
    }

    /// Takes an alert, if it is one.
    pub fn take_event(&mut self, stream: &Stream, event: &Event, at: Time) {
        let alert = Alert::read(&event.label).filter(|_| stream.name == ALERTS);
        let Some(Alert { robot, why, stage }) = alert else { return };
        let needs = self.needs.entry(robot).or_default();
        needs.retain(|(other, _)| *other != why);
        if stage == Stage::Raised {
            needs.push((why, at));
        }
    }

    /// The robots that need attention, with all reasons.
    pub fn needs(&self) -> impl Iterator<Item = Need<'_>> {
        self.needs.iter().filter_map(|(robot, needs)| {
            let since = needs.iter().map(|(_, since)| *since).min()?;
            let why: Vec<String> = needs.iter().map(|(why, _)| why.to_string()).collect();
            Some(Need { robot, why: why.join(", "), since })
        })
    }

    /// The attendance, given the number of robots seen; `None` while unknown.
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
    use teampulse_core::data::EventKind;
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

    fn alert(team: &mut Team, secs: i32, (robot, why): (&str, Why), stage: Stage) {
        let alert = Alert { robot: robot.to_owned(), why, stage };
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
        needs.map(|need| (need.robot.to_owned(), need.why, need.since.secs())).collect()
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
}
