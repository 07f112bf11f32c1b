//! A second look at a doubtful rate: how steep its beats are, and whether there is noise where there are none.

use super::doubt::Doubt;
use super::silence::Silence;
use super::windows::WindowBeat;
use crate::robust::quantile_in_place;

/// The probability of a rate that proves right, and of the rate of steps.
const RIGHT: f64 = 0.93;
const OF_STEPS: f64 = 0.05;

/// Of fewer intervals, little can be said.
const LEAST_INTERVALS: usize = 5;
/// The mean rate exceeds that of the median interval by less than this share where no beat is false.
const FEW_FALSE: std::ops::Range<f64> = 0.8..1.06;
/// Nine in ten beats are steeper than this [heights/s], and hardly anything between them is: no steps.
const STEEP: f64 = 34.0;
const STEEPEST_BETWEEN: f64 = 0.9;
/// The median beat, in a rhythm as slow as this [ms] or as steep as this, where a tenth is steep and little is as steep
/// between them.
const SLOW_MS: f64 = 415.0;
const STEEP_HALF: f64 = 42.0;
const STEEP_TENTH: f64 = 43.0;
const RARELY_AS_STEEP: f64 = 1.0;
const FEW_FASTER: f64 = 1.02;
/// Nine in ten are less steep than this, with next to nothing between some of them: steps.
const FLAT_TENTH: f64 = 42.0;
const NOTHING_BETWEEN: f64 = 0.11;
/// Or what is between them is steeper than they are, fast or without exception.
const STEEPER_BETWEEN: f64 = 1.2;
const NEVER_STEEP: f64 = 68.0;
const FAST_MS: f64 = 474.0;

/// In recorded noise, more beats than this are at odd times and unlike others, and intervals vary by more than this.
const FEW_ODD: f64 = 0.05;
const REGULAR: f64 = 0.12;
/// Beside another noise, and beside pauses, beats are more similar than this.
const OTHER_LIKE: f64 = 0.8;
const QUIET_LIKE: f64 = 0.9;
/// Beside noise without beats, a rhythm is steady below this variation, and not too short above this coverage; beside
/// pauses, more must be covered.
const STEADY: f64 = 0.17;
const LEAST_COVERED: f64 = 0.07;
const MOSTLY_COVERED: f64 = 0.77;

/// The probability of a doubtful rate where the slopes of beats or the noise between them settle it; chosen on the
/// same signals as [`Doubt::probability`].
pub(super) fn settled(doubt: &Doubt, silence: Silence, beats: &[WindowBeat]) -> Option<f64> {
    let slopes = Slopes::of(beats).filter(|_| doubt.intervals >= LEAST_INTERVALS)?;
    let is_steady = doubt.variation < STEADY && FEW_FALSE.contains(&doubt.rate_ratio);
    let is_alike = doubt.odd_unlike < FEW_ODD;
    match silence {
        Silence::Nowhere if slopes.are_steps(doubt) && !slopes.are_beats(doubt) => Some(OF_STEPS),
        Silence::Nowhere => {
            let is_clear = doubt.variation < REGULAR || is_alike;
            (is_clear && slopes.are_beats(doubt)).then_some(RIGHT)
        }
        Silence::Other => {
            let is_long = doubt.covered > LEAST_COVERED && doubt.like > OTHER_LIKE;
            (is_steady && is_long && slopes.low > STEEP).then_some(RIGHT)
        }
        Silence::Quiet => {
            let is_clear = is_alike && doubt.like > QUIET_LIKE;
            (is_clear && doubt.covered > MOSTLY_COVERED).then_some(RIGHT)
        }
        Silence::Long | Silence::Unknown => None,
    }
}

/// The slopes of the beats of a span [heights/s], and the steepest between them as multiples of their own.
struct Slopes {
    /// The 10th, 50th and 90th percentiles.
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
        let are_steep = self.low > STEEP && self.middle_between < STEEPEST_BETWEEN
            || self.high > STEEP_TENTH
                && self.high_between < RARELY_AS_STEEP
                && (is_slow || self.middle > STEEP_HALF);
        are_steep && FEW_FALSE.contains(&doubt.rate_ratio)
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
    fn waves_less_steep_than_what_lies_between_them_are_steps() {
        assert_eq!(probability([25.0; 2], [1.5; 2], Silence::Nowhere), Some(OF_STEPS));
        assert_eq!(probability([25.0; 2], [0.05; 2], Silence::Nowhere), Some(OF_STEPS));
    }

    #[test]
    fn a_pause_or_an_electrode_that_is_off_leaves_the_rate_right() {
        let of = |silence| probability([50.0; 2], [0.3; 2], silence);
        assert_eq!((of(Silence::Quiet), of(Silence::Other)), (Some(RIGHT), Some(RIGHT)));
        assert_eq!((of(Silence::Long), of(Silence::Unknown)), (None, None));
        assert_eq!(probability([20.0; 2], [0.3; 2], Silence::Other), None);
    }

    #[test]
    fn few_beats_settle_nothing() {
        let few = &beats([50.0; 2], [0.3; 2])[..4];
        assert_eq!(settled(&doubt(few), Silence::Nowhere, few), None);
    }
}
