//! Estimates about people: who sees them during an experiment is no longer blind.

use std::collections::BTreeMap;

use teampulse_core::data::FeatureValues;
use teampulse_core::stream::{About, Stream};

/// The estimates that are shown, in their order.
const SHOWN: [&str; 2] = ["workload", "arousal"];

/// The newest estimates about a person, by stream: the windows of the first are shown.
#[derive(Debug, Default)]
pub(super) struct Estimates(BTreeMap<String, String>);

/// Whether a stream tells how somebody is compared with a baseline, or what is estimated from that.
pub(super) fn unblinds(stream: &Stream) -> bool {
    stream.about == About::Person && matches!(family(stream), Some("state" | "estimates"))
}

/// Whether it tells estimates over windows.
pub(super) fn is_estimate(stream: &Stream) -> bool {
    let is_live = !stream.name.ends_with("/phases");
    stream.about == About::Person && family(stream) == Some("estimates") && is_live
}

fn family(stream: &Stream) -> Option<&str> {
    stream.name.rsplit('/').nth(1)
}

impl Estimates {
    /// Takes the newest estimates of a stream.
    pub(super) fn take(&mut self, stream: &Stream, values: &FeatureValues) {
        let shown = SHOWN.map(|name| {
            let place = stream.channels.iter().position(|channel| channel == name);
            let number = |of: &[f64]| place.and_then(|place| of.get(place)).copied();
            let (value, sigma) = (number(&values.values), number(&values.sigmas));
            match value.filter(|value| value.is_finite()) {
                Some(value) => format!("{name} {value:.2} ±{:.2}", sigma.unwrap_or(f64::NAN)),
                None => format!("{name} ?"),
            }
        });
        self.0.insert(stream.name.clone(), shown.join("  "));
    }

    /// The person's line: as estimates they are marked.
    pub(super) fn line(&self, id: &str) -> String {
        let shown = self.0.values().next().map_or("", String::as_str);
        format!("{id}  estimated {shown}")
    }
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Shape, Subject};

    use super::*;

    fn stream(name: &str) -> Stream {
        let subject = Subject { about: About::Person, id: "p001".into() };
        let stream = Stream::raw(format!("/humans/persons/p001/{name}"), subject, Shape::Feature);
        stream.with_channels(&[("workload", "1"), ("arousal", "1")])
    }

    #[test]
    fn states_and_estimates_unblind_and_features_do_not() {
        assert!(unblinds(&stream("state/w30")) && unblinds(&stream("estimates/phases")));
        assert!(!unblinds(&stream("strap/ecg/heart/w30")));
        assert!(is_estimate(&stream("estimates/w30")) && !is_estimate(&stream("estimates/phases")));
        assert!(!is_estimate(&stream("state/w30")));
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
        estimates.take(&stream("estimates/w30"), &values);
        assert_eq!(estimates.line("p001"), "p001  estimated workload 0.52 ±0.21  arousal ?");
    }
}
