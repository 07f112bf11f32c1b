//! The values of an expression in windows. Causal and whole analysis agree.

use std::collections::VecDeque;

use crate::analysis::{
    Causal, Event, LEAST_COVERAGE, Measured, Reason, Recording, Span, Value, Whole, Windows,
};
use crate::coverage::coverage;
use crate::error::SignalError;

/// Channels that are not classes.
const DIMENSIONS: [&str; 3] = ["valence", "arousal", "dominance"];
/// How far the sum of probabilities may be from 1.
const SUM_WITHIN: f64 = 0.02;

/// A causal analysis of estimates in channels with these names: one per class, or valence, arousal and
/// dominance.
pub fn causal(names: &[&str]) -> Result<Box<dyn Causal + Send>, SignalError> {
    Ok(Box::new(Estimates::new(names)?))
}

/// An analysis of a whole recording of estimates.
pub fn whole(names: &[&str], recording: &Recording<'_>) -> Result<Whole, SignalError> {
    let mut estimates = Estimates::new(names)?;
    let mut numbers = vec![f64::NAN; recording.channels.len()];
    for place in 0..recording.len() {
        numbers.iter_mut().zip(recording.channels).for_each(|(to, from)| *to = from[place]);
        estimates.push(recording.time_ns(place as f64), &numbers);
    }
    Ok(Whole { events: Vec::new(), windows: Box::new(estimates) })
}

struct Estimates {
    values: Vec<Value>,
    /// Whether each channel is a class.
    is_class: Vec<bool>,
    frames: VecDeque<(i64, Vec<f64>)>,
}

impl Estimates {
    fn new(names: &[&str]) -> Result<Estimates, SignalError> {
        if names.is_empty() {
            return Err(SignalError::Channels { lacking: "an expression" });
        }
        let is_class = |name: &&str| !DIMENSIONS.contains(&name.to_lowercase().as_str());
        Ok(Estimates {
            values: values(names),
            is_class: names.iter().map(is_class).collect(),
            frames: VecDeque::new(),
        })
    }

    /// The confidence of the model [0..1]: 0 if all classes are equally probable, 1 if one is certain.
    /// `None` without classes, or if their numbers are not probabilities.
    fn confidence(&self, numbers: &[f64]) -> Option<f64> {
        let classes: Vec<f64> = numbers
            .iter()
            .zip(&self.is_class)
            .filter_map(|(number, is_class)| is_class.then_some(*number))
            .collect();
        let sum: f64 = classes.iter().sum();
        let is_probability =
            (sum - 1.0).abs() <= SUM_WITHIN && classes.iter().all(|each| *each >= 0.0);
        let even = 1.0 / classes.len() as f64;
        let highest = classes.iter().copied().fold(0.0, f64::max);
        (is_probability && classes.len() > 1)
            .then(|| ((highest - even) / (1.0 - even)).clamp(0.0, 1.0))
    }
}

fn values(names: &[&str]) -> Vec<Value> {
    let mut values = vec![
        Value::new(
            "EXPRESSION_Confidence",
            "1",
            "mean confidence of the model: its highest probability, scaled from 0 for equally probable classes to 1 for a certain one; not a probability of being right",
        ),
        Value::new("EXPRESSION_Presence", "1", "share of pictures with an estimate"),
    ];
    for name in names {
        values.push(Value::of_channel(
            "EXPRESSION_Mean",
            name,
            "1",
            "mean of the model's estimates of what the face shows, not of what the person feels",
        ));
        values.push(Value::of_channel(
            "EXPRESSION_SD",
            name,
            "1",
            "standard deviation of the estimates",
        ));
    }
    values
}

impl Windows for Estimates {
    fn values(&self) -> &[Value] {
        &self.values
    }

    fn measure(&self, span: Span) -> Measured {
        let first = self.frames.partition_point(|(at_ns, _)| *at_ns < span.begin_ns);
        let end = self.frames.partition_point(|(at_ns, _)| *at_ns < span.end_ns);
        let frames: Vec<&(i64, Vec<f64>)> = self.frames.range(first..end.max(first)).collect();
        let times: Vec<i64> = frames.iter().map(|(at_ns, _)| *at_ns).collect();
        let coverage = coverage(&times, span.begin_ns, span.end_ns);
        if frames.is_empty() || coverage < LEAST_COVERAGE {
            return Measured::nothing(coverage, 0.0, self.values.len(), Reason::Gap);
        }
        let seen: Vec<&[f64]> = frames
            .iter()
            .map(|(_, numbers)| numbers.as_slice())
            .filter(|numbers| numbers.iter().all(|number| number.is_finite()))
            .collect();
        let presence = seen.len() as f64 / frames.len() as f64;
        let sure: Vec<f64> = seen.iter().filter_map(|numbers| self.confidence(numbers)).collect();
        let confidence = mean_and_sd(&sure).map(|(mean, _)| mean);
        let mut values = Vec::with_capacity(self.values.len());
        values.extend([confidence.ok_or(Reason::Missing), Ok(presence)]);
        for channel in 0..self.is_class.len() {
            let numbers: Vec<f64> =
                seen.iter().filter_map(|numbers| numbers.get(channel).copied()).collect();
            let [mean, sd] = match mean_and_sd(&numbers) {
                Some((mean, sd)) => [Ok(mean), sd.ok_or(Reason::Short)],
                None => [Err(Reason::Missing); 2],
            };
            values.extend([mean, sd]);
        }
        Measured { coverage, quality: presence * confidence.unwrap_or(1.0), values }
    }
}

impl Causal for Estimates {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        self.frames.push_back((at_ns, channels.to_vec()));
    }

    fn next_event(&mut self) -> Option<Event> {
        None
    }

    fn forget(&mut self, before_ns: i64) {
        while self.frames.front().is_some_and(|(at_ns, _)| *at_ns < before_ns) {
            self.frames.pop_front();
        }
    }
}

/// The mean, and the standard deviation for two or more values.
fn mean_and_sd(numbers: &[f64]) -> Option<(f64, Option<f64>)> {
    let count = numbers.len() as f64;
    let mean = numbers.iter().sum::<f64>() / count;
    let squares: f64 = numbers.iter().map(|number| (number - mean).powi(2)).sum();
    (!numbers.is_empty())
        .then(|| (mean, (numbers.len() > 1).then(|| (squares / (count - 1.0)).sqrt())))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPAN: Span = Span { begin_ns: 0, end_ns: 10_000_000_000 };
    const NAMES: [&str; 4] = ["happy", "neutral", "sad", "valence"];

    fn measured(names: &[&str], picture: impl Fn(usize) -> Vec<f64>) -> Measured {
        let mut estimates = causal(names).unwrap();
        (0..100).for_each(|place| estimates.push(place as i64 * 100_000_000, &picture(place)));
        estimates.measure(SPAN)
    }

    #[test]
    fn means_spreads_and_the_confidence_are_those_of_the_estimates() {
        let measured = measured(&NAMES, |place| {
            let happy = if place % 2 == 0 { 0.75 } else { 0.25 };
            vec![happy, 1.0 - happy, 0.0, 2.0 * happy - 1.0]
        });
        let values: Vec<f64> = measured.values.iter().map(|value| value.unwrap()).collect();
        let sd = 0.25 * (100.0_f64 / 99.0).sqrt();
        let expected = [0.625, 1.0, 0.5, sd, 0.5, sd, 0.0, 0.0, 0.0, 2.0 * sd];
        for (value, expected) in values.iter().zip(expected) {
            assert!((value - expected).abs() < 1e-12, "{values:?}");
        }
        assert!((measured.quality - 0.625).abs() < 1e-12);
    }

    #[test]
    fn a_model_that_knows_nothing_has_no_quality() {
        let measured = measured(&NAMES[..3], |_| vec![1.0 / 3.0; 3]);
        assert!(measured.values[0].unwrap() < 1e-12 && measured.quality < 1e-12);
    }

    #[test]
    fn pictures_without_a_face_are_in_no_mean() {
        let measured = measured(&NAMES[..3], |place| {
            if place % 4 == 0 { vec![f64::NAN; 3] } else { vec![1.0, 0.0, 0.0] }
        });
        assert_eq!(measured.values[..4], [Ok(1.0), Ok(0.75), Ok(1.0), Ok(0.0)]);
        assert_eq!(measured.quality, 0.75);
    }

    #[test]
    fn what_is_no_probability_has_no_confidence() {
        let measured = measured(&["valence", "arousal"], |_| vec![0.5, -0.5]);
        assert_eq!(measured.values[0], Err(Reason::Missing));
        assert_eq!((measured.values[2], measured.quality), (Ok(0.5), 1.0));
    }

    #[test]
    fn nobody_in_view_is_not_the_same_as_no_pictures() {
        let nobody = measured(&NAMES, |_| vec![f64::NAN; 4]);
        assert_eq!(nobody.values[..3], [Err(Reason::Missing), Ok(0.0), Err(Reason::Missing)]);
        let nothing = causal(&NAMES).unwrap().measure(SPAN);
        assert_eq!(nothing.values, [Err(Reason::Gap); 10]);
        assert!(causal(&[]).is_err());
    }

    #[test]
    fn a_whole_recording_agrees_and_what_is_past_is_forgotten() {
        let channels: Vec<Vec<f64>> = [0.2, 0.8].map(|level| vec![level; 100]).to_vec();
        let recording = Recording { channels: &channels, rate_hz: 10.0, begin_ns: 0 };
        let names = ["happy", "sad"];
        let mut estimates = causal(&names).unwrap();
        for place in 0..100 {
            estimates.push(recording.time_ns(f64::from(place)), &[0.2, 0.8]);
        }
        let whole = whole(&names, &recording).unwrap();
        assert_eq!(whole.windows.measure(SPAN), estimates.measure(SPAN));
        estimates.forget(SPAN.end_ns);
        assert_eq!(estimates.measure(SPAN).values[0], Err(Reason::Gap));
    }
}
