//! The demand of a phase on a person, and when the person gives up.

use super::happening::{Happening, What};
use super::plan::Phase;
use super::skill::Skill;
use crate::noise::Noise;

/// The workload of 1-, 2- and 3-back [0..1].
const WORKLOAD: [f64; 3] = [0.35, 0.65, 1.0];
/// The arousal at full workload, and the fall of valence.
const AROUSAL: f64 = 0.8;
const DISPLEASURE: f64 = 0.2;
/// The share of the demand that remains when a person has given up.
const LEFT: f64 = 0.4;
/// The mean time for which a person gives up [s].
const BOUT_SECS: f64 = 12.0;

/// A span of a phase with the same demand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bout {
    /// When the span begins [s].
    pub from_secs: f64,
    /// Whether the person has given up.
    pub disengaged: bool,
}

/// Returns the workload of an n-back level.
pub fn workload(level: u8) -> f64 {
    level.checked_sub(1).and_then(|place| WORKLOAD.get(usize::from(place))).copied().unwrap_or(0.0)
}

/// Returns the spans of a phase, the engaged one first; people give up only at 3-back.
pub fn bouts(phase: &Phase, skill: &Skill, noise: &mut Noise) -> Vec<Bout> {
    let mut bouts = vec![Bout { from_secs: phase.from_secs, disengaged: false }];
    let share = if phase.level == 3 { skill.disengaged_share.clamp(0.0, 0.9) } else { 0.0 };
    if share <= 0.0 {
        return bouts;
    }
    let engaged_secs = BOUT_SECS * (1.0 - share) / share;
    let mut at_secs = phase.from_secs;
    loop {
        let disengaged = bouts.len() % 2 == 1;
        let mean_secs = if disengaged { engaged_secs } else { BOUT_SECS };
        at_secs += mean_secs * noise.exponential().max(0.2);
        if at_secs >= phase.to_secs {
            return bouts;
        }
        bouts.push(Bout { from_secs: at_secs, disengaged });
    }
}

impl Bout {
    /// Returns the demand of a level during this span.
    pub fn demand(&self, level: u8) -> Happening {
        let left = if self.disengaged { LEFT } else { 1.0 };
        let workload = workload(level) * left;
        let what = What::Demands {
            workload,
            arousal: AROUSAL * workload,
            valence: 0.5 - DISPLEASURE * workload,
            disengaged: self.disengaged,
        };
        Happening { at_secs: self.from_secs, what }
    }
}
