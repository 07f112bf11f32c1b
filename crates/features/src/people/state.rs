//! The differences of a person from their own baseline.

mod baseline;
mod measures;
mod output;
mod person;
mod track;
mod whole;
mod windows;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::Data;
use teampulse_core::feature::{Extractor, Feature, Outputs, Scope};
use teampulse_core::phases::Phases;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::session_streams::session_events;
use teampulse_core::stream::{About, Stream, StreamId, Window};
use teampulse_core::time::Time;

pub(super) use self::measures::measures_of;
use self::measures::read_window;
use self::person::Person;
use crate::context::{FeatureContext, duration_setting};
use crate::whole_seconds::WholeSeconds;

/// The family of states.
pub(super) const FAMILY: &str = "state";

/// The differences of a person from their own baseline: heart, breath, skin and input.
///
/// - Measures: heart rate, ln RMSSD (from an ECG, else from intervals, else from a pulse wave), breathing rate,
///   skin conductance level, rate of skin responses, and input rate, each against the person's last finished phase
///   `baseline`; every second in windows of each length, and for each later phase when it is over.
/// - Formula: for windows: difference from the mean of the windows that lie wholly inside the baseline; z in
///   their SD (n − 1); robust z from their median in 1.4826 MAD. For phases: difference from the value of
///   the baseline as one phase, in the same SD and MAD, those of the shortest windows. Sigmas are the
///   uncertainty from the baseline; its overlapping windows count as n (1 − r)/(1 + r) independent ones, r
///   their correlation at lag 1, and at most as many as fit side by side.
/// - Unit: differences in 1/min, ln(ms), µS; z and robust z are dimensionless.
/// - Window: those of the families it reads, once a second; phases.
/// - Reference: Task Force (1996), doi:10.1161/01.CIR.93.5.1043, for the logarithm; Bayley & Hammersley
///   (1946), doi:10.2307/2983560, for overlapping windows.
/// - Limits: a description of one person, neither a test nor an explanation. Before a baseline is over there is no
///   state. A few windows vary less than a person does, and z against them is far too large: so it is reported only if
///   five windows fit side by side into the baseline without its gaps (150 s for windows of 30 s; a twentieth may be
///   missing), and five minutes are better; a difference needs nearly two windows. The reason for a missing measure is
///   `missing` if no sensor provides it, `no_baseline` if the sensor appeared later, `brief_baseline` if the baseline
///   is too short, and `gap` if its newest window is older than `stale_secs`; otherwise it is the reason of its window.
///   Among several devices the best family that has a baseline is used, within it the one with the best quality during
///   the baseline, among equals the first by name; this choice is kept until the next baseline.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct State {
    /// A window that ended longer ago is ignored [s].
    pub stale_secs: f64,
}

impl Default for State {
    fn default() -> State {
        State { stale_secs: 5.0 }
    }
}

impl Component<dyn Feature, FeatureContext> for State {
    const EXAMPLE: &'static str = "stale_secs = 5";

    fn build(self, _: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        duration_setting("stale_secs", self.stale_secs)?;
        Ok(Box::new(self))
    }
}

impl Feature for State {
    fn accepts(&self, stream: &Stream) -> bool {
        read_window(stream).is_some() || Phases::hears(stream) && stream.about != About::Robot
    }

    fn scope(&self) -> Scope {
        Scope::Session
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        Box::new(StateExtractor {
            stale_secs: self.stale_secs,
            phases_from: BTreeMap::new(),
            session: session_events().name,
            events: BTreeMap::new(),
            windows: BTreeMap::new(),
            people: BTreeMap::new(),
            seconds: WholeSeconds::default(),
        })
    }
}

/// The states of all people.
struct StateExtractor {
    stale_secs: f64,
    /// The streams of people's own phases, which replace the session's.
    phases_from: BTreeMap<String, String>,
    /// The stream of the session's phases.
    session: String,
    /// The streams that may contain phases, by their subjects and names.
    events: BTreeMap<StreamId, (About, String, String)>,
    /// The streams of windows and phases, by their subjects.
    windows: BTreeMap<StreamId, (String, Window)>,
    people: BTreeMap<String, Person>,
    seconds: WholeSeconds,
}

impl Extractor for StateExtractor {
    fn join(&mut self, id: StreamId, stream: &Stream, out: &mut Outputs) {
        let Some(window) = read_window(stream) else {
            self.events.insert(id, (stream.about, stream.id.clone(), stream.name.clone()));
            return;
        };
        self.windows.insert(id, (stream.id.clone(), window));
        let subject = stream.subject();
        let person = self.people.entry(stream.id.clone()).or_insert_with(|| {
            let mut person = Person::new(subject);
            person.heed(out.phases().of(&stream.subject()));
            person
        });
        person.join(id, stream, window);
    }

    fn phases_changed(&mut self, by: &Sample, out: &mut Outputs) {
        if let Some((About::Person, id, name)) = self.events.get(&by.stream) {
            self.phases_from.insert(id.clone(), name.clone());
        }
        let phases = out.phases();
        for person in self.people.values_mut() {
            let own = phases.of(person.subject());
            person.heed(own);
        }
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        if let (Some((id, window)), Data::Feature(values)) =
            (self.windows.get(&sample.stream), &sample.data)
        {
            let Some(person) = self.people.get_mut(id) else { return };
            person.take((sample.stream, sample.measured), *window, values);
        }
        if out.phases().is_over() {
            self.end(sample.log_time, out);
        }
    }

    fn push_late(&mut self, sample: &Sample, out: &mut Outputs) {
        self.push(sample, out);
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        let Some(second) = self.seconds.passed(now) else { return };
        let phases = out.phases();
        for person in self.people.values_mut() {
            let phases = phases.of(person.subject());
            let phases_from = self.phases_from.get(&person.subject().id).unwrap_or(&self.session);
            person.report(phases, phases_from, (second, self.stale_secs), out);
        }
    }
}

impl StateExtractor {
    /// Whether the session has ended: only its last phases are reported after that.
    fn end(&mut self, at: Time, out: &mut Outputs) {
        let phases = out.phases();
        for person in self.people.values_mut() {
            let phases = phases.of(person.subject());
            let phases_from = self.phases_from.get(&person.subject().id).unwrap_or(&self.session);
            person.judge(phases, phases_from, at, out);
            person.report_phases(phases, phases_from, at, out);
        }
    }
}

#[cfg(test)]
mod tests;
