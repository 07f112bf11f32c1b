//! Which robots need someone, since when and why, and how many people there are for them.

mod alerts;
mod signs;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::alerts::ALERTS;
use teampulse_core::data::{Data, Reason};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs, Scope};
use teampulse_core::qos::Qos;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::stream::{About, Origin, Shape, Signal, Stream, StreamId, Subject};
use teampulse_core::time::Time;
use teampulse_signal::estimate::Estimate;

use self::alerts::Alerts;
use self::signs::{Limits, Said, Sign};
use super::interventions::is_command;
use crate::context::{FeatureContext, duration_setting};
use crate::inputs::Inputs;
use crate::robots::deployment;
use crate::value::{Value, window_of};
use crate::whole_seconds::WholeSeconds;

/// The stream of the team's state.
const STATE: &str = "/team/state";
/// The number of alerts that are kept for late joiners.
const KEPT_ALERTS: u32 = 1000;

/// Which robots need someone, since when and why, and how many people there are for them.
///
/// - Measures: the people present, the robots online, robots per person, the robots that need someone,
///   and how long the oldest of their alerts has waited. A robot needs someone when it is offline, its
///   battery is low or soon empty, its diagnostics report an error, its link is poor or a sensor is
///   stuck, from the start of the cause until it ends or a person commands the robot.
/// - Formula: a person is present while samples of the person's streams arrive, with silences of at most
///   `present_secs`. An alert is raised when its cause begins, one for each robot and reason; answered
///   when the robot is commanded afterwards; over when the cause ends, for a limit a tenth beyond it. All
///   three are events: a fault, then markers with the time to the answer [s] and the length.
/// - Unit: 1, 1, 1, 1, s.
/// - Window: none; once a second, and an event at each change.
/// - Reference: how many robots there are for a person, for comparison with the fan-out, the number of
///   robots that one person can look after: Olsen & Goodrich (2003), "Metrics for evaluating human-robot
///   interactions", NIST's workshop on performance metrics for intelligent systems; Olsen & Wood (2004),
///   doi:10.1145/985692.985722.
/// - Limits: uses the features `deployment`, `battery_use`, `diagnostics_level`, `link_quality` and
///   `stuck`, without those that a study disables. Whether a command was meant as an answer is not
///   known. A robot that was never seen has no alert.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Attention {
    /// The silence after which a person is no longer present [s].
    pub present_secs: f64,
    /// The share of its charge below which a battery is low [0..1].
    pub low_battery: f64,
    /// The time before a battery is empty from which the robot needs someone [s].
    pub empty_in_secs: f64,
    /// The quality below which a link is poor [0..1].
    pub poor_link: f64,
}

impl Default for Attention {
    fn default() -> Attention {
        Attention { present_secs: 5.0, low_battery: 0.2, empty_in_secs: 300.0, poor_link: 0.3 }
    }
}

impl Component<dyn Feature, FeatureContext> for Attention {
    const EXAMPLE: &'static str = "low_battery = 0.2\nempty_in_secs = 300";

    fn build(self, _: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        duration_setting("present_secs", self.present_secs)?;
        duration_setting("empty_in_secs", self.empty_in_secs)?;
        for (name, share) in [("low_battery", self.low_battery), ("poor_link", self.poor_link)] {
            if !(0.0..=1.0).contains(&share) {
                let wrong = format!("`{name}` is {share}: expected a share from 0 to 1");
                return Err(SettingsError::new(wrong).with_hint("1 is all of it").at(name));
            }
        }
        Ok(Box::new(self))
    }
}

impl Attention {
    fn limits(&self) -> Limits {
        Limits {
            low_battery: self.low_battery,
            empty_in_secs: self.empty_in_secs,
            poor_link: self.poor_link,
        }
    }

    /// The contribution of a stream to the team's state.
    fn role(&self, stream: &Stream) -> Option<Role> {
        let (raw, id) = (stream.origin == Origin::Raw, || stream.id.clone());
        if stream.about == About::Person && raw {
            return Some(Role::Life { person: id() });
        }
        if is_command(stream) {
            return Some(Role::Command { robot: id() });
        }
        if let Some(channel) = online_channel(stream) {
            return Some(Role::Online { robot: id(), channel });
        }
        let signs = Sign::of(stream, &self.limits());
        (!signs.is_empty()).then(|| Role::Signs { robot: id(), signs })
    }
}

impl Feature for Attention {
    fn accepts(&self, stream: &Stream) -> bool {
        self.role(stream).is_some()
    }

    fn scope(&self) -> Scope {
        Scope::Session
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        Box::new(AttentionExtractor {
            settings: *self,
            roles: BTreeMap::new(),
            people: BTreeMap::new(),
            online: BTreeMap::new(),
            alerts: Alerts::default(),
            inputs: Inputs::default(),
            outputs: None,
            seconds: WholeSeconds::default(),
            due: None,
        })
    }
}

/// What a stream contributes to the team's state.
enum Role {
    /// A person is present.
    Life { person: String },
    /// A person commands a robot.
    Command { robot: String },
    /// Whether a robot is online, on this channel.
    Online { robot: String, channel: usize },
    /// Whether a robot needs someone.
    Signs { robot: String, signs: Vec<Sign> },
}

/// The channel in which `deployment` reports whether a robot is online.
fn online_channel(stream: &Stream) -> Option<usize> {
    let of_robot = stream.about == About::Robot && stream.origin == Origin::Derived;
    let is_deployment = of_robot && stream.family == deployment::FAMILY;
    stream.place_of("online").filter(|_| is_deployment)
}

struct AttentionExtractor {
    settings: Attention,
    roles: BTreeMap<StreamId, Role>,
    /// The time of each person's last sample.
    people: BTreeMap<String, Time>,
    /// Whether each robot was online at last.
    online: BTreeMap<String, bool>,
    alerts: Alerts,
    inputs: Inputs,
    outputs: Option<(OutputId, OutputId)>,
    seconds: WholeSeconds,
    /// The second whose state is reported with the next tick, when all features have reported theirs.
    due: Option<Time>,
}

impl Extractor for AttentionExtractor {
    fn join(&mut self, id: StreamId, stream: &Stream, out: &mut Outputs) {
        if let Some(role) = self.settings.role(stream) {
            self.roles.insert(id, role);
            self.inputs.join(stream);
        }
        if self.outputs.is_none() {
            self.declare(out);
        }
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        let Some((_, events)) = self.outputs else { return };
        match self.roles.get_mut(&sample.stream) {
            Some(Role::Life { person }) => match self.people.get_mut(person) {
                Some(last) => *last = sample.log_time,
                None => {
                    self.people.insert(person.clone(), sample.log_time);
                }
            },
            Some(Role::Command { robot }) => self.alerts.answer(robot, sample.measured),
            Some(Role::Online { robot, channel }) => {
                if let Some(online) = number(&sample.data, *channel) {
                    self.online.insert(robot.clone(), online > 0.0);
                }
            }
            Some(Role::Signs { robot, signs }) => {
                for sign in signs {
                    match sign.read(&sample.data) {
                        Some(Said::Needs) => {
                            self.alerts.begin(robot, sign.why(), sample.stream, sample.measured);
                        }
                        Some(Said::Fine) => {
                            self.alerts.end(robot, sign.why(), sample.stream, sample.measured);
                        }
                        None => {}
                    }
                }
            }
            None => {}
        }
        self.alerts.report(events, out);
    }

    fn push_late(&mut self, sample: &Sample, out: &mut Outputs) {
        self.push(sample, out);
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        if let (Some(second), Some((state, _))) = (self.due.take(), self.outputs) {
            self.declare(out);
            out.emit(state, second, window_of(1.0, 1.0, 1.0, &self.values(second)));
        }
        self.due = self.seconds.passed(now);
    }
}

impl AttentionExtractor {
    /// People, robots online, robots per person, robots that need someone, and the age of the oldest
    /// alert that nobody has answered [s].
    fn values(&self, now: Time) -> [Value; 5] {
        let is_there = |last: &&Time| now.secs_since(**last) <= self.settings.present_secs;
        let people = self.people.values().filter(is_there).count() as f64;
        let online = self.online.values().filter(|online| **online).count() as f64;
        let known = |value: f64| Ok(Estimate::unstated(value));
        let robots = if self.online.is_empty() { Err(Reason::Missing) } else { known(online) };
        let each = |robots: Estimate| {
            let alone = Err(Reason::Undefined);
            if people > 0.0 { known(robots.value / people) } else { alone }
        };
        let oldest = self.alerts.oldest_unanswered(now).map(|begun| now.secs_since(begun));
        [
            known(people),
            robots,
            robots.and_then(each),
            known(self.alerts.robots_in_need() as f64),
            oldest.map(Estimate::unstated).ok_or(Reason::Nothing),
        ]
    }

    fn declare(&mut self, out: &mut Outputs) {
        let Some(inputs) = self.inputs.take_news() else { return };
        let state = out.declare(state_stream(&inputs, &self.settings));
        let events = out.declare(alerts_stream(&inputs, &self.settings));
        self.outputs = Some((state, events));
    }
}

/// A number of a feature, where it has one.
fn number(data: &Data, channel: usize) -> Option<f64> {
    let Data::Feature(values) = data else { return None };
    values.values.get(channel).copied().filter(|value| value.is_finite())
}

fn state_stream(inputs: &[String], settings: &Attention) -> Stream {
    let channels = [
        ("people", "1"),
        ("robots_online", "1"),
        ("robots_per_person", "1"),
        ("robots_in_need", "1"),
        ("unanswered_secs", "s"),
    ];
    Stream {
        inputs: inputs.to_vec(),
        rate_hz: 1.0,
        method: format!(
            "people of whom something came in {} s; robots online per person; {}",
            settings.present_secs,
            settings.limits()
        ),
        doc: "How many people there are for how many robots, and how many of those need someone."
            .to_owned(),
        ..Stream::concluded(STATE, Subject::team(), "state", Shape::Feature)
            .with_channels(&channels)
    }
}

fn alerts_stream(inputs: &[String], settings: &Attention) -> Stream {
    Stream {
        signal: Signal::Event,
        inputs: inputs.to_vec(),
        method: settings.limits().to_string(),
        doc: "When a robot needs someone, was answered (value: after how many seconds), and needs \
              nobody any more."
            .to_owned(),
        qos: vec![Qos::latched(KEPT_ALERTS)],
        ..Stream::concluded(ALERTS, Subject::team(), "alerts", Shape::Event)
    }
}
