//! Evidence against a heart rate whose beats look well.

use super::windows::WindowBeat;
use crate::robust::{interpolated, median_in_place};

/// An interval is odd when it deviates from the median by more than this share.
const ODD: f64 = 0.25;
/// A beat is unlike those before it below this similarity.
const UNLIKE: f64 = 0.8;
/// A deflection between beats is unexplained above this share of their height.
const UNEXPLAINED: f64 = 0.35;

/// The probability by signal quality alone, when there is no other evidence against the rate.
const OF_QUALITY: [(f64, f64); 6] =
    [(0.0, 0.0), (0.4, 0.5), (0.55, 0.75), (0.8, 0.8), (0.85, 0.95), (1.0, 0.99)];
/// The limits above which each share counts against it.
const MOST_UNEXPLAINED: f64 = 0.08;
const MOST_DOUBLED: f64 = 0.05;
const MOST_ODD_UNLIKE: f64 = 0.03;
const LEAST_LIKE: f64 = 0.92;
const MOST_ODD: f64 = 0.05;
const MOST_SATURATED: f64 = 0.1;

/// Shares of beats, all between 0 and 1.
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
    /// The share of beats preceded by a deflection as high as a beat where there is no T or P wave: a missed
    /// beat.
    pub(super) unexplained: f64,
}

impl Doubt {
    pub(super) fn of(beats: &[WindowBeat], saturated: f64) -> Doubt {
        let intervals = || beats.iter().filter_map(|beat| beat.rr_ms);
        let usual_ms = median_in_place(&mut intervals().collect::<Vec<_>>()).unwrap_or(f64::NAN);
        let heights = beats.iter().filter_map(|beat| Some(beat.looks?.height));
        let height = median_in_place(&mut heights.collect::<Vec<_>>()).unwrap_or(f64::NAN);
        let likeness = |beat: &WindowBeat| beat.looks.and_then(|looks| looks.likeness);
        let likenesses: Vec<f64> = beats.iter().filter_map(likeness).collect();
        let is_odd = |beat: &&WindowBeat| {
            beat.rr_ms.is_some_and(|rr_ms| (rr_ms / usual_ms - 1.0).abs() > ODD)
        };
        let is_unlike =
            |beat: &&WindowBeat| likeness(beat).is_none_or(|likeness| likeness < UNLIKE);
        let is_unexplained =
            |beat: &&WindowBeat| beat.between.is_some_and(|between| between > UNEXPLAINED * height);
        let share = |count: usize| count as f64 / beats.len().max(1) as f64;
        Doubt {
            doubled: doubled(intervals().collect()),
            saturated,
            like: likenesses.iter().sum::<f64>() / likenesses.len().max(1) as f64,
            odd: share(beats.iter().filter(is_odd).count()),
            odd_unlike: share(beats.iter().filter(is_odd).filter(is_unlike).count()),
            unexplained: share(beats.iter().filter(is_unexplained).count()),
        }
    }

    /// The probability that the rate is correct within 10 %, given the signal quality, calibrated on
    /// simulated signals of 24 kinds (`bench/signal/measure_unkind choosing`).
    pub(super) fn probability(&self, quality: f64) -> f64 {
        let speaks_against = [
            (self.unexplained > MOST_UNEXPLAINED, 0.6),
            (self.doubled > MOST_DOUBLED, 0.6),
            (self.odd_unlike > MOST_ODD_UNLIKE, 0.75),
            (self.like < LEAST_LIKE && self.odd > MOST_ODD, 0.75),
            (self.saturated > MOST_SATURATED, 0.75),
        ];
        let most = speaks_against.iter().filter(|(speaks, _)| *speaks).map(|(_, most)| *most);
        most.fold(interpolated(&OF_QUALITY, quality), f64::min)
    }
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
