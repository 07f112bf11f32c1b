//! Evidence against a heart rate whose beats look plausible.

use super::judge::T_WAVE_SECS;
use super::signs::Signs;
use super::windows::WindowBeat;
use crate::robust::{interpolated, median_in_place, quantile_in_place};

/// An interval is odd when it deviates from the median by more than this share.
const ODD: f64 = 0.25;
/// A beat is unlike those before it below this similarity.
const UNLIKE: f64 = 0.8;
/// A deflection between beats is unexplained above this share of their height.
const UNEXPLAINED: f64 = 0.35;

/// A deflection between beats is an echo of them above this correlation and share of their size.
const ECHO_CORRELATION: f64 = 0.85;
const ECHO_SHARE: f64 = 0.15;

/// Two intervals in turn may be those of beats and of their T waves: the shorter one is that of a T wave, and the
/// longer one above this multiple of it.
const T_WAVE_TURN: f64 = 1.5;
/// Above this share of all intervals they are, and the rate is at most this probable.
const MOST_TURNS: f64 = 0.3;
const MOST_OF_TURNS: f64 = 0.2;

/// The probability from signal quality alone, when there is no other evidence against the rate. Even in heavy
/// noise, beats without such evidence are nearly always right.
const OF_QUALITY: [(f64, f64); 6] =
    [(0.0, 0.0), (0.03, 0.03), (0.06, 0.78), (0.2, 0.79), (0.25, 0.93), (1.0, 0.99)];
/// The limits above which each share counts against it.
const MOST_UNEXPLAINED: f64 = 0.08;
const MOST_DOUBLED: f64 = 0.05;
const MOST_ODD_UNLIKE: f64 = 0.03;
const LEAST_LIKE: f64 = 0.92;
const MOST_ODD: f64 = 0.05;
const MOST_SATURATED: f64 = 0.1;
const MOST_ECHOED: f64 = 0.3;
/// Where above this share of beats has an echo, every second beat is missed.
const ALL_ECHOED: f64 = 0.6;
const MOST_OF_ECHOED: f64 = 0.05;
const MOST_LOST: f64 = 0.06;
/// Steps, or noise, may be taken for beats where the tenth of the highest beats is above this multiple of the tenth of
/// the lowest, beats are less similar than this, and the kurtosis of the signal is below this. Where amplitudes swing
/// with the breath, beats are more similar, and narrow.
const UNEVEN: f64 = 1.3;
const UNEVEN_LIKE: f64 = 0.975;
const UNEVEN_KURTOSIS: f64 = 8.0;
const MOST_UNEVEN: f64 = 0.79;
/// Where nearly every interval has an unexplained deflection, a whole rhythm may be missed.
const MOSTLY_UNEXPLAINED: f64 = 0.6;
/// A span is live above this share of living signal; in any other span that share, raised to the power below,
/// scales the probability: a flat, saturated or silent signal hides beats.
const LIVELY: f64 = 0.95;
const LIVING_WEIGHT: f64 = 1.25;
const MOST_UNLIVELY: f64 = 0.79;

/// Shares of beats, each between 0 and 1, and of the signal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Doubt {
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
    /// The share of beats preceded by a deflection of their own form where there is no T or P wave, however
    /// low: a missed beat of a heart whose beats alternate in height.
    pub(super) echoed: f64,
    /// The share of beats that may be lost in intervals near a multiple of the median.
    pub(super) lost: f64,
    /// The share of intervals that are as short as those from beats to their T waves and follow a longer one.
    pub(super) turns: f64,
    /// The 90th percentile of the heights of beats as a multiple of the 10th.
    pub(super) uneven: f64,
}

impl Doubt {
    pub(super) fn of(beats: &[WindowBeat], signs: Option<Signs>) -> Doubt {
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
        Doubt {
            lost: lost(&intervals_ms, usual_ms),
            turns: turns(&intervals_ms),
            doubled: doubled(intervals_ms),
            saturated: signs.map_or(0.0, |signs| signs.saturated),
            kurtosis: signs.and_then(|signs| signs.kurtosis.ok()).unwrap_or(f64::NAN),
            like: likenesses.iter().sum::<f64>() / likenesses.len().max(1) as f64,
            odd: share(beats.iter().filter(is_odd).count()),
            odd_unlike: share(beats.iter().filter(is_odd).filter(is_unlike).count()),
            unexplained: share(beats.iter().filter(is_unexplained).count()),
            echoed: share(beats.iter().filter(is_echoed).count()),
            uneven: uneven(&mut heights),
        }
    }

    /// The probability that the rate is correct within 10 %, given the signal quality and the share of
    /// living signal, calibrated on simulated signals of 24 kinds (`bench/signal/measure_unkind choosing`).
    ///
    /// The more independent evidence there is against the rate, the less.
    pub(super) fn probability(&self, quality: f64, living: f64) -> f64 {
        let is_lively = living > LIVELY;
        let is_echoed = self.echoed > MOST_ECHOED;
        let speaks_against = [
            self.unexplained > MOST_UNEXPLAINED,
            self.doubled > MOST_DOUBLED,
            self.odd_unlike > MOST_ODD_UNLIKE,
            self.like < LEAST_LIKE && self.odd > MOST_ODD,
            self.saturated > MOST_SATURATED,
            is_echoed,
            self.lost > MOST_LOST,
        ];
        let most = match speaks_against.iter().filter(|&&speaks| speaks).count() {
            0 => 1.0,
            1 if self.unexplained >= MOSTLY_UNEXPLAINED => 0.35,
            1 if is_lively && !is_echoed && self.odd < MOST_ODD => 0.93,
            1 => 0.79,
            2 => 0.6,
            3 => 0.25,
            _ => 0.2,
        };
        let is_uneven =
            self.uneven > UNEVEN && self.like < UNEVEN_LIKE && self.kurtosis < UNEVEN_KURTOSIS;
        let limits = [
            (self.turns > MOST_TURNS, MOST_OF_TURNS),
            (self.echoed > ALL_ECHOED, MOST_OF_ECHOED),
            (is_uneven, MOST_UNEVEN),
        ];
        let most = limits
            .iter()
            .filter(|(applies, _)| *applies)
            .map(|(_, limit)| *limit)
            .fold(most, f64::min);
        let probability = interpolated(&OF_QUALITY, quality).min(most);
        if is_lively {
            probability
        } else {
            (probability * living.max(0.0).powf(LIVING_WEIGHT)).min(MOST_UNLIVELY)
        }
    }
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
        };
        (0..40).map(beat).collect()
    }

    fn probability(beats: &[WindowBeat], kurtosis: f64) -> f64 {
        Doubt { kurtosis, ..Doubt::of(beats, None) }.probability(0.9, 1.0)
    }

    #[test]
    fn beats_and_their_t_waves_in_turn_are_no_rate() {
        assert!(probability(&beats([800.0; 2], [1.0; 2], 0.99), 20.0) > 0.9);
        assert!(probability(&beats([530.0, 235.0], [1.0, 1.2], 0.99), 20.0) <= 0.2);
    }

    #[test]
    fn beats_that_each_have_an_echo_are_every_second_one() {
        let regular =
            Doubt { kurtosis: 20.0, ..Doubt::of(&beats([800.0; 2], [1.0; 2], 0.99), None) };
        assert!(Doubt { echoed: 0.95, ..regular }.probability(0.9, 1.0) < 0.1);
        assert!(Doubt { echoed: 0.2, ..regular }.probability(0.9, 1.0) > 0.9);
    }

    #[test]
    fn uneven_beats_of_a_broad_signal_may_be_steps() {
        assert!(probability(&beats([400.0; 2], [2.0, 3.0], 0.96), 5.0) < 0.8);
        assert!(probability(&beats([400.0; 2], [2.0, 3.0], 0.96), 20.0) > 0.9);
        assert!(probability(&beats([400.0; 2], [2.0, 3.0], 0.99), 5.0) > 0.9);
    }
}
