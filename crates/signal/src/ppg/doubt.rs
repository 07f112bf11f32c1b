//! Evidence against a pulse rate.

use super::cycles::Cycles;
use super::train::Train;

/// The probability that a rate is correct within 10 %, without and with evidence against it. There are four levels;
/// each is the share of right rates among the windows of simulated signals at that level (`bench/signal/measure_unkind
/// choosing`).
const SURE: f64 = 0.98;
const DOUBTFUL: f64 = 0.79;
const UNLIKELY: f64 = 0.265;
const WRONG: f64 = 0.05;

/// The largest flagged share of a span whose remainder is reported.
pub(super) const MOST_FLAGGED: f64 = 0.5;
/// Fewer pulses than this in a span as long as this [s] do not make a rhythm; in a shorter one they are merely too few.
const LEAST_COUNT: usize = 5;
const LONG_SECS: f64 = 10.0;
/// With too few good cycles for a mean, pulses are noise if more than this share of intervals is odd, or a smaller
/// share in a span of which more than the last of these shares is flagged.
const NOISE_ODD: f64 = 0.345;
const FLAGGED_NOISE_ODD: f64 = 0.11;
const NOISE_FLAGGED: f64 = 0.91;

/// A sine is not a pulse but aliased mains, and so is a wave with nearly no fundamental. A near-sine is hardly a pulse.
const SINE: f64 = 0.03;
const HARDLY_A_PULSE: f64 = 0.09;
const NO_FUNDAMENTAL: f64 = 10.0;
/// If the harmonics are larger than this multiple of the fundamental, each cycle may hold two pulses.
const TWO_PULSES: f64 = 2.0;

/// The latest diastolic wave [s]; a later crest is a missed weak pulse. If pulses were lost, a crest this late may be
/// one, too.
const LATEST_CREST_SECS: f64 = 0.46;
const CREST_HEIGHT: f64 = 0.08;
const LATE_CREST_SECS: f64 = 0.32;
/// A crest that is nearly as late and as high as this, in the middle of a cycle, may be one of alternating pulses.
const HALF: std::ops::Range<f64> = 0.46..0.54;
const HALF_CREST_SECS: f64 = 0.44;
const HALF_CREST_HEIGHT: f64 = 0.25;

/// Footsteps are broader than pulses, as a share of a cycle. A broad wave may be that of footsteps if the mean cycle
/// leaves more than this residual, or if amplitudes are jagged or alternate.
const BROAD: f64 = 0.39;
const MOST_REST: f64 = 0.005;
const JAGGED: f64 = 0.05;
/// A large residual may also be a second rhythm beside narrower pulses.
const LARGE_REST: f64 = 0.05;
const NEARLY_BROAD: f64 = 0.32;

/// Among pulses as fast as this [s], every second one may be a diastolic wave; intervals, amplitudes or forms then
/// alternate.
const FAST_SECS: f64 = 0.47;
const FAST_ALTERNATION: f64 = 0.011;
const FAST_ALTERNATE: f64 = 0.8;
const FAST_JAGGED: f64 = 0.06;
/// Pulses as slow as this [s] may be every second pulse of a bigeminy: they rise in a smaller share of a cycle, and the
/// signal is more skewed. Or the baseline wanders, which leaves a residual.
const SLOW_SECS: f64 = 1.12;
const FAST_RISE: f64 = 0.13;
const SKEWED: f64 = 0.9;
const WANDER_REST: f64 = 0.04;
/// Few hearts are as slow as this [s], but baseline wander often is.
const VERY_SLOW_SECS: f64 = 1.9;

/// Amplitudes alternate strictly above this share. If intervals are then odd, or good cycles cover less than this share
/// of the span, the lower pulses of a bigeminy are flagged.
const STRICTLY_ALTERNATE: f64 = 0.95;
const ALTERNATE_COVERED: f64 = 0.6;

/// Intervals that alternate more than this are a bigeminy. Others that vary more than this hardly come from a heart.
const MOST_ALTERNATION: f64 = 0.04;
const MOST_VARIATION: f64 = 0.07;
/// The rate is doubtful if more intervals than this are odd while good cycles cover less than this share of the span.
const MOST_ODD: f64 = 0.2;
const LEAST_COVERED: f64 = 0.75;
/// Above this share of odd intervals, or with more variation, there is no rhythm in which pulses could be missing.
const NO_RHYTHM_ODD: f64 = 0.35;
const NO_RHYTHM_VARIATION: f64 = 0.25;
/// Above this residual, a late, high crest may be the second pulse of a pair.
const PAIR_REST: f64 = 0.15;
const PAIR_CREST_SECS: f64 = 0.33;
const PAIR_CREST_HEIGHT: f64 = 0.15;
/// The rate is doubtful if the usual interval of good cycles differs from that of all by more than this share: pulses
/// between them are flagged, or false.
const MOST_OFF: f64 = 0.05;

/// What is known about the pulses of a span.
#[derive(Clone, Copy, Debug)]
pub(super) struct Doubt {
    pub(super) train: Train,
    /// The mean of good cycles; `None` with too few.
    pub(super) cycles: Option<Cycles>,
    /// The share of the span that is flagged.
    pub(super) flagged: f64,
    /// The skewness of the signal; NaN if unknown.
    pub(super) skewness: f64,
    /// The duration of the span [s].
    pub(super) secs: f64,
}

impl Doubt {
    /// The probability that the rate is correct within 10 %.
    pub(super) fn probability(&self) -> f64 {
        match &self.cycles {
            None if self.is_noise() => WRONG,
            None => DOUBTFUL,
            Some(cycles) if is_sine(cycles) => WRONG,
            Some(_) if self.flagged > MOST_FLAGGED => UNLIKELY,
            Some(cycles) if self.is_unlikely(cycles) => UNLIKELY,
            Some(cycles) if self.is_doubtful(cycles) => DOUBTFUL,
            Some(_) => SURE,
        }
    }

    fn is_noise(&self) -> bool {
        let Train { count, odd, .. } = self.train;
        (count < LEAST_COUNT && self.secs >= LONG_SECS)
            || odd > NOISE_ODD
            || (odd > FLAGGED_NOISE_ODD && self.flagged > NOISE_FLAGGED)
    }

    fn is_unlikely(&self, cycles: &Cycles) -> bool {
        let is_second = self.is_second_rhythm(cycles);
        let is_varied = cycles.variation > MOST_VARIATION;
        [
            cycles.crest_secs > LATEST_CREST_SECS && cycles.crest_height > CREST_HEIGHT,
            is_second && (is_varied || cycles.alternation > MOST_ALTERNATION),
            cycles.harmonics < HARDLY_A_PULSE && (is_second || is_varied),
            self.is_doubled(cycles),
        ]
        .contains(&true)
    }

    fn is_doubtful(&self, cycles: &Cycles) -> bool {
        let is_part = cycles.secs < LEAST_COVERED * self.secs;
        let is_odd = self.train.odd > MOST_ODD;
        let is_varied = cycles.variation > MOST_VARIATION;
        let off = cycles.usual_secs / self.train.usual_secs - 1.0;
        [
            cycles.harmonics > TWO_PULSES,
            self.is_second_rhythm(cycles),
            cycles.rest > LARGE_REST && self.width(cycles) > NEARLY_BROAD,
            self.is_slow(cycles) || self.is_slow_in_turn(cycles),
            is_half(cycles),
            self.is_missing_low(cycles),
            is_varied && cycles.alternation < MOST_ALTERNATION,
            is_part && is_odd,
            is_part && cycles.crest_secs > LATE_CREST_SECS,
            off.abs() > MOST_OFF,
            self.train.odd > NO_RHYTHM_ODD || cycles.variation > NO_RHYTHM_VARIATION,
            cycles.rest > PAIR_REST
                && cycles.crest_secs > PAIR_CREST_SECS
                && cycles.crest_height > PAIR_CREST_HEIGHT,
        ]
        .contains(&true)
    }

    /// Whether the waves may come from another rhythm, with the pulse between them.
    fn is_second_rhythm(&self, cycles: &Cycles) -> bool {
        let Train { jagged, alternate, .. } = self.train;
        let is_mixed = cycles.rest > MOST_REST || jagged > JAGGED || alternate > STRICTLY_ALTERNATE;
        self.width(cycles) > BROAD && is_mixed
    }

    /// Whether diastolic waves may have been counted as pulses.
    fn is_doubled(&self, cycles: &Cycles) -> bool {
        let Train { jagged, alternate, .. } = self.train;
        let is_alternating = cycles.alternation > FAST_ALTERNATION
            || (alternate > FAST_ALTERNATE && jagged > FAST_JAGGED)
            || self.train.is_of_two_kinds;
        cycles.usual_secs < FAST_SECS && is_alternating
    }

    /// Whether every second pulse may be missed, or wander taken for pulses.
    fn is_slow(&self, cycles: &Cycles) -> bool {
        let rise = self.train.rise_secs / cycles.usual_secs;
        let is_strange = rise < FAST_RISE
            || self.skewness > SKEWED
            || cycles.rest > WANDER_REST
            || cycles.usual_secs > VERY_SLOW_SECS;
        cycles.usual_secs > SLOW_SECS && is_strange
    }

    /// Whether slow amplitudes alternate: the pulses between them may be too low to be found.
    fn is_slow_in_turn(&self, cycles: &Cycles) -> bool {
        let Train { jagged, alternate, .. } = self.train;
        cycles.usual_secs > SLOW_SECS && alternate > STRICTLY_ALTERNATE && jagged > JAGGED
    }

    /// Whether the lower of alternating pulses may be flagged.
    fn is_missing_low(&self, cycles: &Cycles) -> bool {
        let is_part = cycles.secs < ALTERNATE_COVERED * self.secs;
        self.train.alternate > STRICTLY_ALTERNATE && (is_part || self.train.odd > MOST_ODD)
    }

    /// The width of pulses at half of their amplitude, as a share of a cycle.
    fn width(&self, cycles: &Cycles) -> f64 {
        self.train.width_secs / cycles.usual_secs
    }
}

/// Whether a late, high crest in the middle of a cycle may be a weak pulse.
fn is_half(cycles: &Cycles) -> bool {
    HALF.contains(&(cycles.crest_secs / cycles.usual_secs))
        && cycles.crest_secs > HALF_CREST_SECS
        && cycles.crest_height > HALF_CREST_HEIGHT
}

fn is_sine(cycles: &Cycles) -> bool {
    cycles.harmonics < SINE || cycles.harmonics > NO_FUNDAMENTAL
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A clean pulse at 75/min, in half a minute.
    fn clean() -> (Doubt, Cycles) {
        let train = Train {
            count: 37,
            usual_secs: 0.8,
            odd: 0.0,
            jagged: 0.02,
            alternate: 0.5,
            rise_secs: 0.12,
            width_secs: 0.2,
            is_of_two_kinds: false,
        };
        let cycles = Cycles {
            harmonics: 0.6,
            crest_secs: 0.3,
            crest_height: 0.1,
            rest: 0.02,
            alternation: 0.0,
            variation: 0.03,
            secs: 29.0,
            usual_secs: 0.8,
        };
        let (flagged, skewness) = (0.0, 0.5);
        (Doubt { train, cycles: None, flagged, skewness, secs: 30.0 }, cycles)
    }

    fn of_cycles(change: impl Fn(&mut Cycles)) -> f64 {
        let (doubt, mut cycles) = clean();
        change(&mut cycles);
        Doubt { cycles: Some(cycles), ..doubt }.probability()
    }

    fn of_train(change: impl Fn(&mut Train)) -> f64 {
        let (mut doubt, cycles) = clean();
        change(&mut doubt.train);
        Doubt { cycles: Some(cycles), ..doubt }.probability()
    }

    #[test]
    fn a_clean_pulse_is_trusted() {
        assert_eq!(of_cycles(|_| ()), SURE);
        assert_eq!(of_train(|train| (train.rise_secs, train.width_secs) = (0.08, 0.1)), SURE);
    }

    #[test]
    fn a_few_good_cycles_among_flagged_ones_say_little() {
        let (mut doubt, cycles) = clean();
        doubt.flagged = 0.6;
        assert_eq!(Doubt { cycles: Some(cycles), ..doubt }.probability(), UNLIKELY);
    }

    #[test]
    fn mains_are_no_pulse() {
        assert_eq!(of_cycles(|cycles| cycles.harmonics = 0.01), WRONG);
        assert_eq!(of_cycles(|cycles| cycles.harmonics = 12.0), WRONG);
    }

    #[test]
    fn a_late_crest_is_a_missed_pulse() {
        assert_eq!(of_cycles(|cycles| cycles.crest_secs = 0.5), UNLIKELY);
    }

    #[test]
    fn broad_waves_with_a_residual_may_be_steps() {
        assert_eq!(of_train(|train| train.width_secs = 0.35), DOUBTFUL);
        let broad = |change: fn(&mut Cycles)| {
            let (mut doubt, mut cycles) = clean();
            doubt.train.width_secs = 0.35;
            change(&mut cycles);
            Doubt { cycles: Some(cycles), ..doubt }.probability()
        };
        assert_eq!(broad(|cycles| cycles.rest = 0.001), SURE);
        assert_eq!(broad(|cycles| cycles.variation = 0.1), UNLIKELY);
    }

    #[test]
    fn fast_pulses_in_turn_may_be_diastolic_waves() {
        let fast = |alternate| {
            let (mut doubt, mut cycles) = clean();
            cycles.usual_secs = 0.4;
            doubt.train =
                Train { usual_secs: 0.4, width_secs: 0.1, jagged: 0.1, alternate, ..doubt.train };
            Doubt { cycles: Some(cycles), ..doubt }.probability()
        };
        assert_eq!((fast(0.6), fast(1.0)), (SURE, UNLIKELY));
        let (mut doubt, mut cycles) = clean();
        cycles.usual_secs = 0.4;
        (doubt.train.width_secs, doubt.train.is_of_two_kinds) = (0.1, true);
        assert_eq!(Doubt { cycles: Some(cycles), ..doubt }.probability(), UNLIKELY);
    }

    #[test]
    fn a_high_crest_in_the_middle_of_a_cycle_may_be_a_weak_pulse() {
        let crest = |usual_secs| {
            of_cycles(|cycles| {
                (cycles.crest_secs, cycles.crest_height) = (0.45, 0.4);
                cycles.usual_secs = usual_secs;
            })
        };
        assert_eq!((crest(0.8), crest(0.9)), (SURE, DOUBTFUL));
    }

    #[test]
    fn pairs_of_pulses_and_pulses_without_a_rhythm_are_doubtful() {
        let pair = |rest| {
            of_cycles(|cycles| {
                (cycles.crest_secs, cycles.crest_height, cycles.rest) = (0.35, 0.2, rest);
            })
        };
        assert_eq!((pair(0.1), pair(0.16)), (SURE, DOUBTFUL));
        assert_eq!(of_cycles(|cycles| cycles.variation = 0.3), DOUBTFUL);
        assert_eq!(of_train(|train| train.odd = 0.5), DOUBTFUL);
    }

    #[test]
    fn slow_pulses_with_a_fast_rise_may_be_half_of_them() {
        let slow = |rise_secs| {
            let (mut doubt, mut cycles) = clean();
            cycles.usual_secs = 1.3;
            doubt.train = Train { usual_secs: 1.3, rise_secs, ..doubt.train };
            Doubt { cycles: Some(cycles), ..doubt }.probability()
        };
        assert_eq!((slow(0.2), slow(0.12)), (SURE, DOUBTFUL));
    }

    #[test]
    fn few_good_cycles_among_odd_intervals_are_doubtful() {
        let (mut doubt, mut cycles) = clean();
        cycles.secs = 15.0;
        assert_eq!(Doubt { cycles: Some(cycles), ..doubt }.probability(), SURE);
        doubt.train.odd = 0.3;
        assert_eq!(Doubt { cycles: Some(cycles), ..doubt }.probability(), DOUBTFUL);
    }

    #[test]
    fn without_cycles_odd_intervals_are_noise() {
        let (mut doubt, _) = clean();
        assert_eq!(doubt.probability(), DOUBTFUL);
        doubt.train.odd = 0.4;
        assert_eq!(doubt.probability(), WRONG);
    }

    #[test]
    fn a_few_pulses_are_no_rhythm() {
        let (mut doubt, _) = clean();
        doubt.train.count = 2;
        assert_eq!(doubt.probability(), WRONG);
        doubt.secs = 2.0;
        assert_eq!(doubt.probability(), DOUBTFUL);
    }
}
