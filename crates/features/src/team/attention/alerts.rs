//! Alerts: raised, answered, over.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use teampulse_core::alerts::{Alert, Stage, Why};
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::feature::{OutputId, Outputs};
use teampulse_core::stream::StreamId;
use teampulse_core::time::Time;

use crate::value::moment;

/// The alerts that are not over: one for each robot and reason.
#[derive(Debug, Default)]
pub(super) struct Alerts {
    open: BTreeMap<(String, Why), Need>,
    unreported: Vec<(Time, Event)>,
}

/// A robot that needs someone.
#[derive(Debug)]
struct Need {
    begun: Time,
    is_answered: bool,
    /// The streams that report it.
    causes: BTreeSet<StreamId>,
}

impl Alerts {
    /// Notes that a stream reports from now on that a robot needs someone.
    pub(super) fn begin(&mut self, robot: &str, why: &Why, says: StreamId, at: Time) {
        let key = (robot.to_owned(), why.clone());
        if let Some(alert) = self.open.get_mut(&key) {
            alert.causes.insert(says);
            return;
        }
        let causes = BTreeSet::from([says]);
        self.open.insert(key, Need { begun: at, is_answered: false, causes });
        let raised = reported(EventKind::Fault, robot, why, Stage::Raised);
        self.unreported.push((at, Event { duration_secs: f64::NAN, ..raised }));
    }

    /// Notes that a stream no longer reports that a robot needs someone.
    pub(super) fn end(&mut self, robot: &str, why: &Why, says: StreamId, at: Time) {
        let key = (robot.to_owned(), why.clone());
        let Some(alert) = self.open.get_mut(&key) else { return };
        alert.causes.remove(&says);
        if !alert.causes.is_empty() {
            return;
        }
        let over = reported(EventKind::Marker, robot, why, Stage::Over);
        let duration_secs = at.secs_since(alert.begun).max(0.0);
        self.open.remove(&key);
        self.unreported.push((at, Event { duration_secs, ..over }));
    }

    /// Takes in a command of a person to a robot: it answers all earlier alerts of the robot.
    pub(super) fn answer(&mut self, robot: &str, at: Time) {
        for ((_, why), alert) in self.open.iter_mut().filter(|((id, _), _)| id == robot) {
            if !alert.is_answered && alert.begun <= at {
                alert.is_answered = true;
                let answered = reported(EventKind::Marker, robot, why, Stage::Answered);
                self.unreported.push((at, Event { value: at.secs_since(alert.begun), ..answered }));
            }
        }
    }

    /// Reports changes.
    pub(super) fn report(&mut self, events: OutputId, out: &mut Outputs) {
        for (at, event) in self.unreported.drain(..) {
            out.emit(events, at, Data::Event(Arc::new(event)));
        }
    }

    /// The number of robots with an alert that nobody has answered.
    pub(super) fn robots_in_need(&self) -> usize {
        let robots = self.unanswered().map(|((robot, _), _)| robot);
        robots.collect::<BTreeSet<&String>>().len()
    }

    /// The start of the oldest alert that nobody has answered, of those up to now.
    pub(super) fn oldest_unanswered(&self, now: Time) -> Option<Time> {
        let begun = self.unanswered().map(|(_, alert)| alert.begun);
        begun.min().map(|begun| begun.min(now))
    }

    fn unanswered(&self) -> impl Iterator<Item = (&(String, Why), &Need)> {
        self.open.iter().filter(|(_, alert)| !alert.is_answered)
    }
}

fn reported(kind: EventKind, robot: &str, why: &Why, stage: Stage) -> Event {
    let alert = Alert { robot: robot.to_owned(), why: why.clone(), stage };
    moment(kind, alert.label())
}
