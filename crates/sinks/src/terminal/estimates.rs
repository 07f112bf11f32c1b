//! Estimates about people; an experimenter who sees them is no longer blind.

use std::collections::BTreeMap;

use teampulse_core::data::FeatureValues;
use teampulse_core::stream::{About, Stream, Window};

/// The estimates shown, in order.
const SHOWN: [&str; 2] = ["workload", "arousal"];

/// The newest estimates about a person, by window length [ms]; only the shortest window is shown.
#[derive(Debug, Default)]
pub(super) struct Estimates(BTreeMap<u64, String>);

/// Whether a stream is an estimate of a person's workload or arousal. The difference from the person's own baseline,
/// from which it is estimated, is a measurement, like heart rate.
pub(super) fn unblinds(stream: &Stream) -> bool {
    stream.about == About::Person && stream.family == "estimates"
}

/// Whether a stream holds estimates about a person over windows.
pub(super) fn is_estimate(stream: &Stream) -> bool {
    let is_live = stream.window.is_some_and(|window| window != Window::Phases);
    stream.about == About::Person && stream.family == "estimates" && is_live
}

impl Estimates {
    /// Takes the newest estimates of a stream.
    pub(super) fn take(&mut self, stream: &Stream, values: &FeatureValues) {
        let shown = SHOWN.map(|name| {
            let place = stream.place_of(name);
            let number = |of: &[f64]| place.and_then(|place| of.get(place)).copied();
            let (value, sigma) = (number(&values.values), number(&values.sigmas));
            match value.filter(|value| value.is_finite()) {
                Some(value) => format!("{name} {value:.2} ±{:.2}", sigma.unwrap_or(f64::NAN)),
                None => format!("{name} ?"),
            }
        });
        self.0.insert((1e3 * values.window_secs) as u64, shown.join("  "));
    }

    /// The person's line: marked as estimates, with their window and the meaning of ±.
    pub(super) fn line(&self, id: &str) -> String {
        let Some((window_ms, shown)) = self.0.first_key_value() else { return id.to_owned() };
        let window_secs = *window_ms as f64 / 1e3;
        format!("{id}  estimates of {window_secs} s  {shown}  (± 1 sigma)")
    }
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Shape, Subject};

    use super::*;

    fn stream(family: &str, window: Window) -> Stream {
        let subject = Subject { about: About::Person, id: "p001".into() };
        let stream = Stream::concluded("/humans/persons/p001/x", subject, family, Shape::Feature);
        stream.over(window).with_channels(&[("workload", "1"), ("arousal", "1")])
    }

    #[test]
    fn estimates_unblind_and_measurements_do_not() {
        let w30 = Window::of_secs(30.0);
        let estimates = |window| stream("estimates", window);
        assert!(unblinds(&estimates(w30)) && unblinds(&estimates(Window::Phases)));
        assert!(!unblinds(&stream("heart", w30)) && !unblinds(&stream("state", w30)));
        assert!(is_estimate(&estimates(w30)) && !is_estimate(&estimates(Window::Phases)));
        assert!(!is_estimate(&stream("state", w30)));
    }

    #[test]
    fn an_estimate_stands_with_its_uncertainty_and_an_unknown_one_with_none() {
        let mut estimates = Estimates::default();
        let values = FeatureValues {
            window_secs: 30.0,
            coverage: 1.0,
            quality: 1.0,
            values: vec![0.523, f64::NAN],
            sigmas: vec![0.214, f64::NAN],
            reasons: Vec::new(),
        };
        estimates.take(&stream("estimates", Window::of_secs(30.0)), &values);
        let line = "p001  estimates of 30 s  workload 0.52 ±0.21  arousal ?  (± 1 sigma)";
        assert_eq!(estimates.line("p001"), line);
    }

    #[test]
    fn of_several_windows_the_shortest_is_shown_and_named() {
        let mut estimates = Estimates::default();
        for (window_secs, workload) in [(120.0, 0.9), (30.0, 0.4), (60.0, 0.7)] {
            let values = FeatureValues {
                window_secs,
                coverage: 1.0,
                quality: 1.0,
                values: vec![workload, 0.1],
                sigmas: vec![0.21, 0.21],
                reasons: Vec::new(),
            };
            estimates.take(&stream("estimates", Window::of_secs(window_secs)), &values);
        }
        let line = estimates.line("p001");
        assert!(line.contains("of 30 s  workload 0.40") && line.ends_with("(± 1 sigma)"), "{line}");
        assert!(line.chars().count() < 80, "{line}");
    }
}
