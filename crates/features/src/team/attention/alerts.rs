//! Alerts: raised, answered, unknown, over.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use teampulse_core::alerts::{Alert, Stage, Tier, Why};
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::feature::{OutputId, Outputs};
use teampulse_core::stream::{About, StreamId, Subject};
use teampulse_core::time::Time;

use crate::value::moment;

/// The alerts that are not over: one for each concern.
#[derive(Debug, Default)]
pub(super) struct Alerts {
    open: BTreeMap<Concern, Need>,
    unreported: Vec<(Topic, Time, Event)>,
}

/// Who needs someone, and why; in the order in which a stream reports them.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Concern {
    /// The stream on which the concern is reported.
    pub(super) topic: Topic,
    /// The subject.
    pub(super) subject: Subject,
    /// The reason.
    pub(super) why: Why,
    /// How urgent the concern is, if the study states it.
    pub(super) tier: Option<Tier>,
}

impl Concern {
    /// The concern about a robot, from its profile.
    pub(super) fn of_robot(robot: &str, why: &Why) -> Concern {
        let (topic, subject) = (Topic::Team, Subject::robot(robot));
        Concern { topic, subject, why: why.clone(), tier: None }
    }

    fn event(&self, kind: EventKind, stage: Stage) -> Event {
        let who = match (self.subject.about, self.subject.id.as_str()) {
            (About::Team | About::Session, _) | (_, "") => self.subject.about.to_string(),
            (_, id) => id.to_owned(),
        };
        let alert = Alert { who, why: self.why.clone(), stage, tier: self.tier };
        moment(kind, alert.label())
    }

    /// Whether a robot waits for someone.
    fn is_of_waiting_robot(&self) -> bool {
        self.subject.about == About::Robot && self.tier != Some(Tier::Note)
    }
}

/// The stream that reports an alert. Alerts about a person are kept apart from those published on ROS, and alerts on
/// estimates from those shown to a blind experimenter.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Topic {
    /// Alerts about robots, the team and the session.
    Team,
    /// Alerts about a person.
    Person(String),
    /// Alerts on estimates about a person.
    Estimates(String),
}

/// The source of a concern: a stream, and one of its numbers and limits.
pub(super) type Cause = (StreamId, usize);

/// What a cause reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Said {
    /// Someone is needed, with the number.
    Needs(f64),
    /// It is no longer known whether someone is needed.
    Unknown,
    /// Nobody is needed.
    Fine,
}

/// A concern that is not over.
#[derive(Debug)]
struct Need {
    begun: Time,
    is_answered: bool,
    is_unknown: bool,
    /// The causes of the concern, each with whether it is still known.
    causes: BTreeMap<Cause, bool>,
}

impl Alerts {
    /// Takes in what a cause reports about a concern.
    pub(super) fn take(&mut self, concern: &Concern, cause: Cause, said: Said, at: Time) {
        match said {
            Said::Needs(number) => self.begin(concern, cause, number, at),
            Said::Unknown => self.lose(concern, cause, at),
            Said::Fine => self.end(concern, cause, at),
        }
    }

    fn begin(&mut self, concern: &Concern, cause: Cause, number: f64, at: Time) {
        if let Some(need) = self.open.get_mut(concern) {
            need.causes.insert(cause, true);
            if !std::mem::replace(&mut need.is_unknown, false) {
                return;
            }
        } else {
            let (is_answered, is_unknown) = (false, false);
            let causes = BTreeMap::from([(cause, true)]);
            let need = Need { begun: at, is_answered, is_unknown, causes };
            self.open.insert(concern.clone(), need);
        }
        let raised = concern.event(EventKind::Fault, Stage::Raised);
        let raised = Event { duration_secs: f64::NAN, value: number, ..raised };
        self.unreported.push((concern.topic.clone(), at, raised));
    }

    fn lose(&mut self, concern: &Concern, cause: Cause, at: Time) {
        if let Some(need) = self.open.get_mut(concern) {
            need.causes.entry(cause).and_modify(|knows| *knows = false);
        }
        self.settle(concern, at);
    }

    fn end(&mut self, concern: &Concern, cause: Cause, at: Time) {
        if let Some(need) = self.open.get_mut(concern) {
            need.causes.remove(&cause);
        }
        self.settle(concern, at);
    }

    /// Reports that a concern is over when no cause reports it any longer, or unknown when all that did are silent.
    fn settle(&mut self, concern: &Concern, at: Time) {
        let Some(need) = self.open.get_mut(concern) else { return };
        let lasted_secs = at.secs_since(need.begun).max(0.0);
        let stage = if need.causes.is_empty() {
            self.open.remove(concern);
            Stage::Over
        } else if need.causes.values().all(|knows| !knows) && !need.is_unknown {
            need.is_unknown = true;
            Stage::Unknown
        } else {
            return;
        };
        let event = concern.event(EventKind::Marker, stage);
        let event = Event { duration_secs: lasted_secs, ..event };
        self.unreported.push((concern.topic.clone(), at, event));
    }

    /// Takes in a person's command to a robot, which answers all earlier alerts of the robot.
    pub(super) fn answer(&mut self, robot: &str, at: Time) {
        let of_robot = |concern: &Concern| {
            concern.subject.about == About::Robot && concern.subject.id == robot
        };
        for (concern, need) in self.open.iter_mut().filter(|(concern, _)| of_robot(concern)) {
            if !need.is_answered && need.begun <= at {
                need.is_answered = true;
                let answered = concern.event(EventKind::Marker, Stage::Answered);
                let answered = Event { value: at.secs_since(need.begun), ..answered };
                self.unreported.push((concern.topic.clone(), at, answered));
            }
        }
    }

    /// Reports changes, each on the stream of its topic.
    pub(super) fn report(&mut self, topics: &BTreeMap<Topic, OutputId>, out: &mut Outputs) {
        for (topic, at, event) in self.unreported.drain(..) {
            if let Some(events) = topics.get(&topic) {
                out.emit(*events, at, Data::Event(Arc::new(event)));
            }
        }
    }

    /// The number of robots with an alert that nobody has answered.
    pub(super) fn robots_in_need(&self) -> usize {
        let robots = self.unanswered().map(|(concern, _)| &concern.subject);
        robots.collect::<BTreeSet<&Subject>>().len()
    }

    /// The start of the oldest alert that nobody has answered, of those up to now.
    pub(super) fn oldest_unanswered(&self, now: Time) -> Option<Time> {
        let begun = self.unanswered().map(|(_, need)| need.begun);
        begun.min().map(|begun| begun.min(now))
    }

    fn unanswered(&self) -> impl Iterator<Item = (&Concern, &Need)> {
        let waits = |(concern, need): &(&Concern, &Need)| {
            concern.is_of_waiting_robot() && !need.is_answered
        };
        self.open.iter().filter(waits)
    }
}
