//! The plan of a task: its phases and their durations.

use schemars::JsonSchema;
use serde::Deserialize;

/// The plan of a task: a baseline, then levels of n-back with rests between them.
///
/// Invalid durations count as 0, and a round lasts at least a second.
#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(default, deny_unknown_fields)]
pub struct Plan {
    /// The duration of the baseline [s]. Default: 60.
    pub baseline_secs: f64,
    /// The duration of each level [s]. Default: 60.
    pub level_secs: f64,
    /// The duration of the rest after each level [s]. Default: 30.
    pub rest_secs: f64,
    /// The time between stimuli [s], at least 1. Default: 2.5.
    pub stimulus_secs: f64,
    /// The levels, in their order, each 1 to 3. Default: 1, 2, 3.
    pub levels: Vec<u8>,
    /// The number of rounds of levels; by default endless.
    pub rounds: Option<u32>,
    /// The number of robots that can be commanded. Default: 5.
    pub robots: u32,
    /// The rate of commands during a level [1/min]. Default: 2.
    pub commands_per_min: f64,
}

impl Default for Plan {
    fn default() -> Plan {
        Plan {
            baseline_secs: 60.0,
            level_secs: 60.0,
            rest_secs: 30.0,
            stimulus_secs: 2.5,
            levels: vec![1, 2, 3],
            rounds: None,
            robots: 5,
            commands_per_min: 2.0,
        }
    }
}

/// One phase of a task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase {
    /// The name of the phase.
    pub name: &'static str,
    /// The n of n-back; 0 if there is no task.
    pub level: u8,
    /// When it begins, after the start [s].
    pub from_secs: f64,
    /// When it ends [s].
    pub to_secs: f64,
}

impl Phase {
    /// The duration of the phase [s]; a phase without duration is skipped.
    pub fn lasts_secs(&self) -> f64 {
        self.to_secs - self.from_secs
    }
}

/// The longest duration [s].
const LONGEST_SECS: f64 = 86_400.0;
/// The shortest round [s].
const LEAST_ROUND_SECS: f64 = 1.0;

impl Plan {
    /// Returns a phase by its number, from 0; `None` after the last.
    ///
    /// The baseline comes first, then the levels, each followed by a rest.
    pub fn phase(&self, number: u64) -> Option<Phase> {
        let baseline_secs = length_secs(self.baseline_secs);
        let Some(after) = number.checked_sub(1) else {
            let (from_secs, to_secs) = (0.0, baseline_secs);
            return Some(Phase { name: "baseline", level: 0, from_secs, to_secs });
        };
        let phases = 2 * self.levels.len() as u64;
        let round = after.checked_div(phases)?;
        if self.rounds.is_some_and(|rounds| round >= u64::from(rounds)) {
            return None;
        }
        let level = self.levels[(after % phases / 2) as usize].clamp(1, 3);
        let level_secs = length_secs(self.level_secs);
        let pair_secs = (level_secs + length_secs(self.rest_secs)).max(LEAST_ROUND_SECS);
        let from_secs = baseline_secs + (after / 2) as f64 * pair_secs;
        let (middle_secs, to_secs) = (from_secs + level_secs, from_secs + pair_secs);
        Some(if after % 2 == 0 {
            Phase { name: name(level), level, from_secs, to_secs: middle_secs }
        } else {
            Phase { name: "rest", level: 0, from_secs: middle_secs, to_secs }
        })
    }

    pub(super) fn pace_secs(&self) -> f64 {
        if self.stimulus_secs >= 1.0 { self.stimulus_secs } else { 1.0 }
    }
}

fn length_secs(secs: f64) -> f64 {
    if secs > 0.0 { secs.min(LONGEST_SECS) } else { 0.0 }
}

fn name(level: u8) -> &'static str {
    match level {
        1 => "1-back",
        2 => "2-back",
        _ => "3-back",
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Skill, Task, What};
    use super::*;

    #[test]
    fn phases_follow_each_other_without_a_gap() {
        let plan = Plan { rounds: Some(2), ..Plan::default() };
        let phases: Vec<Phase> = (0..).map_while(|number| plan.phase(number)).collect();
        assert_eq!(phases.len(), 1 + 2 * 6);
        assert!(phases.windows(2).all(|two| two[0].to_secs == two[1].from_secs));
        let names: Vec<&str> = phases.iter().take(6).map(|phase| phase.name).collect();
        assert_eq!(names, ["baseline", "1-back", "rest", "2-back", "rest", "3-back"]);
        assert_eq!(phases[12].to_secs, 600.0);
    }

    #[test]
    fn a_phase_of_no_length_does_not_happen() {
        let plan = Plan { rest_secs: 0.0, rounds: Some(1), ..Plan::default() };
        let mut task = Task::new(plan, Skill::of_seed(1), 1);
        let mut begun = Vec::new();
        while let Some(happening) = task.next_until(1e4) {
            if let What::Begins { phase, lasts_secs } = happening.what {
                begun.push((phase, lasts_secs));
            }
        }
        let lasting = ["baseline", "1-back", "2-back", "3-back"].map(|name| (name, 60.0));
        assert_eq!(begun, lasting);
    }

    #[test]
    fn a_plan_without_levels_is_a_baseline() {
        let plan = Plan { levels: Vec::new(), ..Plan::default() };
        assert!(plan.phase(0).is_some() && plan.phase(1).is_none());
    }
}
