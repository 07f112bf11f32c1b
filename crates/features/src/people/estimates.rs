//! Estimates of a person's workload and arousal.

mod combined;
mod output;
mod person;
mod physiology;
mod reports;

use std::collections::BTreeMap;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::feature::{Extractor, Feature, Outputs, Scope};
use teampulse_core::phases::Phases;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::reports::Isa;
use teampulse_core::sample::Sample;
use teampulse_core::stream::{About, Origin, Shape, Stream, StreamId, Subject, Window};
use teampulse_core::time::Time;

use self::person::Person;
use super::state;
use crate::context::{FeatureContext, duration_setting};
use crate::value::moment;
use crate::whole_seconds::WholeSeconds;

/// The family of estimates.
pub const FAMILY: &str = "estimates";

/// Estimates of a person's workload and arousal, from their own state and from self-reports.
///
/// - Measures: nothing: these are estimates. `workload_physiology` and `arousal` state how far the body is from the
///   person's own baseline, `workload_report` the person's rating (ISA, 1 to 5), and `workload` combines both.
/// - Formula: each measure contributes z/(|z| + 3) in its direction, z the robust z of `state` (z where that is
///   undefined). `workload_physiology` is the mean of heart rate (up), ln RMSSD (down) and breathing rate (up),
///   `arousal` that of skin level (up) and response rate (up), as far as they are known, and at least 0.
///   `workload_report` is (ISA − 1)/4 of the newest report about the phase. `workload` combines both by inverse
///   variance. Sigmas: 0.21 at least; the spread of the measures, the uncertainty of the baseline and the scatter of a
///   window add to it; a report has the same 0.21, its variance doubles within `report_secs` and grows as the window
///   leaves the phase that the report is about; where body and report contradict each other, the combined sigma is
///   larger.
/// - Unit: 1, on [0..1]: 0 as in the baseline or below (ISA 1), 1 for the maximum (ISA 5).
/// - Window: those of `state`, once a second, and phases; for reports alone those of the study.
/// - Reference: three classes of workload are classified correctly in 72 % of cases within people, and in
///   46 % across people (MOCAS, arXiv:2210.03065): 0.21 is the sigma that gives 72 %, 0.7 would be that of
///   46 %. Directions: Mehler et al. (2012), doi:10.1177/0018720812442086; Grassmann et al. (2016),
///   doi:10.1155/2016/8146809; Boucsein et al. (2012), doi:10.1111/j.1469-8986.2012.01384.x. Reports:
///   Tattersall & Foord (1996), doi:10.1080/00140139608964495.
/// - Limits: heart, breath and skin respond to posture, speech, heat, coffee and surprise as well; the index compares a
///   person with their own baseline, never people with each other; the scale is a convention. Against a baseline too
///   short for z (see `state`) the body gives no estimate, and reports alone do. A report belongs to the phase in which
///   it is given, or to the previous phase if that ended less than 10 s before, so a phase is reported 11 s after its
///   end, or as the session ends. Reports are events of kind `report` labelled `isa` about the person, or on
///   /session/events labelled `isa p001`, or just `isa` if there is only one person. A report that is not on the scale
///   is not used; the first of each person is published as a fault on `/humans/persons/<id>/reports/faults`, and the
///   first about an unknown person on `/session/reports/faults`. Hidden from the screen unless the study sets
///   `show_estimates`: an experimenter who sees them is no longer blind.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Estimates {
    /// The time after which the variance of a report has doubled [s].
    pub report_secs: f64,
}

impl Default for Estimates {
    /// Reports are requested every two minutes (Tattersall & Foord 1996).
    fn default() -> Estimates {
        Estimates { report_secs: 120.0 }
    }
}

impl Component<dyn Feature, FeatureContext> for Estimates {
    const EXAMPLE: &'static str = "report_secs = 120";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        let doubled_secs = duration_setting("report_secs", self.report_secs)?;
        let windows = context.windows_or(None)?;
        let windows = windows.into_iter().map(|secs| (Window::of_secs(secs), secs)).collect();
        Ok(Box::new(Estimating { doubled_secs, windows }))
    }
}

struct Estimating {
    doubled_secs: f64,
    /// Windows of reports alone, with their lengths [s].
    windows: Vec<(Window, f64)>,
}

impl Feature for Estimating {
    fn accepts(&self, stream: &Stream) -> bool {
        is_of_a_person(stream) || Phases::hears(stream) && stream.about != About::Robot
    }

    fn scope(&self) -> Scope {
        Scope::Session
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        Box::new(EstimatesExtractor {
            doubled_secs: self.doubled_secs,
            windows: self.windows.clone(),
            of_session: None,
            events: BTreeMap::new(),
            states: BTreeMap::new(),
            people: BTreeMap::new(),
            is_nobody_told: false,
            seconds: WholeSeconds::default(),
        })
    }
}

/// Whether a stream has windows about a person, states included: these show who is present.
fn is_of_a_person(stream: &Stream) -> bool {
    stream.about == About::Person
        && stream.origin == Origin::Derived
        && stream.shape == Shape::Feature
        && !stream.id.is_empty()
        && stream.window.is_some()
        && stream.family != FAMILY
}

/// The estimates about all people.
struct EstimatesExtractor {
    doubled_secs: f64,
    windows: Vec<(Window, f64)>,
    /// The stream of the session's phases, as soon as there are any.
    of_session: Option<String>,
    /// The streams of events, by their subjects and names.
    events: BTreeMap<StreamId, (Subject, String)>,
    /// The streams of states, by their subjects and spans.
    states: BTreeMap<StreamId, (String, Window)>,
    people: BTreeMap<String, Person>,
    /// Whether a fault about a report for an unknown person was published.
    is_nobody_told: bool,
    seconds: WholeSeconds,
}

impl Extractor for EstimatesExtractor {
    fn join(&mut self, id: StreamId, stream: &Stream, _: &mut Outputs) {
        if stream.shape == Shape::Event {
            self.events.insert(id, (stream.subject(), stream.name.clone()));
        }
        if stream.about != About::Person {
            return;
        }
        let new = || {
            let mut person = Person::new(stream.subject(), self.doubled_secs);
            self.of_session.iter().for_each(|stream| person.heed(stream));
            person
        };
        let person = self.people.entry(stream.id.clone()).or_insert_with(new);
        person.measure(stream);
        if let (Some(window), state::FAMILY) = (stream.window, stream.family.as_str()) {
            person.join(stream, window);
            self.states.insert(id, (stream.id.clone(), window));
        }
    }

    fn phases_changed(&mut self, by: &Sample, _: &mut Outputs) {
        let Some((subject, stream)) = self.events.get(&by.stream) else { return };
        if subject.about == About::Session {
            self.of_session = Some(stream.clone());
            self.people.values_mut().for_each(|person| person.heed(stream));
        } else if let Some(person) = self.people.get_mut(&subject.id) {
            person.heed(stream);
        }
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        match &sample.data {
            Data::Feature(values) => {
                let Some((id, window)) = self.states.get(&sample.stream) else { return };
                let Some(person) = self.people.get_mut(id) else { return };
                let phases = out.phases();
                let own = phases.of(person.subject());
                person.take((*window, sample.measured), values, own, out);
            }
            Data::Event(event) => self.hear(sample, event, out),
            _ => return,
        }
        let phases = out.phases();
        if phases.is_over() {
            for person in self.people.values_mut() {
                let own = phases.of(person.subject());
                person.report_phases(sample.log_time, true, own, out);
            }
        }
    }

    fn push_late(&mut self, sample: &Sample, out: &mut Outputs) {
        self.push(sample, out);
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        let Some(second) = self.seconds.passed(now) else { return };
        let phases = out.phases();
        for person in self.people.values_mut() {
            let own = phases.of(person.subject());
            person.report(second, &self.windows, own, out);
        }
    }
}

impl EstimatesExtractor {
    /// Takes in an event, which may be a report.
    fn hear(&mut self, sample: &Sample, event: &Event, out: &mut Outputs) {
        let Some((subject, stream)) = self.events.get(&sample.stream) else { return };
        let of_session = subject.about == About::Session;
        let isa = Isa::read(event).map(|isa| isa.person);
        let named = if of_session { isa } else { Some(subject.id.as_str()) };
        let person = match named {
            Some("") if self.people.len() == 1 => self.people.values_mut().next(),
            Some(id) => self.people.get_mut(id),
            None => None,
        };
        if let Some(person) = person {
            person.hear(sample.measured, event, stream, out);
        } else if let Some(id) = named.filter(|_| of_session)
            && !std::mem::replace(&mut self.is_nobody_told, true)
        {
            let output = out.declare(output::faults(&Subject::session(), stream));
            let label = output::about_nobody(id, self.people.len());
            let fault = moment(EventKind::Fault, label);
            out.emit(output, sample.measured, Data::Event(Arc::new(fault)));
        }
    }
}

#[cfg(test)]
mod tests;
