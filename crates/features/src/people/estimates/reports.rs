//! A person's reports of their own workload.

use std::collections::VecDeque;

use teampulse_core::data::{Event, Reason};
use teampulse_core::phases::Phase;
use teampulse_core::reports::Isa;
use teampulse_core::time::Time;
use teampulse_signal::estimate::Estimate;

use super::physiology::LEAST_SIGMA;
use crate::value::Value;

/// How long after the end of a phase a report is still about that phase, not about the next one [ns].
pub(super) const JUST_ENDED_NS: i64 = 10_000_000_000;
/// The number of newest reports that are held.
const MOST: usize = 16;

/// The newest reports of a person.
#[derive(Default)]
pub(super) struct Reports {
    newest: VecDeque<Report>,
}

#[derive(Clone, Copy, Debug)]
struct Report {
    at: Time,
    /// The reported workload [0..1]: 0 for a report of 1 (idle), 1 for 5 (too much).
    workload: f64,
}

/// A span of time, from its start to its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    pub(super) begin: Time,
    pub(super) end: Time,
}

impl Stretch {
    /// The share of this span that lies within another one [0..1].
    fn share_in(self, other: Stretch) -> f64 {
        let (begin, end) = (self.begin.max(other.begin), self.end.min(other.end));
        let length_secs = self.end.secs_since(self.begin);
        if length_secs > 0.0 { (end.secs_since(begin) / length_secs).max(0.0) } else { 0.0 }
    }
}

impl Reports {
    /// Takes in a report from 1 to 5; returns whether it was on the scale.
    pub(super) fn take(&mut self, at: Time, event: &Event) -> bool {
        let Some(isa) = Isa::read(event).filter(Isa::is_on_scale) else { return false };
        let place = self.newest.partition_point(|known| known.at <= at);
        self.newest.insert(place, Report { at, workload: (isa.value - 1.0) / 4.0 });
        if self.newest.len() > MOST {
            self.newest.pop_front();
        }
        true
    }

    /// Whether nothing was reported so far.
    pub(super) fn is_empty(&self) -> bool {
        self.newest.is_empty()
    }

    /// The estimate for a window from the newest report that applies to it; its variance doubles within
    /// `doubled_secs` [s], and grows as the window leaves the phase that the report is about.
    pub(super) fn of_window(&self, window: Stretch, phases: &[Phase], doubled_secs: f64) -> Value {
        let held = self.newest.iter().rev().map(|report| {
            let share = window.share_in(report.about(phases));
            (report, share)
        });
        let Some((report, share)) = held.into_iter().find(|(_, share)| *share > 0.0) else {
            return Err(Reason::Nothing);
        };
        Ok(report.reported(window.end, share, doubled_secs))
    }

    /// The estimate from the newest report about a phase.
    pub(super) fn of_phase(&self, phase: Stretch, phases: &[Phase], doubled_secs: f64) -> Value {
        let is_about = |report: &&Report| report.about(phases).begin == phase.begin;
        let report = self.newest.iter().rev().find(is_about).ok_or(Reason::Nothing)?;
        Ok(report.reported(phase.end, 1.0, doubled_secs))
    }
}

impl Report {
    /// The span that the report is about: the phase in which it was given, or the one that had just ended.
    fn about(&self, phases: &[Phase]) -> Stretch {
        let (always, never) = (Time::from_nanos(i64::MIN), Time::from_nanos(i64::MAX));
        let begun = phases.partition_point(|phase| phase.begin <= self.at);
        let next = phases.get(begun).map_or(never, |phase| phase.begin);
        let Some(last) = begun.checked_sub(1) else {
            return Stretch { begin: always, end: next };
        };
        let has_just_ended =
            |phase: &&Phase| phase.end.is_some_and(|end| self.at.nanos_since(end) < JUST_ENDED_NS);
        let before = last.checked_sub(1).map(|before| &phases[before]);
        let phase = before.filter(has_just_ended).unwrap_or(&phases[last]);
        let end = phase.end.unwrap_or(never);
        if self.at.nanos_since(end) >= JUST_ENDED_NS {
            return Stretch { begin: end, end: next };
        }
        Stretch { begin: phase.begin, end }
    }

    fn reported(&self, at: Time, share: f64, doubled_secs: f64) -> Estimate {
        let age_secs = at.secs_since(self.at).max(0.0);
        let sigma = LEAST_SIGMA * ((1.0 + age_secs / doubled_secs) / share).sqrt();
        Estimate { value: self.workload, sigma }
    }
}

#[cfg(test)]
mod tests {
    use teampulse_core::data::EventKind;

    use super::*;

    fn time(secs: i32) -> Time {
        Time::from_stamp(secs, 0)
    }

    fn reports(given: &[(i32, f64)]) -> Reports {
        let mut reports = Reports::default();
        for (secs, isa) in given {
            let (label, duration_secs) = ("isa".to_owned(), 0.0);
            let event = Event { kind: EventKind::Report, label, value: *isa, duration_secs };
            assert_eq!(reports.take(time(*secs), &event), (1.0..=5.0).contains(isa));
        }
        reports
    }

    /// Successive phases of one minute.
    fn phases() -> Vec<Phase> {
        let phase = |number: i32| Phase {
            label: format!("{number}"),
            begin: time(60 * number),
            end: Some(time(60 * (number + 1))),
        };
        (0..4).map(phase).collect()
    }

    fn window(end_secs: i32) -> Stretch {
        Stretch { begin: time(end_secs - 30), end: time(end_secs) }
    }

    fn at(reports: &Reports, end_secs: i32) -> Value {
        reports.of_window(window(end_secs), &phases(), 120.0)
    }

    #[test]
    fn a_report_holds_in_its_phase_and_fades_as_a_window_leaves_it() {
        let reports = reports(&[(80, 3.0)]);
        let sigma = |secs| at(&reports, secs).unwrap().sigma;
        assert_eq!(at(&reports, 90).unwrap().value, 0.5);
        assert!(sigma(120) > sigma(90) && sigma(140) > 1.5 * sigma(120));
        assert_eq!(at(&reports, 150), Err(Reason::Nothing));
    }

    #[test]
    fn a_report_at_the_end_of_a_phase_is_about_that_phase() {
        for secs in [118, 120, 122] {
            let reports = reports(&[(secs, 4.0)]);
            let of = |place: usize| {
                let stretch =
                    Stretch { begin: phases()[place].begin, end: phases()[place].end.unwrap() };
                reports.of_phase(stretch, &phases(), 120.0)
            };
            assert_eq!(of(1).unwrap().value, 0.75);
            assert_eq!(of(2), Err(Reason::Nothing));
        }
    }

    #[test]
    fn without_phases_a_report_holds_and_grows_old() {
        let reports = reports(&[(10, 2.0)]);
        let sigma = |secs| reports.of_window(window(secs), &[], 120.0).unwrap().sigma;
        assert_eq!(sigma(10), LEAST_SIGMA);
        assert!((sigma(130) / LEAST_SIGMA - 2.0_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_report_off_the_scale_is_not_used() {
        assert!(reports(&[(1, 0.0), (2, 6.0), (3, f64::NAN)]).is_empty());
    }
}
