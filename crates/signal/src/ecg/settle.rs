//! A second look at a doubtful rate: how steep its beats are, and whether there is noise in the stretches without
//! beats.

use super::doubt::{DOUBTFUL, Doubt, is_doubtful};
use super::silence::Silence;
use super::windows::WindowBeat;
use crate::robust::quantile_in_place;

/// If more than this share of beats has an echo of its form before it, beats of a premature rhythm may have been
/// missed.
const OFTEN_ECHOED: f64 = 0.4;
/// The probability of a rate that proves right, and of the rate of steps.
const RIGHT: f64 = 0.93;
const OF_STEPS: f64 = 0.05;

/// With fewer intervals than this, the rate can hardly be judged.
const LEAST_INTERVALS: usize = 5;
/// The range of the mean rate, as a multiple of the rate of the median interval, if no beat is false.
const FEW_FALSE: std::ops::Range<f64> = 0.8..1.06;
/// Beats are not steps if nine in ten are steeper than this [heights/s] and the median slope between them is below this
/// share of their own.
const STEEP: f64 = 34.0;
const STEEPEST_BETWEEN: f64 = 0.9;
/// Beats are also not steps if a tenth of them is as steep as `STEEP_TENTH` and little between them is as steep, in a
/// rhythm as slow as `SLOW_MS` or with a median beat as steep as `STEEP_HALF`.
const SLOW_MS: f64 = 415.0;
const STEEP_HALF: f64 = 42.0;
const STEEP_TENTH: f64 = 43.0;
const RARELY_AS_STEEP: f64 = 1.0;
const FEW_FASTER: f64 = 1.02;
/// A steep tenth does not settle broad beats if the signal between them is steeper than this share of their own slope.
const BROAD_BETWEEN: f64 = 0.5;
/// There is another rhythm if the signal between beats is higher than this multiple of their height, or, between broad
/// beats, steeper than this share of their slope.
const HIGHER: f64 = 1.2;
const STEEP_BETWEEN_BROAD: f64 = 0.6;
/// Beats are steps if nine in ten are less steep than this, with next to nothing between some of them.
const FLAT_TENTH: f64 = 42.0;
const NOTHING_BETWEEN: f64 = 0.11;
/// Beats are also steps if the signal between a tenth of them is steeper than they are by this factor and nine in ten
/// are less steep than `NEVER_STEEP`, in a fast rhythm or with some signal between nearly all of them.
const STEEPER_BETWEEN: f64 = 1.2;
const NEVER_STEEP: f64 = 68.0;
const FAST_MS: f64 = 474.0;

/// Beats are premature if intervals vary by more than this, the signal between beats is hardly ever steeper, higher or
/// more often unexplained than this, and none is a T wave.
const IRREGULAR: f64 = 0.15;
const SELDOM_AS_STEEP: f64 = 0.55;
const LOW_RIVAL: f64 = 0.35;
const EXPLAINED: f64 = 0.07;
const NO_TURN: f64 = 0.01;

/// In recorded noise, more than this share of beats is at odd times and unlike others, and intervals vary by more than
/// this.
const FEW_ODD: f64 = 0.05;
const REGULAR: f64 = 0.12;
/// Next to other noise, and next to pauses, beats must be more similar than this.
const OTHER_LIKE: f64 = 0.8;
const QUIET_LIKE: f64 = 0.9;
/// Next to noise without beats, a rhythm is steady below this variation, and long enough above this coverage; next to
/// pauses, more must be covered.
const STEADY: f64 = 0.17;
const LEAST_COVERED: f64 = 0.07;
/// Beats in muscle noise must all be steeper than this [heights/s], and this share of the span must be covered by this
/// many intervals that vary by less than this.
const STEEP_IN_NOISE: f64 = 42.0;
const COVERED_IN_NOISE: f64 = 0.35;
const INTERVALS_IN_NOISE: usize = 12;
const VARIED_IN_NOISE: f64 = 0.2;
const LITTLE_SATURATED: f64 = 0.1;
const MOSTLY_COVERED: f64 = 0.77;

/// The probability of a rate after a second look: a doubtful rate is settled if the slopes of beats or the noise
/// between them do so, and a trusted rate becomes doubtful if there is another rhythm between its beats. Chosen on the
/// same signals as [`Doubt::probability`].
pub(super) fn looked_at_again(
    probability: f64,
    doubt: &Doubt,
    silence: Silence,
    beats: &[WindowBeat],
) -> f64 {
    if is_doubtful(probability) {
        return settled(doubt, silence, beats).unwrap_or(probability);
    }
    let has_other = probability > DOUBTFUL
        && doubt.intervals >= LEAST_INTERVALS
        && Slopes::of(beats).is_some_and(|slopes| slopes.are_beside_others(doubt));
    if has_other { DOUBTFUL } else { probability }
}

/// The probability of a doubtful rate if slopes or noise settle it; otherwise `None`.
fn settled(doubt: &Doubt, silence: Silence, beats: &[WindowBeat]) -> Option<f64> {
    let slopes = Slopes::of(beats).filter(|_| doubt.intervals >= LEAST_INTERVALS)?;
    if doubt.echoed > OFTEN_ECHOED {
        return None;
    }
    let is_steady = doubt.variation < STEADY && FEW_FALSE.contains(&doubt.rate_ratio);
    let is_alike = doubt.odd_unlike < FEW_ODD;
    match silence {
        Silence::Nowhere if slopes.are_steps(doubt) && !slopes.are_beats(doubt) => Some(OF_STEPS),
        Silence::Nowhere => {
            let is_clear = doubt.variation < REGULAR || is_alike;
            (is_clear && slopes.are_beats(doubt) || slopes.are_premature(doubt)).then_some(RIGHT)
        }
        Silence::Other => {
            let is_long = doubt.covered > LEAST_COVERED && doubt.like > OTHER_LIKE;
            let are_beats = is_steady && is_long && slopes.low > STEEP;
            (are_beats || slopes.are_beats_in_noise(doubt)).then_some(RIGHT)
        }
        Silence::Quiet => {
            let is_clear = is_alike && doubt.like > QUIET_LIKE;
            (is_clear && doubt.covered > MOSTLY_COVERED).then_some(RIGHT)
        }
        Silence::Long | Silence::Unknown => None,
    }
}

/// The slopes of the beats of a span [heights/s], and the steepest slopes between them as multiples of the beats' own.
struct Slopes {
    /// The 10th, 50th and 90th percentiles of each.
    low: f64,
    middle: f64,
    high: f64,
    low_between: f64,
    middle_between: f64,
    high_between: f64,
}

impl Slopes {
    fn of(beats: &[WindowBeat]) -> Option<Slopes> {
        let mut own: Vec<f64> = beats.iter().filter_map(|beat| Some(beat.steepness?.own)).collect();
        let mut between: Vec<f64> =
            beats.iter().filter_map(|beat| beat.steepness?.between).collect();
        Some(Slopes {
            low: quantile_in_place(&mut own, 0.1)?,
            middle: quantile_in_place(&mut own, 0.5)?,
            high: quantile_in_place(&mut own, 0.9)?,
            low_between: quantile_in_place(&mut between, 0.1)?,
            middle_between: quantile_in_place(&mut between, 0.5)?,
            high_between: quantile_in_place(&mut between, 0.9)?,
        })
    }

    fn are_beats(&self, doubt: &Doubt) -> bool {
        let is_slow = doubt.usual_ms > SLOW_MS && doubt.rate_ratio < FEW_FASTER;
        let is_broad = self.middle < STEEP && self.middle_between > BROAD_BETWEEN;
        let are_steep = self.low > STEEP && self.middle_between < STEEPEST_BETWEEN
            || self.high > STEEP_TENTH
                && self.high_between < RARELY_AS_STEEP
                && (is_slow && !is_broad || self.middle > STEEP_HALF);
        are_steep && FEW_FALSE.contains(&doubt.rate_ratio)
    }

    /// Whether the signal between beats may be another rhythm: higher and as steep, or steep between broad beats.
    fn are_beside_others(&self, doubt: &Doubt) -> bool {
        doubt.rival > HIGHER && self.middle_between > STEEPEST_BETWEEN
            || self.middle < STEEP && self.high_between > STEEP_BETWEEN_BROAD
    }

    fn are_premature(&self, doubt: &Doubt) -> bool {
        let is_clean = doubt.rival < LOW_RIVAL && doubt.unexplained < EXPLAINED;
        let are_steep = self.high > STEEP_TENTH && self.high_between < SELDOM_AS_STEEP;
        doubt.variation > IRREGULAR && doubt.turns < NO_TURN && is_clean && are_steep
    }

    fn are_beats_in_noise(&self, doubt: &Doubt) -> bool {
        let is_long = doubt.covered > COVERED_IN_NOISE
            && doubt.intervals >= INTERVALS_IN_NOISE
            && doubt.variation < VARIED_IN_NOISE;
        let is_whole = doubt.saturated < LITTLE_SATURATED && FEW_FALSE.contains(&doubt.rate_ratio);
        is_long && is_whole && self.low > STEEP_IN_NOISE
    }

    fn are_steps(&self, doubt: &Doubt) -> bool {
        let is_steeper_between = self.high_between > STEEPER_BETWEEN
            && self.high < NEVER_STEEP
            && (doubt.usual_ms < FAST_MS || self.low_between > NOTHING_BETWEEN);
        is_steeper_between || self.high < FLAT_TENTH && self.low_between < NOTHING_BETWEEN
    }
}

#[cfg(test)]
mod tests {
    use super::super::steepness::Steepness;
    use super::*;
    use crate::analysis::Span;

    /// Beats, 800 ms apart, with these slopes in turn.
    fn beats(own: [f64; 2], between: [f64; 2]) -> Vec<WindowBeat> {
        let beat = |index: usize| WindowBeat {
            at_ns: index as i64 * 800_000_000,
            rr_ms: Some(800.0),
            looks: None,
            between: None,
            echo: None,
            steepness: Some(Steepness { own: own[index % 2], between: Some(between[index % 2]) }),
        };
        (0..40).map(beat).collect()
    }

    fn doubt(beats: &[WindowBeat]) -> Doubt {
        let span = Span { begin_ns: 0, end_ns: 32_000_000_000 };
        Doubt { like: 0.99, ..Doubt::of(beats, None, span) }
    }

    fn probability(own: [f64; 2], between: [f64; 2], silence: Silence) -> Option<f64> {
        let beats = beats(own, between);
        settled(&doubt(&beats), silence, &beats)
    }

    #[test]
    fn steep_beats_with_less_between_them_are_right() {
        assert_eq!(probability([50.0; 2], [0.3; 2], Silence::Nowhere), Some(RIGHT));
        // Bigeminy: every second beat is broad.
        assert_eq!(probability([50.0, 15.0], [0.1, 0.4], Silence::Nowhere), Some(RIGHT));
        let fast = beats([50.0; 2], [0.3; 2]);
        let fast = Doubt { rate_ratio: 1.1, ..doubt(&fast) };
        assert_eq!(settled(&fast, Silence::Nowhere, &beats([50.0; 2], [0.3; 2])), None);
    }

    #[test]
    fn premature_beats_between_which_there_is_nothing_are_right() {
        let beats = beats([50.0, 15.0], [0.1, 0.4]);
        let premature = |change: fn(&mut Doubt)| {
            let mut doubt =
                Doubt { variation: 0.3, odd_unlike: 0.2, rate_ratio: 1.2, ..doubt(&beats) };
            change(&mut doubt);
            settled(&doubt, Silence::Nowhere, &beats)
        };
        assert_eq!(premature(|_| ()), Some(RIGHT));
        assert_eq!(premature(|doubt| doubt.turns = 0.1), None);
        assert_eq!(premature(|doubt| doubt.rival = 0.5), None);
    }

    #[test]
    fn steep_beats_beside_loud_muscles_are_right() {
        let beats = beats([50.0; 2], [2.0; 2]);
        let in_noise = |change: fn(&mut Doubt)| {
            let mut doubt = Doubt { like: 0.6, variation: 0.19, ..doubt(&beats) };
            change(&mut doubt);
            settled(&doubt, Silence::Other, &beats)
        };
        assert_eq!(in_noise(|_| ()), Some(RIGHT));
        assert_eq!(in_noise(|doubt| doubt.saturated = 0.5), None);
        assert_eq!(in_noise(|doubt| doubt.rate_ratio = 1.09), None);
    }

    #[test]
    fn beats_beside_another_rhythm_are_doubtful() {
        let of = |probability: f64, own: f64, between: f64, rival: f64| {
            let beats = beats([own; 2], [between; 2]);
            let doubt = Doubt { rival, ..doubt(&beats) };
            looked_at_again(probability, &doubt, Silence::Nowhere, &beats)
        };
        assert_eq!(of(0.97, 50.0, 1.1, 1.0), 0.97);
        assert_eq!(of(0.97, 50.0, 1.1, 1.8), DOUBTFUL);
        assert_eq!((of(0.97, 30.0, 0.5, 0.1), of(0.97, 30.0, 0.7, 0.1)), (0.97, DOUBTFUL));
        assert_eq!(of(0.5, 30.0, 0.7, 0.1), 0.5);
    }

    #[test]
    fn waves_less_steep_than_what_lies_between_them_are_steps() {
        assert_eq!(probability([25.0; 2], [1.5; 2], Silence::Nowhere), Some(OF_STEPS));
        assert_eq!(probability([25.0; 2], [0.05; 2], Silence::Nowhere), Some(OF_STEPS));
    }

    #[test]
    fn a_pause_or_an_electrode_that_is_off_leaves_the_rate_right() {
        let of = |silence| probability([50.0; 2], [0.3; 2], silence);
        assert_eq!((of(Silence::Quiet), of(Silence::Other)), (Some(RIGHT), Some(RIGHT)));
        assert_eq!([Silence::Long, Silence::Unknown].map(of), [None; 2]);
        assert_eq!(probability([20.0; 2], [0.3; 2], Silence::Other), None);
    }

    #[test]
    fn few_beats_settle_nothing() {
        let few = &beats([50.0; 2], [0.3; 2])[..4];
        assert_eq!(settled(&doubt(few), Silence::Nowhere, few), None);
    }
}
