//! The values of a body in windows. Causal and whole analysis agree.

use std::collections::VecDeque;

use super::Frame;
use super::values::{VALUES, measure};
use crate::analysis::{Causal, Event, Measured, Recording, Span, Value, Whole, Windows};
use crate::error::SignalError;
use crate::points::Place;

/// A causal analysis of body landmarks in channels with these names, such as `right_shoulder_x`.
pub fn causal(names: &[&str]) -> Result<Box<dyn Causal + Send>, SignalError> {
    Ok(Box::new(Seen::new(names)?))
}

/// An analysis of a whole recording of body landmarks.
pub fn whole(names: &[&str], recording: &Recording<'_>) -> Result<Whole, SignalError> {
    let mut seen = Seen::new(names)?;
    let mut numbers = vec![f64::NAN; recording.channels.len()];
    for place in 0..recording.len() {
        numbers.iter_mut().zip(recording.channels).for_each(|(to, from)| *to = from[place]);
        seen.push(recording.time_ns(place as f64), &numbers);
    }
    Ok(Whole { events: Vec::new(), windows: Box::new(seen) })
}

struct Seen {
    points: Points,
    frames: VecDeque<Frame>,
}

/// The landmarks used; `None` where the model does not detect them.
struct Points {
    shoulders: [Place; 2],
    hips: [Option<Place>; 2],
    wrists: [Option<Place>; 2],
    nose: Option<Place>,
}

impl Seen {
    fn new(names: &[&str]) -> Result<Seen, SignalError> {
        let lacking = SignalError::Channels { lacking: "a shoulder, such as right_shoulder_x" };
        let pair = |point: &str| {
            ["right", "left"].map(|side| Place::of(&format!("{side}_{point}"), names))
        };
        let [Some(right), Some(left)] = pair("shoulder") else { return Err(lacking) };
        let points = Points {
            shoulders: [right, left],
            hips: pair("hip"),
            wrists: pair("wrist"),
            nose: Place::of("nose", names),
        };
        Ok(Seen { points, frames: VecDeque::new() })
    }
}

impl Windows for Seen {
    fn values(&self) -> &[Value] {
        &VALUES
    }

    fn measure(&self, span: Span) -> Measured {
        let first = self.frames.partition_point(|frame| frame.at_ns < span.begin_ns);
        let end = self.frames.partition_point(|frame| frame.at_ns < span.end_ns);
        let frames: Vec<Frame> = self.frames.range(first..end.max(first)).copied().collect();
        measure(&frames, span)
    }
}

impl Causal for Seen {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        let place = |place: Option<Place>| place.map_or([f64::NAN; 2], |place| place.at(channels));
        self.frames.push_back(Frame {
            at_ns,
            shoulders: self.points.shoulders.map(|shoulder| shoulder.at(channels)),
            hips: self.points.hips.map(place),
            wrists: self.points.wrists.map(place),
            nose: place(self.points.nose),
        });
    }

    fn next_event(&mut self) -> Option<Event> {
        None
    }

    fn forget(&mut self, before_ns: i64) {
        while self.frames.front().is_some_and(|frame| frame.at_ns < before_ns) {
            self.frames.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::Reason;

    const NAMES: [&str; 14] = [
        "right_shoulder_x",
        "right_shoulder_y",
        "left_shoulder_x",
        "left_shoulder_y",
        "right_hip_x",
        "right_hip_y",
        "left_hip_x",
        "left_hip_y",
        "nose_x",
        "nose_y",
        "left_wrist_x",
        "left_wrist_y",
        "left_wrist_score",
        "left_ear_score",
    ];
    const SPAN: Span = Span { begin_ns: 0, end_ns: 30_000_000_000 };

    /// A person with shoulders 100 px apart and hips 150 px below them, who leans to the right by 0.2 rad.
    fn leaning(secs: f64, sees_wrist: bool) -> Vec<f64> {
        let (sin, cos) = 0.2_f64.sin_cos();
        let moved = 50.0 * secs;
        let [x, y] = [300.0 - 150.0 * sin + moved, 300.0 - 150.0 * cos];
        let mut all = vec![x - 50.0, y, x + 50.0, y];
        all.extend([260.0 + moved, 300.0, 340.0 + moved, 300.0]);
        all.extend([x, y - 60.0]);
        all.extend([x + 80.0, y + 25.0 * secs, if sees_wrist { 0.9 } else { 0.1 }, 0.0]);
        all
    }

    fn measured(sees_wrist: bool) -> (Vec<Result<f64, Reason>>, f64) {
        let mut seen = causal(&NAMES).unwrap();
        for picture in 0..900 {
            let secs = f64::from(picture) / 30.0;
            seen.push((secs * 1e9) as i64, &leaning(secs, sees_wrist));
        }
        let measured = seen.measure(SPAN);
        (measured.values, measured.quality)
    }

    #[test]
    fn movement_and_posture_are_measured() {
        let (values, quality) = measured(true);
        // The body moves by half the shoulder width per second, and the hand by a quarter of it relative to the body.
        let expected = [0.5, 0.25, 0.2, 0.0, 0.6, 1.0];
        for ((value, expected), of) in values.into_iter().zip(expected).zip(&VALUES) {
            let value = value.unwrap();
            assert!((value - expected).abs() < 0.005, "{}: {value}, {expected}", of.name);
        }
        assert_eq!(quality, 1.0);
    }

    #[test]
    fn what_is_not_seen_is_missing() {
        let (values, _) = measured(false);
        assert_eq!(values[1], Err(Reason::Missing));
        assert!(values[0].is_ok() && values[2].is_ok());
        let error = causal(&["nose_x", "nose_y"]).err().unwrap();
        assert_eq!(
            error.to_string(),
            "none of the channels is a shoulder, such as right_shoulder_x"
        );
    }

    #[test]
    fn nobody_has_no_posture_but_a_presence_of_nothing() {
        let mut seen = causal(&NAMES).unwrap();
        for picture in 0..900_i64 {
            seen.push(picture * 33_000_000, &[f64::NAN; 14]);
        }
        let measured = seen.measure(SPAN);
        assert_eq!(measured.values[5], Ok(0.0));
        assert_eq!(measured.values[..5], [Err(Reason::Missing); 5]);
        assert_eq!(measured.quality, 0.0);
        assert_eq!(causal(&NAMES).unwrap().measure(SPAN).values, [Err(Reason::Gap); 6]);
    }

    #[test]
    fn a_whole_recording_agrees_and_what_is_past_is_forgotten() {
        let pictures: Vec<Vec<f64>> =
            (0..900).map(|picture| leaning(f64::from(picture) / 30.0, true)).collect();
        let channels: Vec<Vec<f64>> = (0..NAMES.len())
            .map(|channel| pictures.iter().map(|numbers| numbers[channel]).collect())
            .collect();
        let recording = Recording { channels: &channels, rate_hz: 30.0, begin_ns: 0 };
        let mut seen = causal(&NAMES).unwrap();
        for (place, numbers) in pictures.iter().enumerate() {
            seen.push(recording.time_ns(place as f64), numbers);
        }
        let whole = whole(&NAMES, &recording).unwrap();
        let written = |measured: Measured| format!("{measured:?}");
        assert_eq!(written(whole.windows.measure(SPAN)), written(seen.measure(SPAN)));
        seen.forget(SPAN.end_ns);
        assert_eq!(seen.measure(SPAN).values[0], Err(Reason::Gap));
    }
}
