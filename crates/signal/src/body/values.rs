//! The values of a span of body landmarks.

use super::Frame;
use crate::analysis::{Measured, Reason, Span, Value};
use crate::coverage::coverage;
use crate::points::{Stay, between, middle, speed, tilt};

/// The values of windows.
pub(super) static VALUES: [Value; 6] = [
    Value::new(
        "BODY_Movement",
        "1/s",
        "path of the midpoint between the shoulders (means of 0.25 s), in shoulder widths, over time",
    ),
    Value::new(
        "BODY_Hands",
        "1/s",
        "path of a wrist relative to the midpoint between the shoulders (means of 0.25 s), in shoulder widths, over time; mean of the wrists in view",
    ),
    Value::new(
        "BODY_Lean",
        "rad",
        "mean angle from vertical, in the picture, of the line from the midpoint between the hips to that between the shoulders, positive to the right",
    ),
    Value::new(
        "BODY_Shoulders",
        "rad",
        "mean tilt of the line between the shoulders, positive towards the right shoulder",
    ),
    Value::new(
        "BODY_HeadHeight",
        "1",
        "mean height of the nose above the midpoint between the shoulders, in shoulder widths",
    ),
    Value::new("BODY_Presence", "1", "share of pictures with both shoulders in view"),
];

/// The values of a span with these frames.
pub(super) fn measure(frames: &[Frame], span: Span) -> Measured {
    let times: Vec<i64> = frames.iter().map(|frame| frame.at_ns).collect();
    let coverage = coverage(&times, span.begin_ns, span.end_ns);
    if frames.is_empty() {
        return Measured::nothing(coverage, 0.0, VALUES.len(), Reason::Gap);
    }
    let presence =
        frames.iter().filter(|frame| width(frame) > 0.0).count() as f64 / frames.len() as f64;
    let missing = Reason::Missing;
    let is_there = presence > 0.0;
    let late = if is_there { Reason::Short } else { missing };
    let values = vec![
        movement(frames).ok_or(late),
        hands(frames).ok_or(missing),
        mean(frames.iter().map(lean)).ok_or(missing),
        mean(frames.iter().map(|frame| tilt(frame.shoulders))).ok_or(missing),
        mean(frames.iter().map(head_height)).ok_or(missing),
        Ok(presence),
    ];
    Measured { coverage, quality: presence, values }
}

fn width(frame: &Frame) -> f64 {
    between(frame.shoulders[0], frame.shoulders[1])
}

fn chest(frame: &Frame) -> [f64; 2] {
    middle(frame.shoulders[0], frame.shoulders[1])
}

fn movement(frames: &[Frame]) -> Option<f64> {
    speed(frames.iter().map(|frame| Stay {
        at_ns: frame.at_ns,
        place: chest(frame),
        unit: width(frame),
    }))
}

fn hands(frames: &[Frame]) -> Option<f64> {
    let of = |hand: usize| {
        speed(frames.iter().map(move |frame| {
            let [[x, y], [of_x, of_y]] = [frame.wrists[hand], chest(frame)];
            Stay { at_ns: frame.at_ns, place: [x - of_x, y - of_y], unit: width(frame) }
        }))
    };
    mean([0, 1].into_iter().filter_map(of))
}

/// The person's right is on the left of the picture, and y increases downwards.
fn lean(frame: &Frame) -> f64 {
    let [[x, y], [of_x, of_y]] = [chest(frame), middle(frame.hips[0], frame.hips[1])];
    (of_x - x).atan2(of_y - y)
}

fn head_height(frame: &Frame) -> f64 {
    let width = width(frame);
    if width > 0.0 { (chest(frame)[1] - frame.nose[1]) / width } else { f64::NAN }
}

fn mean(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let known = numbers.filter(|number| number.is_finite());
    let (count, sum) = known.fold((0_u32, 0.0), |(count, sum), number| (count + 1, sum + number));
    (count > 0).then(|| sum / f64::from(count))
}
