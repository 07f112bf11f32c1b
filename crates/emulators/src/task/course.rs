//! The course of a task, event by event.

use std::collections::VecDeque;

use super::attention::{Bout, bouts, workload};
use super::happening::{Happening, What};
use super::plan::{Phase, Plan};
use super::skill::Skill;
use super::trial::Trials;
use crate::noise::Noise;

/// The time from the start of a level to its first stimulus [s].
const LEAD_SECS: f64 = 1.0;
/// The latest press after a stimulus [s]; no stimulus is shown later than this before the end of a level.
const TAIL_SECS: f64 = 1.0;
/// The time from the start of the finger's movement until the key is down [s].
const REACH_SECS: f64 = 0.06;
/// The standard deviation of self-reports.
const REPORT_SIGMA: f64 = 0.4;
/// The highest rate at which robots are commanded [1/min].
const MOST_COMMANDS_PER_MIN: f64 = 60.0;

/// A task that a person performs. The same plan, skill and seed give the same course.
#[derive(Clone, Debug)]
pub struct Task {
    plan: Plan,
    skill: Skill,
    noise: Noise,
    phases: u64,
    ahead: VecDeque<Happening>,
}

impl Task {
    /// Creates a task before its start.
    pub fn new(plan: Plan, skill: Skill, seed: u64) -> Task {
        let noise = Noise::seeded(seed);
        Task { plan, skill, noise, phases: 0, ahead: VecDeque::new() }
    }

    /// Returns the next event in order of time, if it happens by a time [s].
    pub fn next_until(&mut self, secs: f64) -> Option<Happening> {
        while self.ahead.is_empty() {
            let phase = self.plan.phase(self.phases)?;
            if phase.from_secs > secs || secs.is_nan() {
                return None;
            }
            self.phases += 1;
            if phase.lasts_secs() > 0.0 {
                self.ahead = self.happenings(&phase).into();
            }
        }
        let is_due = self.ahead.front().is_some_and(|next| next.at_secs <= secs);
        if is_due { self.ahead.pop_front() } else { None }
    }

    fn happenings(&mut self, phase: &Phase) -> Vec<Happening> {
        let mut noise = self.noise.fork();
        let bouts = bouts(phase, &self.skill, &mut noise);
        let begins = What::Begins { phase: phase.name, lasts_secs: phase.lasts_secs() };
        let mut all = vec![Happening { at_secs: phase.from_secs, what: begins }];
        all.extend(bouts.iter().map(|bout| bout.demand(phase.level)));
        if phase.level > 0 {
            self.add_trials(phase, &bouts, &mut noise, &mut all);
            self.add_commands(phase, &mut noise, &mut all);
            add_reaches(&mut all);
            all.push(report(phase, &mut noise));
        }
        all.sort_by(|a, b| a.at_secs.total_cmp(&b.at_secs));
        all.push(Happening { at_secs: phase.to_secs, what: What::Ends { phase: phase.name } });
        all
    }

    fn add_trials(
        &self,
        phase: &Phase,
        bouts: &[Bout],
        noise: &mut Noise,
        all: &mut Vec<Happening>,
    ) {
        let pace_secs = self.plan.pace_secs();
        let mut trials = Trials::new(phase.level, pace_secs, noise.fork());
        let mut at_secs = phase.from_secs + LEAD_SECS;
        while at_secs + pace_secs.max(TAIL_SECS) <= phase.to_secs {
            let bout = bouts.iter().rfind(|bout| bout.from_secs <= at_secs);
            let disengaged = bout.is_some_and(|bout| bout.disengaged);
            let (stimulus, press) = trials.show(at_secs, &self.skill, disengaged);
            all.push(stimulus);
            all.extend(press);
            at_secs += pace_secs;
        }
    }

    fn add_commands(&self, phase: &Phase, noise: &mut Noise, all: &mut Vec<Happening>) {
        let per_min = self.plan.commands_per_min.min(MOST_COMMANDS_PER_MIN);
        if !(per_min > 0.0 && self.plan.robots > 0) {
            return;
        }
        let mut at_secs = phase.from_secs + LEAD_SECS;
        loop {
            at_secs += 60.0 / per_min * noise.exponential().max(0.1);
            if at_secs >= phase.to_secs {
                return;
            }
            let robot = noise.uniform(0.0..f64::from(self.plan.robots)) as u32 % self.plan.robots;
            all.push(Happening { at_secs, what: What::Command { robot } });
        }
    }
}

/// Adds the movement of the finger before each press and command.
fn add_reaches(all: &mut Vec<Happening>) {
    let is_done =
        |each: &&Happening| matches!(each.what, What::Press { .. } | What::Command { .. });
    let reach = |done: &Happening| Happening {
        at_secs: done.at_secs - REACH_SECS,
        what: What::Reaches { press_secs: done.at_secs },
    };
    let reaches: Vec<Happening> = all.iter().filter(is_done).map(reach).collect();
    all.extend(reaches);
}

fn report(phase: &Phase, noise: &mut Noise) -> Happening {
    let felt = 1.0 + 4.0 * workload(phase.level) + REPORT_SIGMA * noise.normal();
    let what = What::Report { isa: felt.round().clamp(1.0, 5.0) as u8 };
    Happening { at_secs: phase.to_secs, what }
}
