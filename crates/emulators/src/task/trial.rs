//! The sequence of stimuli and the person's answers.

use std::collections::VecDeque;

use super::happening::{Happening, What};
use super::skill::Skill;
use crate::noise::Noise;

/// The letters that are shown.
const LETTERS: [char; 8] = ['b', 'c', 'd', 'g', 'h', 'k', 'p', 't'];
/// The share of letters that equal the one n stimuli before.
const MATCH_SHARE: f64 = 0.3;
/// The additional reaction time per level above 1-back [s], and the variation of reactions.
const SLOWER_SECS: f64 = 0.12;
const REACTION_SIGMA: f64 = 0.2;
/// The fastest reaction [s], and the latest one as a share of the time between stimuli.
const FASTEST_SECS: f64 = 0.2;
const LATEST_SHARE: f64 = 0.9;
/// The share of stimuli at which a person who has given up still presses a key, and the share of these presses that is
/// right.
const STILL_PRESSES: f64 = 0.6;
const BY_CHANCE: f64 = 0.5;

/// The stimuli of one phase.
#[derive(Clone, Debug)]
pub struct Trials {
    level: u8,
    pace_secs: f64,
    shown: VecDeque<char>,
    noise: Noise,
}

impl Trials {
    /// Creates the stimuli of a level, 1 to 3, with a time between them [s].
    pub fn new(level: u8, pace_secs: f64, noise: Noise) -> Trials {
        Trials { level, pace_secs, shown: VecDeque::new(), noise }
    }

    /// Shows a stimulus at a time, and returns it with the press that follows, if there is one.
    pub fn show(
        &mut self,
        at_secs: f64,
        skill: &Skill,
        disengaged: bool,
    ) -> (Happening, Option<Happening>) {
        let back = usize::from(self.level);
        let before = (self.shown.len() == back).then(|| self.shown[0]);
        let letter = self.letter(before);
        let is_match = before == Some(letter);
        self.shown.push_back(letter);
        if self.shown.len() > back {
            self.shown.pop_front();
        }
        let stimulus = Happening { at_secs, what: What::Stimulus { letter, is_match } };
        let odds = Odds::of(skill, self.level, disengaged);
        (stimulus, self.press(at_secs, odds, is_match))
    }

    fn letter(&mut self, before: Option<char>) -> char {
        match before {
            Some(before) if self.noise.chance(MATCH_SHARE) => before,
            _ => LETTERS[(self.noise.uniform(0.0..LETTERS.len() as f64) as usize) % LETTERS.len()],
        }
    }

    fn press(&mut self, at_secs: f64, odds: Odds, is_match: bool) -> Option<Happening> {
        let noise = &mut self.noise;
        let varied_secs = odds.median_secs * (REACTION_SIGMA * noise.normal()).exp();
        let reaction_secs = varied_secs.max(FASTEST_SECS).min(LATEST_SHARE * self.pace_secs);
        let (is_right, presses) = (noise.chance(odds.right_share), noise.chance(odds.press_share));
        let says_match = is_match == is_right;
        let what = What::Press { says_match, is_right, reaction_secs };
        presses.then_some(Happening { at_secs: at_secs + reaction_secs, what })
    }
}

/// The probabilities of a press and of a correct one, and the median reaction time.
#[derive(Clone, Copy, Debug)]
struct Odds {
    press_share: f64,
    right_share: f64,
    median_secs: f64,
}

impl Odds {
    fn of(skill: &Skill, level: u8, disengaged: bool) -> Odds {
        let place = usize::from(level.clamp(1, 3)) - 1;
        let median_secs = skill.reaction_secs + SLOWER_SECS * place as f64;
        if disengaged {
            return Odds { press_share: STILL_PRESSES, right_share: BY_CHANCE, median_secs };
        }
        Odds { press_share: 1.0, right_share: skill.right_share[place], median_secs }
    }
}
