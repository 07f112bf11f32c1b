//! Beats of two independent rhythms: of two hearts, or of a heart and clicks.

use super::windows::WindowBeat;
use crate::robust::median_in_place;

/// Beats are of two kinds if the variance between the kinds is at least this share of the total variance.
const APART: f64 = 0.70;
/// The fewest beats in which two rhythms are looked for, and the fewest of one kind.
const LEAST_IN_ALL: usize = 10;
const LEAST_BEATS: usize = 3;
/// The rate of all beats is wrong if it exceeds that of one rhythm by more than this factor; or if the median interval
/// of that rhythm is shorter than this [s], like the intervals of two hearts together, and the other beats are at least
/// this share of all.
const FASTER: f64 = 1.1;
const FAST_SECS: f64 = 0.62;
const LEAST_SHARE: f64 = 0.2;
/// Limits of the mean relative deviation of intervals from the median interval. Beats of one rhythm are regular below
/// the first limit, if the deviation of all beats exceeds the second limit and is at least this many times as large.
/// Within one rhythm, deviations are taken from the nearest multiple of the median interval, up to this multiple.
const REGULAR: f64 = 0.06;
const IRREGULAR: f64 = 0.03;
const TIMES_REGULAR: f64 = 2.0;
const MOST_MULTIPLE: f64 = 4.0;
/// The shortest median interval of a heart [s].
const LEAST_SECS: f64 = 0.27;
/// Premature beats follow other beats, or are followed by them, at a constant delay: the mean resultant length of their
/// phases exceeds this.
const MOST_LOCKED: f64 = 0.9;

/// Whether the beats of a span are those of two rhythms that differ in shape.
pub(super) fn is_in_company(beats: &[WindowBeat]) -> bool {
    let first_ns = beats.first().map_or(0, |beat| beat.at_ns);
    let secs = |beat: &WindowBeat| (beat.at_ns - first_ns) as f64 / 1e9;
    let times: Vec<f64> = beats.iter().map(secs).collect();
    let irregularity = irregularity(&times, 1.0);
    if times.len() < LEAST_IN_ALL || irregularity < IRREGULAR {
        return false;
    }
    let regular = REGULAR.min(irregularity / TIMES_REGULAR);
    let traits: [fn(&WindowBeat) -> Option<f64>; 3] = [
        |beat| Some(beat.looks?.deflection),
        |beat| Some(beat.looks?.height.ln()),
        |beat| Some(beat.steepness?.own.ln()),
    ];
    traits.into_iter().any(|of| {
        let known = beats.iter().zip(&times).filter_map(|(beat, at)| Some((*at, of(beat)?)));
        let known: Vec<(f64, f64)> = known.filter(|(_, value)| value.is_finite()).collect();
        limit(known.iter().map(|(_, value)| *value).collect()).is_some_and(|limit| {
            let (high, low): (Vec<(f64, f64)>, Vec<_>) =
                known.iter().partition(|(_, value)| *value > limit);
            let times = |kind: Vec<(f64, f64)>| kind.iter().map(|(at, _)| *at).collect::<Vec<_>>();
            let (high, low) = (times(high), times(low));
            are_strangers(&high, &low, regular) || are_strangers(&low, &high, regular)
        })
    })
}

/// The value that separates two kinds; `None` if there is only one.
fn limit(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let all: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let mut sum = 0.0;
    let (mut most, mut limit) = (APART * all, None);
    for (place, pair) in values.windows(2).enumerate() {
        sum += pair[0] - mean;
        let below = place + 1;
        let above = values.len() - below;
        let between = sum * sum * (1.0 / below as f64 + 1.0 / above as f64);
        if between > most && below.min(above) >= LEAST_BEATS {
            (most, limit) = (between, Some(pair[0].midpoint(pair[1])));
        }
    }
    limit
}

/// Whether beats at these times [s] are regular and the beats at the other times are independent of them.
fn are_strangers(times: &[f64], others: &[f64], regular: f64) -> bool {
    let Some(usual) = usual(times).filter(|usual| *usual > LEAST_SECS) else { return false };
    others.len() >= LEAST_BEATS
        && irregularity(times, MOST_MULTIPLE) < regular
        && makes_another_rate(times, others, usual)
        && locked(times, others, usual) < MOST_LOCKED
        && locked(others, times, usual) < MOST_LOCKED
}

fn makes_another_rate(times: &[f64], others: &[f64], usual: f64) -> bool {
    let all = (times.len() + others.len()) as f64;
    let ends = |pick: fn(f64, f64) -> f64| times.iter().chain(others).copied().reduce(pick);
    let secs = ends(f64::max).zip(ends(f64::min)).map_or(0.0, |(last, first)| last - first);
    usual * (all - 1.0) > FASTER * secs
        || usual < FAST_SECS && others.len() as f64 >= LEAST_SHARE * all
}

fn usual(times: &[f64]) -> Option<f64> {
    median_in_place(&mut times.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<_>>())
}

/// The mean deviation of intervals from the nearest multiple of the median one, as a share of that multiple.
fn irregularity(times: &[f64], most_multiple: f64) -> f64 {
    let Some(usual) = usual(times) else { return 0.0 };
    let off = |pair: &[f64]| {
        let cycles = (pair[1] - pair[0]) / usual;
        (cycles / cycles.round().clamp(1.0, most_multiple) - 1.0).abs().min(1.0)
    };
    times.windows(2).map(off).sum::<f64>() / (times.len() - 1) as f64
}

/// The mean resultant length of the phases of `others` after these times: 0 if they are uniform, 1 if they are equal.
fn locked(times: &[f64], others: &[f64], usual: f64) -> f64 {
    let (mut sine, mut cosine, mut count) = (0.0, 0.0, 0.0);
    for other in others {
        let after = times.partition_point(|at| at <= other);
        let Some(before) = after.checked_sub(1).and_then(|place| times.get(place)) else {
            continue;
        };
        let (y, x) = (std::f64::consts::TAU * (other - before) / usual).sin_cos();
        sine += y;
        cosine += x;
        count += 1.0;
    }
    if count > 0.0 { f64::hypot(sine, cosine) / count } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ecg::likeness::Looks;

    /// A rhythm from one of these times to 30 s, with this interval [s], and beats of this height.
    fn rhythm(begin: f64, interval: f64, height: f64) -> impl Iterator<Item = (f64, f64)> {
        let at = move |k: u32| begin + f64::from(k) * interval;
        (0..200).map(at).take_while(|at| *at < 30.0).map(move |at| (at, height))
    }

    /// Whether these beats (time [s] and height) are of two rhythms.
    fn are_two(beats: impl Iterator<Item = (f64, f64)>) -> bool {
        let mut beats: Vec<(f64, f64)> = beats.collect();
        beats.sort_by(|a, b| a.0.total_cmp(&b.0));
        let beat = |&(at, height): &(f64, f64)| WindowBeat {
            at_ns: (1e9 * at) as i64,
            rr_ms: None,
            looks: Some(Looks { likeness: Some(0.9), deflection: height, height }),
            between: None,
            echo: None,
            steepness: None,
        };
        is_in_company(&beats.iter().map(beat).collect::<Vec<_>>())
    }

    #[test]
    fn two_hearts_that_look_different_are_two_rhythms() {
        for height in [0.4, 0.7, 1.6] {
            assert!(are_two(rhythm(0.0, 0.93, 1.0).chain(rhythm(0.4, 0.61, height))), "{height}");
        }
    }

    #[test]
    fn a_few_clicks_at_random_are_not_of_the_heart() {
        let clicks = [3.3, 11.65, 20.1, 27.5].map(|at| (at, 1.7));
        assert!(are_two(rhythm(0.0, 0.9, 1.0).chain(clicks)));
    }

    #[test]
    fn one_heart_is_one_rhythm_whatever_its_heights() {
        assert!(!are_two(rhythm(0.0, 0.8, 1.0)));
        assert!(!are_two(rhythm(0.0, 1.6, 1.0).chain(rhythm(0.8, 1.6, 0.5))), "in turn");
        assert!(!are_two(rhythm(0.0, 1.6, 1.0).chain(rhythm(0.5, 1.6, 1.4))), "bigeminy");
        assert!(!are_two([].into_iter()));
    }

    #[test]
    fn beats_at_one_time_are_no_rhythm() {
        assert!(!are_two(std::iter::repeat_n((1.0, 1.0), 6).chain(rhythm(1.5, 0.8, 1.0))));
        assert!(!are_two((0..40).map(|k| (f64::from(k * k % 3), 1.0))));
    }

    #[test]
    fn a_premature_beat_now_and_then_comes_at_its_time_after_others() {
        let normal = rhythm(0.0, 0.9, 1.0).enumerate();
        let with_early = normal.flat_map(|(k, (at, height))| {
            let early = (k % 5 == 2).then_some((at + 0.5, 1.6));
            (k % 5 != 3).then_some((at, height)).into_iter().chain(early)
        });
        assert!(!are_two(with_early));
    }
}
