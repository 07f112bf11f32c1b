//! Evidence against a heart rate whose beats look plausible.

use super::judge::T_WAVE_SECS;
use super::signs::Signs;
use super::windows::WindowBeat;
use crate::analysis::Span;
use crate::robust::{interpolated, median_in_place, quantile_in_place};

/// An interval is odd when it deviates from the median by more than this share.
const ODD: f64 = 0.25;
/// The longest usual interval [ms].
const LONGEST_USUAL_MS: f64 = 3000.0;
/// A beat is unlike those before it below this similarity.
const UNLIKE: f64 = 0.8;
/// A deflection between beats is unexplained above this share of their height.
const UNEXPLAINED: f64 = 0.35;

/// A deflection between beats counts as an echo of them above this correlation with a beat and this share of its size.
const ECHO_CORRELATION: f64 = 0.85;
const ECHO_SHARE: f64 = 0.15;

/// Two intervals in a row may be those of a beat and its T wave: the shorter one is as short as the interval to a T
/// wave, and the longer one exceeds this multiple of it.
const T_WAVE_TURN: f64 = 1.5;
/// If more than this share of all intervals are such turns, the rate is wrong.
const MOST_TURNS: f64 = 0.3;

/// The probability from signal quality alone, when there is no other evidence against the rate. Even in heavy
/// noise, beats without such evidence are nearly always right.
const OF_QUALITY: [(f64, f64); 4] = [(0.0, 0.0), (0.03, 0.03), (0.06, 0.93), (1.0, 0.99)];

/// The mean and the median interval agree if their rates differ by less than this share: few beats are missed or false.
const AGREEING: f64 = 0.07;
/// The limits above which each share speaks against the rate.
const MOST_DOUBLED: f64 = 0.05;
const MOST_ODD_UNLIKE: f64 = 0.03;
const LEAST_LIKE: f64 = 0.92;
const MOST_ODD: f64 = 0.05;
const MOST_SATURATED: f64 = 0.1;
const MOST_LOST: f64 = 0.06;
/// Deflections are rivals of beats if more than this share of beats has an unexplained one and the median deflection
/// exceeds this share of a beat, while heights are uneven, intervals do not agree, or deflections are nearly as large
/// as beats. In noise, more beats must have one, and it may be smaller.
const MOST_UNEXPLAINED: f64 = 0.08;
const RIVAL: f64 = 0.6;
const RIVAL_UNEVEN: f64 = 1.7;
const EQUAL_RIVAL: f64 = 0.9;
const NOISY_QUALITY: f64 = 0.6;
const NOISY_UNEXPLAINED: f64 = 0.4;
const NOISY_RIVAL: f64 = 0.35;
/// If mean and median interval agree, the rate is right despite one or two signs, but not with as many odd intervals of
/// unlike beats and as much variation as noise has, nor with fewer intervals than this, which may agree by chance.
const NOISE_ODD_UNLIKE: f64 = 0.1;
const IRREGULAR: f64 = 0.12;
const LEAST_INTERVALS: usize = 15;
const OF_SIGNS: f64 = 0.93;
/// The probability with evidence against the rate.
pub(super) const DOUBTFUL: f64 = 0.79;
const OF_LOST: f64 = 0.5;
const OF_THREE_AGREEING: f64 = 0.6;
const OF_THREE: f64 = 0.1;
const WRONG: f64 = 0.05;

/// Every second beat is missed if deflections are as large as this share of a beat in a slow [ms] or irregular rhythm,
/// or smaller in an irregular rhythm with doubled intervals.
const MISSED_RIVAL: f64 = 0.7;
const MISSED_UNEXPLAINED: f64 = 0.01;
const MISSED_SLOW_MS: f64 = 1050.0;
const MISSED_DOUBLED_RIVAL: f64 = 0.5;
/// If more than this share of beats has an echo, every second beat is missed.
const ALL_ECHOED: f64 = 0.6;

/// Intervals near a multiple of the median hide no lost beats if mean and median agree and intervals vary less than
/// this, or if a clear signal was absent for a while: the beats are as similar as this, the rate ratio is above this,
/// and the intervals cover this much of the span, of which this share is living.
const STEADY: f64 = 0.2;
const CLEAR_LIKE: f64 = 0.994;
const CLEAR_ODD: f64 = 0.4;
const CLEAR_COVERED: f64 = 0.8;
const CLEAR_LIVING: std::ops::Range<f64> = 0.8..0.95;
const CLEAR_RATIO: f64 = 0.8;
/// In a signal less clear than this, such intervals have lost beats, and the more signs there are, the lower the
/// probability.
const UNCLEAR_LIKE: f64 = 0.988;
const OF_UNCLEAR: [f64; 3] = [0.35, 0.3, 0.13];

/// A span is silent below this share of living signal: if beats are as clear as this, the heart may pause, unless
/// intervals cover this share of the span. A smaller coverage is doubtful in any signal.
const SILENT_LIVING: f64 = 0.84;
const SILENT_LIKE: f64 = 0.98;
const SILENT_KURTOSIS: f64 = 6.0;
const SILENT_COVERED: f64 = 0.9;
const VERY_SILENT_LIVING: f64 = 0.75;
const LITTLE_COVERED: f64 = 0.65;
/// Intervals that cover less of the span than these shares are few, or hardly any.
const FEW_COVERED: f64 = 0.25;
const OF_FEW: f64 = 0.25;
const HARDLY_COVERED: f64 = 0.035;

/// Steps, or noise, may be taken for beats of such a height and rate [ms] if the 90th percentile of heights is above
/// this multiple of the 10th, beats are less similar than this, and the kurtosis of the signal is below this. If
/// amplitudes vary with the breath, beats are more similar, and narrow.
const UNEVEN: f64 = 1.3;
const UNEVEN_LIKE: f64 = 0.975;
const UNEVEN_KURTOSIS: f64 = 9.5;
const STEP_MS: f64 = 750.0;
/// They are not steps if they are slower than this and have larger deflections between them, or are less similar than
/// this in noise, unless they are odd or very uneven, or vary.
const FAST_STEP_MS: f64 = 650.0;
const STEP_RIVAL: f64 = 0.42;
const STEP_ODD: f64 = 0.02;
const VERY_UNEVEN: f64 = 2.4;
const STEP_LIKE: f64 = 0.84;
const STEP_VARIATION: f64 = 0.05;

/// The evidence from the beats and the signal of a span; shares lie between 0 and 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Doubt {
    /// The number of intervals.
    pub(super) intervals: usize,
    /// The median interval [ms]; NaN without any.
    pub(super) usual_ms: f64,
    /// The rate of the mean interval as a multiple of that of the median one; NaN without intervals.
    pub(super) rate_ratio: f64,
    /// The mean deviation of intervals from the median one, as a share of it.
    pub(super) variation: f64,
    /// The share of the span that intervals cover; 1 if the rest is shorter than one interval.
    pub(super) covered: f64,
    /// The mean similarity to the beats before.
    pub(super) like: f64,
    /// The share of beats after an odd interval.
    pub(super) odd: f64,
    /// The share of beats after an odd interval that are also unlike others: noise.
    pub(super) odd_unlike: f64,
    /// The share of intervals twice as long as others, with hardly any in between: missed beats.
    pub(super) doubled: f64,
    /// Share of samples at the end of the range.
    pub(super) saturated: f64,
    /// The kurtosis of the signal; NaN if it is unknown.
    pub(super) kurtosis: f64,
    /// The share of beats preceded by a deflection as high as a beat where there is no T or P wave: a missed
    /// beat.
    pub(super) unexplained: f64,
    /// The median size of the highest deflection in the middle of an interval, as a share of the size of a beat; 0
    /// where intervals are too short for one.
    pub(super) rival: f64,
    /// The share of beats preceded by a deflection of the same form where there is no T or P wave, however low: a
    /// missed beat of a heart whose beats alternate in height.
    pub(super) echoed: f64,
    /// The share of beats that may be lost in intervals near a multiple of the median.
    pub(super) lost: f64,
    /// The share of intervals that are as short as those from beats to their T waves and follow a longer one.
    pub(super) turns: f64,
    /// The 90th percentile of the heights of beats as a multiple of the 10th.
    pub(super) uneven: f64,
}

impl Doubt {
    /// Collects the evidence from the beats and the signs of a span.
    pub(super) fn of(beats: &[WindowBeat], signs: Option<Signs>, span: Span) -> Doubt {
        let intervals_ms: Vec<f64> = beats.iter().filter_map(|beat| beat.rr_ms).collect();
        let usual_ms = median_in_place(&mut intervals_ms.clone()).unwrap_or(f64::NAN);
        let heights = beats.iter().filter_map(|beat| Some(beat.looks?.height));
        let mut heights: Vec<f64> = heights.collect();
        let height = median_in_place(&mut heights).unwrap_or(f64::NAN);
        let likeness = |beat: &WindowBeat| beat.looks.and_then(|looks| looks.likeness);
        let likenesses: Vec<f64> = beats.iter().filter_map(likeness).collect();
        let is_odd = |beat: &&WindowBeat| {
            beat.rr_ms.is_some_and(|rr_ms| (rr_ms / usual_ms - 1.0).abs() > ODD)
        };
        let is_unlike =
            |beat: &&WindowBeat| likeness(beat).is_none_or(|likeness| likeness < UNLIKE);
        let is_unexplained =
            |beat: &&WindowBeat| beat.between.is_some_and(|between| between > UNEXPLAINED * height);
        let is_echoed = |beat: &&WindowBeat| {
            beat.echo
                .is_some_and(|echo| echo.correlation > ECHO_CORRELATION && echo.share > ECHO_SHARE)
        };
        let share = |count: usize| count as f64 / beats.len().max(1) as f64;
        let rivals = beats.iter().filter_map(|beat| Some(beat.echo?.share));
        let total_ms = intervals_ms.iter().sum::<f64>();
        Doubt {
            intervals: intervals_ms.len(),
            usual_ms,
            rate_ratio: usual_ms * intervals_ms.len() as f64 / total_ms,
            variation: variation(&intervals_ms, usual_ms),
            covered: covered(total_ms, usual_ms, span),
            lost: lost(&intervals_ms, usual_ms),
            turns: turns(&intervals_ms),
            doubled: doubled(intervals_ms),
            saturated: signs.map_or(0.0, |signs| signs.saturated),
            kurtosis: signs.and_then(|signs| signs.kurtosis.ok()).unwrap_or(f64::NAN),
            like: likenesses.iter().sum::<f64>() / likenesses.len().max(1) as f64,
            odd: share(beats.iter().filter(is_odd).count()),
            odd_unlike: share(beats.iter().filter(is_odd).filter(is_unlike).count()),
            unexplained: share(beats.iter().filter(is_unexplained).count()),
            rival: median_in_place(&mut rivals.collect::<Vec<_>>()).unwrap_or(0.0),
            echoed: share(beats.iter().filter(is_echoed).count()),
            uneven: uneven(&mut heights),
        }
    }

    /// The probability that the rate is correct within 10 %, given the signal quality and the share of
    /// living signal, calibrated on simulated signals of 24 kinds (`bench/signal/measure_unkind choosing`) and on
    /// recorded ones in recorded noise.
    ///
    /// The more independent signs there are against the rate, the lower the probability; a few count little where mean
    /// and median interval agree. It is limited where another explanation is likely: missed beats, pauses, steps.
    pub(super) fn probability(&self, quality: f64, living: f64) -> f64 {
        let is_losing = self.lost > MOST_LOST
            && !self.is_clear(living)
            && !(self.agrees() && self.variation < STEADY);
        let has_rivals = self.has_rivals(quality);
        let signs = [
            has_rivals,
            self.doubled > MOST_DOUBLED,
            self.odd_unlike > MOST_ODD_UNLIKE,
            self.like < LEAST_LIKE && self.odd > MOST_ODD,
            self.saturated > MOST_SATURATED,
            is_losing,
        ];
        let signs = signs.iter().filter(|&&speaks| speaks).count();
        let is_noise = self.odd_unlike > NOISE_ODD_UNLIKE && self.variation > IRREGULAR;
        let is_harmless = self.intervals >= LEAST_INTERVALS
            && self.agrees()
            && !(has_rivals || is_losing || is_noise || self.doubled > MOST_DOUBLED);
        let most = match signs {
            0 => 1.0,
            1 | 2 if is_harmless => OF_SIGNS,
            1 => DOUBTFUL,
            2 if self.agrees() && !is_losing => DOUBTFUL,
            2 => OF_LOST,
            _ if self.agrees() => OF_THREE_AGREEING,
            _ => OF_THREE,
        };
        let of_steps = if self.agrees() { DOUBTFUL } else { OF_LOST };
        let of_few = if signs > 1 { OF_FEW } else { DOUBTFUL };
        let of_unclear = OF_UNCLEAR[signs.clamp(1, OF_UNCLEAR.len()) - 1];
        let limits = [
            (self.is_missed() || self.echoed > ALL_ECHOED || self.turns > MOST_TURNS, WRONG),
            (self.covered < HARDLY_COVERED, WRONG),
            (self.covered < FEW_COVERED, of_few),
            (is_losing && self.like < UNCLEAR_LIKE, of_unclear),
            (self.is_silent(living), DOUBTFUL),
            (self.may_be_steps(quality), of_steps),
        ];
        let limits = limits.iter().filter(|(applies, _)| *applies).map(|(_, limit)| *limit);
        interpolated(&OF_QUALITY, quality).min(limits.fold(most, f64::min))
    }

    /// Whether mean and median interval agree.
    fn agrees(&self) -> bool {
        (self.rate_ratio - 1.0).abs() < AGREEING
    }

    /// Whether deflections between beats may be beats.
    fn has_rivals(&self, quality: f64) -> bool {
        let is_noisy = quality < NOISY_QUALITY
            && self.unexplained > NOISY_UNEXPLAINED
            && self.rival > NOISY_RIVAL;
        let is_odd = self.uneven > RIVAL_UNEVEN || self.rival > EQUAL_RIVAL || !self.agrees();
        is_noisy || is_odd && self.unexplained > MOST_UNEXPLAINED && self.rival > RIVAL
    }

    /// Whether a beat is missed in each interval.
    fn is_missed(&self) -> bool {
        let is_irregular = self.variation > IRREGULAR;
        let has_rivals = self.unexplained > MISSED_UNEXPLAINED && self.rival > MISSED_RIVAL;
        let is_doubled = self.doubled > MOST_DOUBLED && self.rival > MISSED_DOUBLED_RIVAL;
        has_rivals && self.usual_ms > MISSED_SLOW_MS || is_irregular && (has_rivals || is_doubled)
    }

    /// Whether long intervals of a clear signal are those of an electrode that was off.
    fn is_clear(&self, living: f64) -> bool {
        self.like > CLEAR_LIKE
            && self.odd < CLEAR_ODD
            && self.covered > CLEAR_COVERED
            && self.rate_ratio > CLEAR_RATIO
            && CLEAR_LIVING.contains(&living)
    }

    /// Whether the heart may pause during a part of the span.
    fn is_silent(&self, living: f64) -> bool {
        let is_pausing = self.like > SILENT_LIKE
            && self.kurtosis > SILENT_KURTOSIS
            && (self.covered < SILENT_COVERED || living < VERY_SILENT_LIVING);
        let is_lost_clearly = self.lost > MOST_LOST && self.is_clear(living);
        living < SILENT_LIVING && !is_lost_clearly && (is_pausing || self.covered < LITTLE_COVERED)
    }

    /// Whether beats may be steps.
    fn may_be_steps(&self, quality: f64) -> bool {
        let is_odd = self.odd > STEP_ODD || self.uneven > VERY_UNEVEN;
        let is_fast = self.usual_ms < FAST_STEP_MS || self.rival < STEP_RIVAL;
        let is_noise =
            self.like < STEP_LIKE && quality < NOISY_QUALITY && self.variation < STEP_VARIATION;
        self.uneven > UNEVEN
            && self.like < UNEVEN_LIKE
            && self.kurtosis < UNEVEN_KURTOSIS
            && self.usual_ms < STEP_MS
            && (is_odd || is_fast && !is_noise)
    }
}

/// Whether a probability is that of a rate that may be right despite a sign against it.
pub(super) fn is_doubtful(probability: f64) -> bool {
    (OF_THREE_AGREEING..=DOUBTFUL).contains(&probability)
}

/// The mean deviation of intervals from the usual one, as a share of it.
fn variation(intervals_ms: &[f64], usual_ms: f64) -> f64 {
    let deviations = intervals_ms.iter().map(|rr_ms| (rr_ms / usual_ms - 1.0).abs());
    deviations.sum::<f64>() / intervals_ms.len().max(1) as f64
}

/// The share of a span that intervals cover, given their sum and median; 1 if the rest is too short for an interval.
fn covered(total_ms: f64, usual_ms: f64, span: Span) -> f64 {
    let span_ms = 1e3 * span.secs();
    let usual_ms = if usual_ms.is_nan() { LONGEST_USUAL_MS } else { usual_ms };
    if span_ms - total_ms < usual_ms { 1.0 } else { total_ms / span_ms }
}

/// The share of beats that are missing if every interval near a multiple of the usual one has lost some.
fn lost(intervals_ms: &[f64], usual_ms: f64) -> f64 {
    let missing = |rr_ms: &f64| ((rr_ms / usual_ms).round() - 1.0).max(0.0);
    let missing: f64 = intervals_ms.iter().map(missing).sum();
    if missing > 0.0 { missing / (intervals_ms.len() as f64 + missing) } else { 0.0 }
}

/// The share of intervals that are as short as those from beats to their T waves and follow a longer one.
fn turns(intervals_ms: &[f64]) -> f64 {
    let is_turn = |pair: &&[f64]| pair[1] < 1e3 * T_WAVE_SECS && pair[0] > T_WAVE_TURN * pair[1];
    let turns = intervals_ms.windows(2).filter(is_turn).count();
    turns as f64 / intervals_ms.len().max(1) as f64
}

/// The 90th percentile of heights as a multiple of the 10th; 1 without heights.
fn uneven(heights: &mut [f64]) -> f64 {
    let (low, high) = (quantile_in_place(heights, 0.1), quantile_in_place(heights, 0.9));
    low.zip(high).map_or(1.0, |(low, high)| high / low)
}

/// The share of intervals near twice the lower quartile, minus the share between once and twice.
fn doubled(mut intervals_ms: Vec<f64>) -> f64 {
    intervals_ms.sort_unstable_by(f64::total_cmp);
    let Some(&short_ms) = intervals_ms.get(intervals_ms.len() / 4) else { return 0.0 };
    let share = |range: std::ops::Range<f64>| {
        let within = intervals_ms.iter().filter(|each| range.contains(&(*each / short_ms)));
        within.count() as f64 / intervals_ms.len() as f64
    };
    share(1.85..2.15) - share(1.2..1.85)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ecg::likeness::Looks;

    /// Beats with these intervals [ms] and heights in turn, as similar to each other as given.
    fn beats(rr_ms: [f64; 2], heights: [f64; 2], likeness: f64) -> Vec<WindowBeat> {
        let beat = |index: usize| WindowBeat {
            at_ns: 0,
            rr_ms: Some(rr_ms[index % 2]),
            looks: Some(Looks {
                likeness: Some(likeness),
                deflection: 1.0,
                height: heights[index % 2],
            }),
            between: None,
            echo: None,
            steepness: None,
        };
        (0..40).map(beat).collect()
    }

    /// The evidence of these beats, which fill their span, in a signal of this kurtosis.
    fn doubt(beats: &[WindowBeat], kurtosis: f64) -> Doubt {
        let total_ms: f64 = beats.iter().filter_map(|beat| beat.rr_ms).sum();
        let span = Span { begin_ns: 0, end_ns: (1e6 * total_ms) as i64 };
        Doubt { kurtosis, ..Doubt::of(beats, None, span) }
    }

    fn probability(beats: &[WindowBeat], kurtosis: f64) -> f64 {
        doubt(beats, kurtosis).probability(0.9, 1.0)
    }

    fn regular() -> Doubt {
        doubt(&beats([800.0; 2], [1.0; 2], 0.99), 20.0)
    }

    #[test]
    fn beats_and_their_t_waves_in_turn_are_no_rate() {
        assert!(regular().probability(0.9, 1.0) > 0.9);
        assert!(probability(&beats([530.0, 235.0], [1.0, 1.2], 0.99), 20.0) <= 0.2);
    }

    #[test]
    fn beats_that_each_have_an_echo_are_every_second_one() {
        assert!(Doubt { echoed: 0.95, ..regular() }.probability(0.9, 1.0) < 0.1);
        assert!(Doubt { echoed: 0.2, ..regular() }.probability(0.9, 1.0) > 0.9);
    }

    #[test]
    fn deflections_as_large_as_beats_are_missed_beats_of_slow_rhythms() {
        let slow = doubt(&beats([1200.0; 2], [1.0; 2], 0.99), 20.0);
        assert!(slow.probability(0.9, 1.0) > 0.9);
        assert!(Doubt { unexplained: 0.9, rival: 0.9, ..slow }.probability(0.9, 1.0) < 0.1);
        assert!(Doubt { unexplained: 0.9, rival: 0.2, ..slow }.probability(0.9, 1.0) > 0.9);
    }

    #[test]
    fn odd_intervals_are_harmless_where_mean_and_median_agree() {
        let odd = Doubt { odd_unlike: 0.08, odd: 0.08, like: 0.9, ..regular() };
        assert!(odd.probability(0.9, 1.0) > 0.9);
        assert!(Doubt { rate_ratio: 1.1, ..odd }.probability(0.9, 1.0) < 0.8);
        assert!(Doubt { intervals: 10, ..odd }.probability(0.9, 1.0) < 0.8);
        let noisy = Doubt { odd_unlike: 0.2, odd: 0.3, variation: 0.2, ..odd };
        assert!(noisy.probability(0.9, 1.0) < 0.8);
    }

    #[test]
    fn lost_beats_are_harmless_in_a_clear_signal_alone() {
        let lost = Doubt { lost: 0.15, rate_ratio: 0.85, covered: 0.9, like: 0.997, ..regular() };
        assert!(lost.probability(0.9, 0.9) > 0.9);
        assert!(Doubt { like: 0.98, ..lost }.probability(0.9, 0.9) < 0.4);
    }

    #[test]
    fn a_clear_signal_without_beats_may_be_a_pause() {
        let paused = Doubt { covered: 0.7, like: 0.995, ..regular() };
        assert!(paused.probability(0.9, 0.7) < 0.8);
        assert!(Doubt { like: 0.97, ..paused }.probability(0.9, 0.7) > 0.9);
        assert!(Doubt { covered: 0.02, ..paused }.probability(0.9, 0.7) < 0.1);
    }

    #[test]
    fn uneven_beats_of_a_broad_signal_may_be_steps() {
        assert!(probability(&beats([400.0; 2], [2.0, 3.0], 0.96), 5.0) < 0.8);
        assert!(probability(&beats([400.0; 2], [2.0, 3.0], 0.96), 20.0) > 0.9);
        assert!(probability(&beats([400.0; 2], [2.0, 3.0], 0.99), 5.0) > 0.9);
    }
}
