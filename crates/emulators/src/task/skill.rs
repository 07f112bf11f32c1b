//! How well one person does a task.

use crate::noise::Noise;

/// Separates the random numbers of the skill from those of the task with the same seed.
const SALT: u64 = 0x006e_2d62_6163_6b21;
/// The share of people who sometimes give up at 3-back.
const GIVE_UP: f64 = 0.35;

/// How well one person does n-back tasks.
#[derive(Clone, Debug, PartialEq)]
pub struct Skill {
    /// The median time from a stimulus to the press at 1-back [s].
    pub reaction_secs: f64,
    /// The probability that a press is correct at 1, 2 and 3-back [0..1].
    pub right_share: [f64; 3],
    /// The share of the time at 3-back during which the person has given up [0..1].
    pub disengaged_share: f64,
}

impl Skill {
    /// Generates the skill of a person from a seed.
    pub fn of_seed(seed: u64) -> Skill {
        let mut noise = Noise::seeded(seed ^ SALT);
        let shift = noise.around(0.0, 0.02);
        let gives_up = noise.chance(GIVE_UP);
        let usual = noise.uniform(0.0..0.1);
        let often = noise.uniform(0.3..0.6);
        Skill {
            reaction_secs: 0.6 * noise.factor(0.15),
            right_share: [0.96, 0.90, 0.78].map(|share: f64| (share + shift).min(0.99)),
            disengaged_share: if gives_up { often } else { usual },
        }
    }
}
