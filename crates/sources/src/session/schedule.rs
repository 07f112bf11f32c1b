//! The schedule of a study's phases: as planned, and as changed by the operator.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use teampulse_core::command::Command;

use super::phases::{Phase, in_order};

/// The largest number of phases begun by other programs that wait to be processed.
const MOST_BEGUN: usize = 100;

/// A change to the schedule of phases.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    /// Begins the next phase now and shifts those after it.
    Next,
    /// Restarts the current or last phase.
    Repeat,
    /// Ends the current phase; no other begins until `Next` or `Repeat`.
    Abort,
}

impl Change {
    /// Returns the change that a command requests, if any.
    pub fn of(command: &Command) -> Option<Change> {
        match command {
            Command::NextPhase => Some(Change::Next),
            Command::RepeatPhase => Some(Change::Repeat),
            Command::AbortPhase => Some(Change::Abort),
            _ => None,
        }
    }

    /// Returns why the change has no effect if there is no such phase.
    pub fn without_effect(self) -> &'static str {
        match self {
            Change::Next => "no phase follows",
            Change::Repeat => "no phase has begun",
            Change::Abort => "no phase is running",
        }
    }
}

/// The next phase, and the phases begun by other programs. Clones share their state.
#[derive(Clone, Debug, Default)]
pub struct ScheduleHandle(Arc<Mutex<Shown>>);

#[derive(Debug, Default)]
struct Shown {
    /// The names of phases begun by other programs.
    begun: VecDeque<String>,
    next: Option<String>,
}

impl ScheduleHandle {
    /// Returns the next phase as displayed; `None` after the last.
    pub fn next(&self) -> Option<String> {
        self.lock().next.clone()
    }

    /// Records that another program has begun a phase of this name.
    pub(super) fn begin(&self, label: &str) {
        let mut shown = self.lock();
        if shown.begun.len() < MOST_BEGUN {
            shown.begun.push_back(label.to_owned());
        }
    }

    pub(super) fn take_begun(&self) -> Option<String> {
        self.lock().begun.pop_front()
    }

    pub(super) fn show_next(&self, next: Option<String>) {
        self.lock().next = next;
    }

    fn lock(&self) -> MutexGuard<'_, Shown> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A change of phase.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum PhaseEvent {
    /// A phase begins, with its length [s]; NaN if the length is open.
    Begins(String, f64),
    /// A phase was aborted.
    Aborted(String),
}

/// The phases of a study in order: which is next, and by how much the remaining ones are shifted.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    phases: Vec<Phase>,
    /// The index of the next phase.
    next: usize,
    /// The end of the phase that began last [s]; `None` before the first phase and after an abort.
    until_secs: Option<f64>,
    /// The delay of the remaining phases relative to the plan [s].
    moved_secs: f64,
    is_held: bool,
}

impl Schedule {
    /// Creates a schedule of these phases as planned.
    pub fn new(mut phases: Vec<Phase>) -> Schedule {
        in_order(&mut phases, |phase| phase);
        Schedule { phases, next: 0, until_secs: None, moved_secs: 0.0, is_held: false }
    }

    /// Returns the change that is due at a time after the start [s].
    pub fn due(&mut self, elapsed_secs: f64) -> Option<PhaseEvent> {
        let planned_secs = self.phases.get(self.next)?.from_secs? + self.moved_secs;
        (!self.is_held && elapsed_secs >= planned_secs).then(|| self.begin(elapsed_secs))
    }

    /// Applies a change at a time after the start [s]; `None` if there is no such phase.
    pub fn apply(&mut self, change: Change, elapsed_secs: f64) -> Option<PhaseEvent> {
        match change {
            Change::Next if self.next == self.phases.len() => None,
            Change::Repeat if self.next == 0 => None,
            Change::Abort => {
                self.until_secs.take().filter(|until_secs| *until_secs > elapsed_secs)?;
                self.is_held = true;
                Some(PhaseEvent::Aborted(self.phases[self.next - 1].name.clone()))
            }
            Change::Next | Change::Repeat => {
                self.next -= usize::from(change == Change::Repeat);
                if let Some(from_secs) = self.phases[self.next].from_secs {
                    self.moved_secs = elapsed_secs - from_secs;
                }
                Some(self.begin(elapsed_secs))
            }
        }
    }

    /// Records that another program has begun a phase of this name at a time after the start [s]: it stands for the
    /// next manual phase of that name, if any.
    pub fn begun_elsewhere(&mut self, label: &str, elapsed_secs: f64) {
        let is_meant = |phase: &Phase| phase.from_secs.is_none() && phase.name == label;
        if let Some(skipped) = self.phases[self.next..].iter().position(is_meant) {
            self.next += skipped;
            self.begin(elapsed_secs);
        }
    }

    /// The next phase.
    pub fn next(&self) -> Option<&str> {
        self.phases.get(self.next).map(|phase| phase.name.as_str())
    }

    fn begin(&mut self, elapsed_secs: f64) -> PhaseEvent {
        let phase = &self.phases[self.next];
        let length_secs = phase.length_secs();
        self.until_secs = Some(length_secs.map_or(f64::INFINITY, |secs| elapsed_secs + secs));
        self.is_held = false;
        self.next += 1;
        PhaseEvent::Begins(phase.name.clone(), length_secs.unwrap_or(f64::NAN))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn schedule() -> Schedule {
        let phase = |name: &str, from_secs, to_secs| Phase {
            name: name.to_owned(),
            from_secs: Some(from_secs),
            to_secs: Some(to_secs),
            lasts_secs: None,
        };
        Schedule::new(vec![
            phase("2-back", 100.0, 130.0),
            phase("baseline", 0.0, 60.0),
            phase("1-back", 70.0, 90.0),
        ])
    }

    #[expect(clippy::unnecessary_wraps, reason = "what a schedule answers is optional")]
    fn begins(name: &str, secs: f64) -> Option<PhaseEvent> {
        Some(PhaseEvent::Begins(name.to_owned(), secs))
    }

    #[test]
    fn phases_begin_as_planned() {
        let mut schedule = schedule();
        let happened = [0.0, 1.0, 69.9, 70.0, 100.0, 900.0].map(|secs| schedule.due(secs));
        let [baseline, first, second] =
            [("baseline", 60.0), ("1-back", 20.0), ("2-back", 30.0)].map(|(n, s)| begins(n, s));
        assert_eq!(happened, [baseline, None, None, first, second, None]);
        assert_eq!(schedule.next(), None);
        assert_eq!(schedule.apply(Change::Next, 901.0), None);
    }

    #[test]
    fn the_next_phase_begins_when_asked_and_the_others_move_with_it() {
        let mut schedule = schedule();
        schedule.due(0.0);
        assert_eq!(schedule.apply(Change::Next, 40.0), begins("1-back", 20.0));
        assert_eq!(schedule.next(), Some("2-back"));
        assert_eq!([69.9, 70.0].map(|secs| schedule.due(secs)), [None, begins("2-back", 30.0)]);
    }

    #[test]
    fn a_phase_without_a_time_begins_when_asked_and_never_by_itself() {
        let by_hand = |name: &str, lasts_secs| Phase {
            name: name.to_owned(),
            from_secs: None,
            to_secs: None,
            lasts_secs,
        };
        let phases = vec![by_hand("baseline", Some(60.0)), by_hand("task", Some(30.0))];
        let mut schedule = Schedule::new(phases.clone());
        assert_eq!((schedule.due(1e6), schedule.next()), (None, Some("baseline")));
        assert_eq!(schedule.apply(Change::Next, 100.0), begins("baseline", 60.0));
        assert_eq!((schedule.due(1e6), schedule.next()), (None, Some("task")));
        assert_eq!(schedule.apply(Change::Repeat, 170.0), begins("baseline", 60.0));
        assert_eq!(schedule.apply(Change::Next, 300.0), begins("task", 30.0));
        assert_eq!(schedule.next(), None);

        let mut schedule = Schedule::new(phases);
        schedule.begun_elsewhere("rest", 5.0);
        assert_eq!(schedule.next(), Some("baseline"));
        schedule.begun_elsewhere("task", 10.0);
        assert_eq!(schedule.next(), None, "others began the second");
        assert_eq!(schedule.apply(Change::Abort, 20.0), Some(PhaseEvent::Aborted("task".into())));
    }

    #[test]
    fn a_phase_is_repeated_as_long_as_planned() {
        let mut schedule = schedule();
        assert_eq!(schedule.apply(Change::Repeat, 0.0), None);
        schedule.due(0.0);
        assert_eq!(schedule.apply(Change::Repeat, 30.0), begins("baseline", 60.0));
        assert_eq!([99.9, 100.0].map(|secs| schedule.due(secs)), [None, begins("1-back", 20.0)]);
    }

    #[test]
    fn after_an_abort_nothing_begins_by_itself() {
        let mut schedule = schedule();
        assert_eq!(schedule.apply(Change::Abort, 0.0), None);
        schedule.due(0.0);
        assert_eq!(
            schedule.apply(Change::Abort, 20.0),
            Some(PhaseEvent::Aborted("baseline".into()))
        );
        assert_eq!(schedule.apply(Change::Abort, 21.0), None);
        assert_eq!(schedule.due(500.0), None);
        assert_eq!(schedule.apply(Change::Repeat, 600.0), begins("baseline", 60.0));
        assert_eq!(schedule.due(670.0), begins("1-back", 20.0));
        assert_eq!(schedule.apply(Change::Abort, 695.0), None);
    }
}
