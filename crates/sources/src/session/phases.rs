//! Phases of a study, scheduled or begun manually.

use std::time::Duration;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::command::Instruction;
use teampulse_core::data::{Event, EventKind};
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::SettingsError;
use teampulse_core::reports::Noting;
use teampulse_core::source::{Source, SourceError};
use teampulse_core::time::Time;

use super::schedule::{Change, PhaseEvent, Schedule, ScheduleHandle};

/// The interval at which the session's clock is checked, and thus the largest delay of a phase.
const LOOK: Duration = Duration::from_millis(20);

/// A phase of a study. The one named `baseline` is the reference for everything after it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Phase {
    /// The name of the phase.
    pub name: String,
    /// When the phase begins, after the start of the session [s]. By default it begins manually: with Ctrl-N, or with a
    /// phase of its name on `/session/events`.
    pub from_secs: Option<f64>,
    /// When the phase ends [s]; by default at the start of the next phase, or with the session.
    pub to_secs: Option<f64>,
    /// How long the phase lasts [s], as an alternative to when it ends.
    pub lasts_secs: Option<f64>,
}

impl Phase {
    /// How long the phase lasts [s]; `None` if it lasts until the next one begins.
    pub fn length_secs(&self) -> Option<f64> {
        let until =
            self.to_secs.zip(self.from_secs).map(|(to_secs, from_secs)| to_secs - from_secs);
        self.lasts_secs.or(until)
    }

    /// When the phase ends [s], if both its start and its end are set.
    fn end_secs(&self) -> Option<f64> {
        Some(self.from_secs? + self.length_secs()?)
    }
}

/// Returns an error for the first phase that is invalid or overlaps another; the error's path is relative to the
/// phases.
pub fn check_phases(phases: &[Phase]) -> Result<(), SettingsError> {
    for (place, phase) in phases.iter().enumerate() {
        let wrong = |key, message: &str, hint: &str| {
            let error = SettingsError::new(message).with_hint(hint);
            Err(error.at(format!("{place}.{key}")))
        };
        if phase.name.trim().is_empty() {
            return wrong(
                "name",
                "a phase has no name",
                "give it the name that you will look for in the recording",
            );
        }
        if let Some(from_secs) = phase.from_secs.filter(|secs| !is_after_start(*secs)) {
            return wrong("from_secs", &no_time(from_secs), TIMES);
        }
        if let Some(to_secs) = phase.to_secs.filter(|secs| !is_after_start(*secs)) {
            return wrong("to_secs", &no_time(to_secs), TIMES);
        }
        match (phase.from_secs, phase.to_secs) {
            (None, Some(_)) => {
                let message = format!(
                    "the phase `{}` begins manually, so it is not known when it ends",
                    phase.name
                );
                return wrong("to_secs", &message, "give `lasts_secs`, or `from_secs`");
            }
            (Some(from_secs), Some(to_secs)) if to_secs <= from_secs => {
                let message = format!(
                    "the phase `{}` ends at {to_secs} s, but begins at {from_secs} s",
                    phase.name
                );
                let hint = "both count from the start of the session: `to_secs` must be later";
                return wrong("to_secs", &message, hint);
            }
            _ => {}
        }
        if let Some(lasts_secs) = phase.lasts_secs {
            let is_length = lasts_secs > 0.0 && lasts_secs <= LATEST_SECS;
            if !is_length {
                let message = format!("a phase can't last {lasts_secs} s");
                return wrong("lasts_secs", &message, "give seconds above 0");
            }
            if phase.to_secs.is_some() {
                let message =
                    format!("the phase `{}` has both `to_secs` and `lasts_secs`", phase.name);
                return wrong("lasts_secs", &message, "give one of them");
            }
        }
    }
    check_order(phases)
}

/// The hint for invalid times.
const TIMES: &str = "times count from the start of the session: from 0 to 1000000000 s";

/// The latest start or end of a phase [s]: far beyond any session, and still a valid time.
const LATEST_SECS: f64 = 1e9;

fn is_after_start(secs: f64) -> bool {
    (0.0..=LATEST_SECS).contains(&secs)
}

fn no_time(secs: f64) -> String {
    format!("a phase can't begin or end at {secs} s")
}

/// Sorts phases by their times, or keeps their order if one begins manually.
pub(super) fn in_order<T>(phases: &mut [T], phase: impl Fn(&T) -> &Phase) {
    if phases.iter().all(|each| phase(each).from_secs.is_some()) {
        let from_secs = |each: &T| phase(each).from_secs.unwrap_or_default();
        phases.sort_by(|a, b| from_secs(a).total_cmp(&from_secs(b)));
    }
}

/// Checks that each phase begins after the one before it ends.
fn check_order(phases: &[Phase]) -> Result<(), SettingsError> {
    let mut places: Vec<(usize, &Phase)> = phases.iter().enumerate().collect();
    in_order(&mut places, |(_, phase)| phase);
    let timed = places.iter().filter_map(|(place, phase)| Some((*place, *phase, phase.from_secs?)));
    let timed: Vec<(usize, &Phase, f64)> = timed.collect();
    for pair in timed.windows(2) {
        let [(_, first, first_secs), (place, next, next_secs)] = pair else { continue };
        if next_secs < first_secs {
            return Err(out_of_order((first, *first_secs), (next, *next_secs), *place));
        }
        let free_secs = first.end_secs().unwrap_or(*first_secs);
        if *next_secs < free_secs || next_secs <= first_secs {
            let until =
                first.end_secs().map_or_else(String::new, |to_secs| format!(" to {to_secs} s"));
            let message = format!(
                "the phases `{}` (from {first_secs} s{until}) and `{}` (from {next_secs} s) overlap",
                first.name, next.name
            );
            let hint = "one phase at a time: let the first end before the next begins";
            let error = SettingsError::new(message).with_hint(hint);
            return Err(error.at(format!("{place}.from_secs")));
        }
    }
    Ok(())
}

/// Returns the error for a phase that begins before one listed earlier, if one of the phases begins manually.
fn out_of_order(
    (first, first_secs): (&Phase, f64),
    (next, next_secs): (&Phase, f64),
    place: usize,
) -> SettingsError {
    let message = format!(
        "the phase `{}` (from {next_secs} s) is listed after `{}` (from {first_secs} s)",
        next.name, first.name
    );
    let hint = "list phases in the order in which they begin: a phase without `from_secs` begins after the one before it";
    SettingsError::new(message).with_hint(hint).at(format!("{place}.from_secs"))
}

/// The phases of a study, published as events when they begin: as planned or manually.
pub struct Phases {
    schedule: Schedule,
    handle: ScheduleHandle,
    started: Option<Time>,
    /// When the phase last changed.
    changed: Option<Time>,
}

impl Phases {
    /// Creates the source of these phases, which may be in any order.
    pub fn new(phases: Vec<Phase>, handle: ScheduleHandle) -> Phases {
        Phases { schedule: Schedule::new(phases), handle, started: None, changed: None }
    }

    /// Changes the phase at the time of the request, but not before the last change.
    fn carry_out(&mut self, instruction: &Instruction, started: Time, outlet: &Outlet) {
        let at = self.changed.map_or(instruction.at, |changed| changed.max(instruction.at));
        let Some(change) = Change::of(&instruction.command) else { return };
        if let Some(event) = self.schedule.apply(change, at.secs_since(started)) {
            self.report(outlet, &event, at);
        } else {
            let (verb, why) = (instruction.command.verb(), change.without_effect());
            let note = Noting::Phases.event(&format!("`{verb}` had no effect: {why}"));
            outlet.happen_at(note, Some(at));
        }
    }

    fn report(&mut self, outlet: &Outlet, event: &PhaseEvent, at: Time) {
        self.changed = Some(at);
        match event {
            PhaseEvent::Begins(name, lasts_secs) => {
                happen_at(outlet, (EventKind::Phase, name, *lasts_secs), at);
            }
            PhaseEvent::Aborted(name) => {
                happen_at(outlet, (EventKind::Marker, &format!("{name} aborted"), 0.0), at);
                // A phase without a name ends the current one.
                happen_at(outlet, (EventKind::Phase, "", 0.0), at);
            }
        }
    }

    /// Publishes the change of phase that is due now.
    fn happen(&mut self, outlet: &Outlet, started: Time) {
        let now = outlet.clock().now();
        let elapsed_secs = now.secs_since(started);
        while let Some(label) = self.handle.take_begun() {
            self.schedule.begun_elsewhere(&label, elapsed_secs);
        }
        if let Some(event) = self.schedule.due(elapsed_secs) {
            self.report(outlet, &event, now);
        }
        self.handle.show_next(self.schedule.next().map(str::to_owned));
    }
}

#[async_trait]
impl Source for Phases {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let started = *self.started.get_or_insert_with(|| outlet.clock().now());
        let mut commands = outlet.commands(|command| Change::of(command).is_some());
        loop {
            self.happen(outlet, started);
            tokio::select! {
                Some(instruction) = commands.recv() => self.carry_out(&instruction, started, outlet),
                () = tokio::time::sleep(LOOK) => {}
                () = outlet.closed() => return Ok(()),
            }
        }
    }
}

fn happen_at(outlet: &Outlet, (kind, label, duration_secs): (EventKind, &str, f64), at: Time) {
    let event = Event { kind, label: label.to_owned(), value: f64::NAN, duration_secs };
    outlet.happen_at(event, Some(at));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn phase(name: &str, from_secs: f64, to_secs: Option<f64>) -> Phase {
        Phase { name: name.into(), from_secs: Some(from_secs), to_secs, lasts_secs: None }
    }

    fn by_hand(name: &str, to_secs: Option<f64>, lasts_secs: Option<f64>) -> Phase {
        Phase { name: name.into(), from_secs: None, to_secs, lasts_secs }
    }

    #[test]
    fn a_phase_without_a_time_begins_by_hand_and_may_have_a_length() {
        let phases = [by_hand("baseline", None, Some(60.0)), by_hand("task", None, None)];
        assert_eq!(check_phases(&phases), Ok(()));
        for (wrong, path) in [
            (by_hand("a", Some(60.0), None), "0.to_secs"),
            (by_hand("a", None, Some(0.0)), "0.lasts_secs"),
            (by_hand("a", None, Some(f64::NAN)), "0.lasts_secs"),
            (Phase { lasts_secs: Some(5.0), ..phase("a", 0.0, Some(60.0)) }, "0.lasts_secs"),
        ] {
            let error = check_phases(&[wrong]).unwrap_err();
            assert_eq!(error.path, path, "{error}");
            assert!(!error.hint.is_empty());
        }
    }

    #[test]
    fn where_one_begins_by_hand_the_others_come_as_they_are_written() {
        let hand = || by_hand("instructions", None, None);
        let mut phases = [phase("b", 60.0, None), hand(), phase("a", 0.0, None)];
        assert_eq!(check_phases(&phases).unwrap_err().path, "2.from_secs");
        phases.swap(0, 2);
        assert_eq!(check_phases(&phases), Ok(()));
        let long = Phase { lasts_secs: Some(70.0), ..phase("a", 0.0, None) };
        assert_eq!(check_phases(&[long, phase("b", 60.0, None)]).unwrap_err().path, "1.from_secs");
    }

    #[test]
    fn a_phase_may_come_again_and_in_any_order() {
        let phases = [
            phase("task", 60.0, None),
            phase("baseline", 0.0, Some(60.0)),
            phase("task", 120.0, Some(180.0)),
        ];
        assert_eq!(check_phases(&phases), Ok(()));
        assert_eq!(check_phases(&[]), Ok(()));
    }

    #[test]
    fn a_phase_without_a_name_or_with_impossible_times_is_reported_in_its_place() {
        for (wrong, path) in [
            (phase(" ", 0.0, None), "1.name"),
            (phase("a", -1.0, None), "1.from_secs"),
            (phase("a", f64::NAN, None), "1.from_secs"),
            (phase("a", f64::INFINITY, None), "1.from_secs"),
            (phase("a", 5.0, Some(-1.0)), "1.to_secs"),
            (phase("a", 5.0, Some(f64::INFINITY)), "1.to_secs"),
            (phase("a", 5.0, Some(5.0)), "1.to_secs"),
            (phase("a", 5.0, Some(4.0)), "1.to_secs"),
        ] {
            let error = check_phases(&[phase("z", 900.0, None), wrong]).unwrap_err();
            assert_eq!(error.path, path, "{error}");
            assert!(!error.hint.is_empty());
        }
    }

    #[test]
    fn two_phases_at_a_time_are_reported_by_name() {
        for to_secs in [60.0, 50.5] {
            let phases = [phase("later", 50.0, None), phase("first", 0.0, Some(to_secs))];
            let error = check_phases(&phases).unwrap_err();
            assert_eq!(error.path, "0.from_secs");
            assert!(error.message.contains("`first`") && error.message.contains("`later`"));
        }
        let both = [phase("a", 3.0, None), phase("b", 3.0, None)];
        assert_eq!(check_phases(&both).unwrap_err().path, "1.from_secs");
    }
}
