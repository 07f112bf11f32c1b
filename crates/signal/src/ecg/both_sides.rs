//! The quiet on both sides of candidates, determined once the signal after them is known.

use super::candidates::{Candidate, QUIET_SECS};

/// The quiet after a candidate is taken from the first later candidate up to this much after the end of that time [s].
const LATEST_SECS: f64 = 0.5;

/// Replaces the restlessness of each candidate, measured before it, by the restlessness of both sides.
///
/// A beat at the end of a burst of noise is followed by quiet, a wave at the start of flutter by more waves.
pub(super) fn consider_both_sides(candidates: &mut [Candidate]) {
    for place in 0..candidates.len() {
        let here = candidates[place];
        let until_secs = here.secs + QUIET_SECS;
        let later = &candidates[place..];
        // The time before the later candidate is the time after this one.
        let next = later.get(later.partition_point(|each| each.secs < until_secs));
        if let Some(next) = next.filter(|next| next.secs < until_secs + LATEST_SECS) {
            let (restlessness, swell) = (restlessness(&here, next), swell(&here, next));
            candidates[place] = Candidate { restlessness, swell, ..here };
        }
    }
}

/// The restlessness of both sides of a candidate: the geometric mean of its own and that of a later candidate.
pub(super) fn restlessness(candidate: &Candidate, after: &Candidate) -> f64 {
    let after = after.restlessness * after.strength / candidate.strength;
    (candidate.restlessness * after).sqrt()
}

/// The swell of both sides of a candidate: the geometric mean of its own and that of a later candidate.
fn swell(candidate: &Candidate, after: &Candidate) -> f64 {
    (candidate.swell * after.swell * after.strength / candidate.strength).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quiet_after_a_beat_counts_as_much_as_quiet_before_it() {
        let restless = |secs: f64, strength: f64, restlessness: f64| Candidate {
            restlessness,
            ..Candidate::at(secs, strength)
        };
        // The end of noise, a beat after it, and what is known of the time after that beat.
        let mut candidates =
            [restless(0.0, 1.0, 0.9), restless(1.0, 2.0, 0.5), restless(2.0, 1.0, 0.02)];
        consider_both_sides(&mut candidates);
        let after = candidates.map(|candidate| candidate.restlessness);
        assert!((after[0] - 0.9_f64.sqrt()).abs() < 1e-9);
        assert!((after[1] - 0.005_f64.sqrt()).abs() < 1e-9);
        assert!((after[2] - 0.02).abs() < 1e-9, "nothing is known of what follows the last");
    }
}
