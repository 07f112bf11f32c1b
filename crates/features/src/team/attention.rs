//! Who needs someone, since when and why, and how many people there are for the robots.

mod alerts;
mod signs;
mod watched_number;
mod watching;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod study_tests;

use std::collections::BTreeMap;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::alerts::{ALERTS, FAMILY};
use teampulse_core::data::{Data, EventKind, Reason};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs, Scope};
use teampulse_core::qos::Qos;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::stream::{About, Origin, Shape, Signal, Stream, StreamId, Subject};
use teampulse_core::time::Time;
use teampulse_signal::estimate::Estimate;

use self::alerts::{Alerts, Concern, Topic};
use self::signs::{Limits, Sign};
use self::watching::{Watching, stream_of};
use super::interventions::is_command;
use crate::context::{FeatureContext, duration_setting};
use crate::inputs::Inputs;
use crate::robots::deployment;
use crate::thresholds::Threshold;
use crate::value::{Value, moment, window_of};
use crate::whole_seconds::WholeSeconds;

/// The stream of the team's state.
const STATE: &str = "/team/state";
/// The number of alerts that are kept for late joiners.
const KEPT_ALERTS: u32 = 1000;

/// Who needs someone, since when and why, and how many people there are for the robots.
///
/// - Measures: the people present, the robots online, robots per person, the robots that need someone,
///   and how long the oldest of their alerts has waited. A robot needs someone when it is offline, its
///   battery is low or soon empty, its diagnostics report an error, its link is poor or a sensor is
///   stuck, from the start of the cause until it ends or a person commands the robot. Besides these, the study's
///   `[[alerts]]` on any numbers of people, robots and the team.
/// - Formula: a person is present while samples of the person's streams arrive, with silences of at most
///   `present_secs`. An alert is raised when its cause begins, one for each robot and reason; answered
///   when the robot is commanded afterwards; over when the cause ends, with a hysteresis of a tenth for limits. All
///   three are events: a fault, then markers with the time to the answer [s] and the duration. An alert of
///   the study is also unknown while its number is missing: it does not silently continue or end.
/// - Unit: 1, 1, 1, 1, s.
/// - Window: none; once a second, and an event at each change.
/// - Reference: the number of robots per person, for comparison with the fan-out, the number of
///   robots that one person can look after: Olsen & Goodrich (2003), "Metrics for evaluating human-robot
///   interactions", NIST's workshop on performance metrics for intelligent systems; Olsen & Wood (2004),
///   doi:10.1145/985692.985722.
/// - Limits: uses the features `deployment`, `battery_use`, `diagnostics_level`, `link_quality` and
///   `stuck`, without those that a study disables. Whether a command was meant as an answer is not
///   known. A robot that was never seen has no alert. Alerts about people are on streams of their own
///   (`/humans/persons/p001/alerts`), which are published only if the study names them; those on estimates are
///   hidden where estimates are.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Attention {
    /// The silence after which a person is no longer present [s].
    pub present_secs: f64,
    /// The share of its charge below which a battery is low [0..1].
    pub low_battery: f64,
    /// The robot needs someone if its battery will be empty within this time [s].
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

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        duration_setting("present_secs", self.present_secs)?;
        duration_setting("empty_in_secs", self.empty_in_secs)?;
        for (name, share) in [("low_battery", self.low_battery), ("poor_link", self.poor_link)] {
            if !(0.0..=1.0).contains(&share) {
                let wrong = format!("`{name}` is {share}: expected a share from 0 to 1");
                return Err(SettingsError::new(wrong).with_hint("1 means all of it").at(name));
            }
        }
        Ok(Box::new(Watchful { settings: self, alerts: context.alerts.as_slice().into() }))
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

/// The feature with the alerts of the study.
struct Watchful {
    settings: Attention,
    alerts: Arc<[Threshold]>,
}

impl Feature for Watchful {
    fn accepts(&self, stream: &Stream) -> bool {
        let is_watched = self.alerts.iter().any(|alert| alert.place_in(stream).is_some());
        // With alerts of the study it runs in any session, to report those that watch nothing.
        let is_of_session = stream.about == About::Session && !self.alerts.is_empty();
        is_watched || is_of_session || self.settings.role(stream).is_some()
    }

    fn scope(&self) -> Scope {
        Scope::Session
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        Box::new(AttentionExtractor {
            settings: self.settings,
            watching: Watching::new(Arc::clone(&self.alerts)),
            topics: BTreeMap::new(),
            roles: BTreeMap::new(),
            people: BTreeMap::new(),
            online: BTreeMap::new(),
            alerts: Alerts::default(),
            inputs: Inputs::default(),
            state: None,
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
    watching: Watching,
    /// The streams of alerts.
    topics: BTreeMap<Topic, OutputId>,
    roles: BTreeMap<StreamId, Role>,
    /// The time of each person's last sample.
    people: BTreeMap<String, Time>,
    /// Whether each robot was last reported as online.
    online: BTreeMap<String, bool>,
    alerts: Alerts,
    inputs: Inputs,
    state: Option<OutputId>,
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
        self.watching.join(id, stream);
        for topic in self.watching.topics_of(id) {
            if let (Some(declared), false) =
                (stream_of(topic, stream), self.topics.contains_key(topic))
            {
                self.topics.insert(topic.clone(), out.declare(declared));
            }
        }
        if self.state.is_none() {
            self.declare(out);
        }
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        self.watching.push(sample, &mut self.alerts);
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
                    if let Some(said) = sign.read(&sample.data) {
                        let concern = Concern::of_robot(robot, sign.why());
                        self.alerts.take(&concern, (sample.stream, SIGN), said, sample.measured);
                    }
                }
            }
            None => {}
        }
        self.alerts.report(&self.topics, out);
        if matches!(sample.data, Data::Event(_)) && out.phases().is_over() {
            let idle = self.watching.idle_so_far();
            self.report_idle(idle, sample.log_time, out);
        }
    }

    fn push_late(&mut self, sample: &Sample, out: &mut Outputs) {
        self.push(sample, out);
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        self.watching.tick(now, &mut self.alerts);
        self.alerts.report(&self.topics, out);
        let idle = self.watching.idle(now);
        self.report_idle(idle, now, out);
        if let (Some(second), Some(state)) = (self.due.take(), self.state) {
            self.declare(out);
            out.emit(state, second, window_of(1.0, 1.0, 1.0, &self.values(second)));
        }
        self.due = self.seconds.passed(now);
    }

    fn stood_still(&mut self, until: Time) {
        self.watching.stood_still(until);
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

    /// Reports alerts that watch nothing.
    fn report_idle(&self, idle: Vec<String>, at: Time, out: &mut Outputs) {
        let Some(events) = self.topics.get(&Topic::Team) else { return };
        for words in idle {
            let fault = moment(EventKind::Fault, words);
            out.emit(*events, at, Data::Event(Arc::new(fault)));
        }
    }

    fn declare(&mut self, out: &mut Outputs) {
        let news = self.inputs.take_news();
        let Some(inputs) = news.or_else(|| self.state.is_none().then(Vec::new)) else { return };
        self.state = Some(out.declare(state_stream(&inputs, &self.settings)));
        let is_extended = !self.watching.is_empty();
        let events = out.declare(alerts_stream(&inputs, &self.settings, is_extended));
        self.topics.insert(Topic::Team, events);
    }
}

/// The number under which a stream reports a sign of a robot's profile; those of the study's alerts are smaller.
const SIGN: usize = usize::MAX;

/// A number of a feature, if it has one.
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
            "people with data in the last {} s; robots online per person; {}",
            settings.present_secs,
            settings.limits()
        ),
        doc: "How many people there are for how many robots, and how many of those need someone."
            .to_owned(),
        ..Stream::concluded(STATE, Subject::team(), "state", Shape::Feature)
            .with_channels(&channels)
    }
}

fn alerts_stream(inputs: &[String], settings: &Attention, is_extended: bool) -> Stream {
    let own = if is_extended { "; and the limits of the study's [[alerts]]" } else { "" };
    Stream {
        signal: Signal::Event,
        inputs: inputs.to_vec(),
        method: format!("{}{own}", settings.limits()),
        doc: "When a robot needs someone, was answered (value: after how many seconds), and needs \
              nobody any more."
            .to_owned(),
        qos: vec![Qos::latched(KEPT_ALERTS)],
        ..Stream::concluded(ALERTS, Subject::team(), FAMILY, Shape::Event)
    }
}
