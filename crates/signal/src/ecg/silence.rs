//! Stretches of a span without beats: if the heart pauses, they are as quiet as the rests between beats; if an
//! electrode is off, their noise is different, or absent.

use super::windows::{LONGEST_PAUSE_SECS, LONGEST_SECS, WindowBeat};
use crate::analysis::{Span, Track};
use crate::robust::median_in_place;

/// A stretch without beats is longer than this, and than this many usual intervals [s].
const LEAST_SECS: f64 = 1.5;
const LEAST_CYCLES: f64 = 1.4;
/// The margins of a stretch that may contain the T wave of the beat before and the P wave of the next [s].
const AFTER_SECS: f64 = 0.5;
const BEFORE_SECS: f64 = 0.25;
/// The rest in a usual interval, as shares of the interval.
const REST: (f64, f64) = (0.55, 0.8);
const SHORTEST_CYCLES: f64 = 0.5;
/// The time over which changes are taken [s].
const LAG_SECS: f64 = 0.008;
/// The noise of a stretch counts as different outside these multiples of the noise of rests.
const SAME_NOISE: (f64, f64) = (0.4, 1.3);
/// The longest pause of a heart that may be an interval [s].
const LONGEST_INTERVAL_SECS: f64 = 15.0;
/// The minimum share of samples present with which a stretch hides no beat.
const LEAST_COVERED: f64 = 0.98;

/// The stretches of a span without beats.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Silence {
    /// There are no stretches with samples.
    Nowhere,
    /// The stretches are as quiet as rests between beats.
    Quiet,
    /// The stretches are as quiet, but in one of them the detector restarted and may have missed a beat.
    Long,
    /// At least one stretch has a different noise, or none.
    Other,
    /// There are no rests to compare the stretches with.
    Unknown,
}

/// A stretch without beats.
struct Stretch {
    /// The index of the beat at the end of the stretch.
    place: usize,
    secs: f64,
    noise: f64,
    is_whole: bool,
}

impl Silence {
    /// Judges the stretches between the beats of a span and its ends; `outside_ns` are the times of the beats before
    /// and after the span, if there are any. A long stretch becomes the interval of the beat at its end if it is quiet
    /// and not too long; if it is noisy or too long, that beat has no interval.
    pub(super) fn judge(
        track: &Track,
        beats: &mut [WindowBeat],
        span: Span,
        outside_ns: [Option<i64>; 2],
    ) -> Silence {
        let inside = beats.iter().map(|beat| beat.at_ns);
        let times_ns: Vec<i64> =
            std::iter::once(span.begin_ns).chain(inside).chain([span.end_ns]).collect();
        let pairs = || times_ns.windows(2).map(|pair| Span { begin_ns: pair[0], end_ns: pair[1] });
        if pairs().all(|pair| pair.secs() <= LEAST_SECS) {
            return Silence::Nowhere;
        }
        let mut intervals: Vec<f64> = beats.iter().filter_map(|beat| beat.rr_ms).collect();
        let usual_secs = median_in_place(&mut intervals).unwrap_or(f64::NAN) / 1e3;
        let is_silent =
            |pair: &Span| pair.secs() > LEAST_SECS && pair.secs() > LEAST_CYCLES * usual_secs;
        let silent = pairs().enumerate().filter(|(_, pair)| is_silent(pair));
        let stretches: Vec<Stretch> =
            silent.filter_map(|(place, pair)| Stretch::of(track, place, pair)).collect();
        if stretches.is_empty() {
            return Silence::Nowhere;
        }
        let is_usual =
            |pair: &Span| (SHORTEST_CYCLES..LEAST_CYCLES).contains(&(pair.secs() / usual_secs));
        let rest =
            |pair: Span| noise(track, part(pair, REST.0 * pair.secs(), REST.1 * pair.secs()));
        let mut rests: Vec<f64> = pairs().skip(1).filter(is_usual).filter_map(rest).collect();
        let Some(at_rest) = median_in_place(&mut rests) else { return Silence::Unknown };
        let [before_secs, after_secs] = outside_secs(span, outside_ns);
        let outside = |stretch: &Stretch| match stretch.place {
            0 => before_secs,
            place if place == beats.len() => after_secs,
            _ => 0.0,
        };
        let longest_secs =
            stretches.iter().map(|each| each.secs + outside(each)).fold(0.0, f64::max);
        let is_other = |stretch: &Stretch| {
            stretch.noise < SAME_NOISE.0 * at_rest || stretch.noise > SAME_NOISE.1 * at_rest
        };
        for stretch in stretches.iter().filter(|stretch| stretch.secs > LONGEST_SECS) {
            if let Some(beat) = beats.get_mut(stretch.place) {
                stretch.end(beat, is_other(stretch));
            }
        }
        if stretches.iter().any(is_other) {
            Silence::Other
        } else if longest_secs > LONGEST_PAUSE_SECS {
            Silence::Long
        } else {
            Silence::Quiet
        }
    }
}

impl Stretch {
    /// The stretch before the beat at an index; `None` without samples.
    fn of(track: &Track, place: usize, span: Span) -> Option<Stretch> {
        let secs = span.secs();
        let noise = noise(track, part(span, AFTER_SECS, secs - BEFORE_SECS))?;
        let is_whole = track.coverage(span) >= LEAST_COVERED;
        Some(Stretch { place, secs, noise, is_whole })
    }

    /// Decides whether the stretch is the interval of the beat at its end.
    fn end(&self, beat: &mut WindowBeat, is_other: bool) {
        if is_other || self.secs > LONGEST_INTERVAL_SECS {
            beat.rr_ms = None;
        } else if self.place > 0 && self.is_whole {
            beat.rr_ms = beat.rr_ms.or(Some(1e3 * self.secs));
        }
    }
}

/// The times from the beats before and after a span to its ends [s]; 0 without such a beat.
fn outside_secs(span: Span, [before_ns, after_ns]: [Option<i64>; 2]) -> [f64; 2] {
    let secs = |from_ns: i64, to_ns: i64| to_ns.saturating_sub(from_ns) as f64 / 1e9;
    [
        before_ns.map_or(0.0, |at_ns| secs(at_ns, span.begin_ns)),
        after_ns.map_or(0.0, |at_ns| secs(span.end_ns, at_ns)),
    ]
}

fn part(span: Span, from_secs: f64, to_secs: f64) -> Span {
    let after = |secs: f64| span.begin_ns.saturating_add((1e9 * secs) as i64);
    Span { begin_ns: after(from_secs), end_ns: after(to_secs) }
}

/// The median change of a signal over 8 ms [unit of the signal].
fn noise(track: &Track, span: Span) -> Option<f64> {
    let values = track.values_in(span);
    let lag = ((LAG_SECS * track.rate_hz()).round() as usize).max(1);
    let changes = values.iter().zip(values.get(lag..)?).map(|(a, b)| (b - a).abs());
    median_in_place(&mut changes.filter(|change| change.is_finite()).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 100.0;
    const SPAN: Span = Span { begin_ns: 0, end_ns: 30_000_000_000 };

    /// A signal of 30 s that changes by ±1 from sample to sample, and by ±`noise` from 10 s to `until_secs`, in which
    /// there is no beat; else there is one each second. The beats have the intervals that the detector gives them.
    fn span(noise: f64, until_secs: usize) -> (Track, Vec<WindowBeat>) {
        let mut track = Track::new(RATE_HZ);
        for k in 0..3000 {
            let size = if (1000..until_secs * 100).contains(&k) { noise } else { 1.0 };
            let value = if k % 2 == 0 { size } else { -size };
            track.push((k * 10_000_000) as i64, value);
        }
        let secs = (1..30).filter(|secs| *secs <= 10 || *secs >= until_secs);
        let mut before = 0;
        let mut beat = |secs: usize| {
            let interval_ms = 1e3 * (secs - std::mem::replace(&mut before, secs)) as f64;
            WindowBeat {
                at_ns: secs as i64 * 1_000_000_000,
                rr_ms: Some(interval_ms).filter(|rr_ms| *rr_ms <= 1e3 * LONGEST_PAUSE_SECS),
                looks: None,
                between: None,
                echo: None,
                steepness: None,
            }
        };
        let beats = secs.map(&mut beat).collect();
        (track, beats)
    }

    /// The silence of such a span, and the interval of the beat at its end [ms].
    fn judged(noise: f64, until_secs: usize) -> (Silence, Option<f64>) {
        let (track, mut beats) = span(noise, until_secs);
        let silence = Silence::judge(&track, &mut beats, SPAN, [None; 2]);
        (silence, beats[10].rr_ms)
    }

    #[test]
    fn a_pause_as_quiet_as_rests_is_an_interval() {
        assert_eq!(judged(1.0, 15), (Silence::Quiet, Some(5000.0)));
        assert_eq!(judged(1.0, 20), (Silence::Long, Some(10_000.0)));
        assert_eq!(judged(1.0, 28), (Silence::Long, None));
    }

    #[test]
    fn a_pause_is_as_long_as_to_the_beat_after_the_span() {
        let of = |after_secs: i64| {
            let (track, mut beats) = span(1.0, 10);
            beats.retain(|beat| beat.at_ns <= 25_000_000_000);
            let after_ns = SPAN.end_ns + after_secs * 1_000_000_000;
            Silence::judge(&track, &mut beats, SPAN, [None, Some(after_ns)])
        };
        assert_eq!((of(2), of(4)), (Silence::Quiet, Silence::Long));
    }

    #[test]
    fn a_stretch_with_another_noise_is_no_interval() {
        assert_eq!(judged(4.0, 15), (Silence::Other, None));
        assert_eq!(judged(4.0, 20), (Silence::Other, None));
        assert_eq!(judged(0.0, 15), (Silence::Other, None), "a line that is flat");
    }

    #[test]
    fn usual_intervals_and_stretches_without_samples_are_no_silence() {
        assert_eq!(judged(1.0, 11), (Silence::Nowhere, Some(1000.0)));
        assert_eq!(judged(f64::NAN, 15), (Silence::Nowhere, Some(5000.0)));
    }

    #[test]
    fn without_usual_intervals_nothing_is_known() {
        let (track, mut beats) = span(1.0, 25);
        beats.retain(|beat| beat.at_ns == 10_000_000_000 || beat.at_ns == 25_000_000_000);
        assert_eq!(Silence::judge(&track, &mut beats, SPAN, [None; 2]), Silence::Unknown);
    }
}
