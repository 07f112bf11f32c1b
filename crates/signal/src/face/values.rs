//! The values of a span of face landmarks.

use super::Frame;
use super::blinks::Closure;
use super::store::Store;
use crate::analysis::{Measured, Reason, Span, Value};
use crate::coverage::coverage;
use crate::points::{Stay, speed};

/// The longest time that a picture accounts for [ns].
const STANDS_NANOS: i64 = 500_000_000;
/// The noise of the opening, relative to open eyes, over which quality falls from 1 to 0.
const NOISE: (f64, f64) = (0.06, 0.16);
/// The frame rates over which quality rises from 0 to 1 [Hz]: a blink takes 0.1 to 0.4 s.
const PICTURES_HZ: (f64, f64) = (8.0, 14.0);
/// The lowest quality for which blinks and closures are reported.
const LEAST_QUALITY: f64 = 0.3;

/// The values of windows.
pub(super) static VALUES: [Value; 8] = [
    Value::new(
        "BLINK_Rate",
        "1/min",
        "blinks (the opening of the eyes, height over width of their landmarks, falls below 0.7 of its 70th percentile over 60 s and by five standard deviations of its noise, for 0.03 to 0.5 s at half depth) over the time with eyes in view",
    ),
    Value::new("BLINK_Duration", "s", "mean duration of blinks at half depth"),
    Value::new(
        "BLINK_Amplitude",
        "1",
        "mean depth of blinks, relative to the opening of open eyes",
    ),
    Value::new(
        "EYE_PERCLOS",
        "1",
        "share of time with the eyes at least 80 % closed (P80), from open eyes to the median of 20 closures; up to 0.06 too high for a person who never closes them completely",
    ),
    Value::new(
        "EYE_LongestClosure",
        "s",
        "longest closure at half depth that is longer than a blink; 0 without one",
    ),
    Value::new(
        "HEAD_Movement",
        "1/s",
        "path of the midpoint between the eyes (means of 0.25 s), in eye distances, over time",
    ),
    Value::new(
        "HEAD_Tilt",
        "rad",
        "mean tilt of the line between the eyes, positive towards the right shoulder",
    ),
    Value::new("FACE_Presence", "1", "share of pictures with the eyes in view"),
];

/// The values of a span.
pub(super) fn measure(store: &Store, span: Span) -> Measured {
    let frames: Vec<(Frame, f64)> = store.frames(span).copied().collect();
    let coverage = covered(frames.iter().map(|(frame, _)| frame), span);
    let faces = frames.iter().map(|(frame, _)| frame).filter(|frame| frame.place[0].is_finite());
    let presence = faces.clone().count() as f64 / frames.len() as f64;
    let tilts = faces.clone().map(|frame| frame.tilt);
    let eyes: Vec<(Frame, f64)> =
        frames.iter().filter(|(frame, _)| frame.open.is_finite()).copied().collect();
    let quality = quality(&frames, &eyes);
    let of_eyes = |value: Option<f64>| match value {
        _ if eyes.is_empty() => Err(Reason::Missing),
        _ if quality < LEAST_QUALITY => Err(Reason::Quality),
        value => value.filter(|value| value.is_finite()).ok_or(Reason::Short),
    };
    let closures: Vec<&Closure> = store.closures(span).collect();
    let blinks = || closures.iter().filter(|closure| closure.is_blink());
    let seen_secs = span.secs() * covered(eyes.iter().map(|(frame, _)| frame), span);
    let rate = 60.0 * blinks().count() as f64 / seen_secs;
    let longest = closures.iter().filter(|closure| !closure.is_blink()).map(|closure| closure.secs);
    let values = vec![
        of_eyes(Some(rate)),
        of_eyes(mean(blinks().map(|blink| blink.secs))),
        of_eyes(mean(blinks().map(|blink| blink.depth))),
        of_eyes(closed(&eyes)),
        of_eyes(Some(longest.fold(0.0, f64::max))),
        movement(faces).ok_or(Reason::Short),
        mean(tilts).ok_or(Reason::Missing),
        if frames.is_empty() { Err(Reason::Gap) } else { Ok(presence) },
    ];
    Measured { coverage, quality, values }
}

/// How reliable blinks are [0..1]: the eyes are in view, at a sufficient frame rate, with little noise.
fn quality(frames: &[(Frame, f64)], eyes: &[(Frame, f64)]) -> f64 {
    let [Some((first, _)), Some((last, _))] = [eyes.first(), eyes.last()] else { return 0.0 };
    let secs = (last.at_ns - first.at_ns) as f64 / 1e9;
    let hz = (eyes.len() - 1) as f64 / secs.max(f64::MIN_POSITIVE);
    let noise = mean(eyes.iter().map(|(frame, _)| frame.noise)).unwrap_or(f64::INFINITY);
    let share = eyes.len() as f64 / frames.len() as f64;
    share * rise(hz, PICTURES_HZ) * (1.0 - rise(noise, NOISE))
}

/// The share of time with closed eyes.
fn closed(eyes: &[(Frame, f64)]) -> Option<f64> {
    let (mut closed_ns, mut all_ns) = (0, 0);
    for pair in eyes.windows(2) {
        let ((frame, closed), (next, _)) = (pair[0], pair[1]);
        let stands_ns = (next.at_ns - frame.at_ns).min(STANDS_NANOS);
        all_ns += stands_ns;
        closed_ns += if frame.open <= closed { stands_ns } else { 0 };
    }
    (all_ns > 0).then(|| closed_ns as f64 / all_ns as f64)
}

/// The speed of the head [distances between the eyes per second].
fn movement<'a>(faces: impl Iterator<Item = &'a Frame>) -> Option<f64> {
    speed(faces.map(|face| Stay { at_ns: face.at_ns, place: face.place, unit: face.apart }))
}

/// The share of a span that these pictures cover [0..1].
fn covered<'a>(frames: impl Iterator<Item = &'a Frame>, span: Span) -> f64 {
    let times: Vec<i64> = frames.map(|frame| frame.at_ns).collect();
    coverage(&times, span.begin_ns, span.end_ns)
}

fn mean(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let known = numbers.filter(|number| number.is_finite());
    let (count, sum) = known.fold((0_u32, 0.0), |(count, sum), number| (count + 1, sum + number));
    (count > 0).then(|| sum / f64::from(count))
}

/// Rises linearly from 0 to 1 between two numbers.
fn rise(number: f64, (from, to): (f64, f64)) -> f64 {
    ((number - from) / (to - from)).clamp(0.0, 1.0)
}
