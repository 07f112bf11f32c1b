//! The measures of a session: names, sources and methods.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use serde::Serialize;
use teampulse_core::sample::Record;
use teampulse_core::stream::{About, Stream, StreamId, Window};

use super::meanings::meaning_of;

/// The name of a window's coverage among its values.
pub(super) const COVERAGE: &str = "coverage";
/// The name of a window's quality among its values.
pub(super) const QUALITY: &str = "quality";

/// The measures seen so far.
#[derive(Debug, Default)]
pub(super) struct Measures {
    by_name: BTreeMap<String, Measure>,
    seen: BTreeMap<StreamId, Arc<Stream>>,
    /// Whether there are changes since the last write.
    pub(super) is_news: bool,
}

/// The description of a measure in the terms of BIDS.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct Measure {
    description: String,
    units: Units,
    method: Methods,
}

/// The units of a measure: one, except for measures that apply to any signal.
#[derive(Clone, Debug, Default, PartialEq)]
struct Units(BTreeSet<String>);

/// The methods of a measure, each with the sources to which it applies.
#[derive(Clone, Debug, Default, PartialEq)]
struct Methods(BTreeMap<String, BTreeSet<String>>);

impl Measures {
    /// Takes the description of a stream of features.
    pub(super) fn take(&mut self, record: &Record) {
        let (id, stream) = (record.sample.stream, &record.stream);
        let is_known = |known: &Arc<Stream>| Arc::ptr_eq(known, stream) || **known == **stream;
        if self.seen.get(&id).is_some_and(is_known) {
            return;
        }
        self.seen.insert(id, Arc::clone(stream));
        self.is_news = true;
        let source = source_of(stream);
        if has_coverage(stream) {
            self.add(COVERAGE, "1", "", &source);
            self.add(QUALITY, "1", "", &source);
        }
        for (channel, method) in stream.channels.iter().zip(methods(stream)) {
            self.add(&channel.name, &channel.unit, method, &source);
        }
    }

    fn add(&mut self, name: &str, unit: &str, method: &str, source: &str) {
        let measure = self.by_name.entry(name.to_owned()).or_default();
        if measure.description.is_empty() {
            measure.description = meaning_of(name);
        }
        measure.units.0.insert(unit.to_owned());
        let method = if method.is_empty() { meaning_of(name) } else { method.to_owned() };
        measure.method.0.entry(method).or_default().insert(source.to_owned());
    }

    /// All measures by name.
    pub(super) fn all(&self) -> &BTreeMap<String, Measure> {
        &self.by_name
    }

    /// The meaning of a measure.
    pub(super) fn meaning_of(&self, name: &str) -> String {
        let known = self.by_name.get(name);
        known.map_or_else(|| meaning_of(name), |measure| measure.description.clone())
    }
}

impl Serialize for Units {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let units: Vec<&str> = self.0.iter().map(String::as_str).collect();
        serializer.serialize_str(&units.join(" or "))
    }
}

/// Serializes a single method as a text, and several methods as a map by source.
impl Serialize for Methods {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if let (1, Some((method, _))) = (self.0.len(), self.0.first_key_value()) {
            return serializer.serialize_str(method);
        }
        let sourced = self.0.iter().map(|(method, sources)| {
            let sources: Vec<&str> = sources.iter().map(String::as_str).collect();
            (sources.join(", "), method)
        });
        serializer.collect_map(sourced)
    }
}

/// Returns the input of a feature within its subject: `polar_h10/ecg`; for several inputs, the feature's own name
/// without the window.
pub(super) fn source_of(stream: &Stream) -> String {
    let name = stream.input().unwrap_or(stream.windowless_name());
    stream.subject().within(name).trim_start_matches('/').to_owned()
}

/// Whether the windows of a stream are phases.
pub(super) fn is_of_phases(stream: &Stream) -> bool {
    stream.window == Some(Window::Phases)
}

/// Whether a stream has the statistics of a raw signal.
pub(super) fn is_of_statistics(stream: &Stream) -> bool {
    stream.family == "statistics"
}

/// Whether the coverage and quality of a stream's windows describe a single signal.
pub(super) fn has_coverage(stream: &Stream) -> bool {
    stream.about == About::Person && stream.inputs.len() == 1 && !is_of_statistics(stream)
}

/// Returns the method of each value of a stream: the value's recipe if the method lists them (`name: recipe; name:
/// recipe`), otherwise the whole text.
pub(super) fn methods(stream: &Stream) -> Vec<&str> {
    let method = stream.method.as_str();
    let mut begins = Vec::new();
    let mut from = 0;
    for channel in &stream.channels {
        let mark = format!("; {}: ", channel.name);
        let Some(place) = method[from..].find(&mark) else { break };
        begins.push((from + place, from + place + mark.len()));
        from += place + mark.len() - 1;
    }
    if begins.len() < stream.channels.len() {
        return vec![method; stream.channels.len()];
    }
    let ends = begins.iter().skip(1).map(|(mark, _)| *mark).chain([method.len()]);
    begins.iter().zip(ends).map(|((_, begin), end)| &method[*begin..end]).collect()
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Shape, Subject};

    use super::*;

    fn heart() -> Stream {
        let subject = Subject { about: About::Person, id: "p001".into() };
        let ecg = Stream::raw("/humans/persons/p001/polar_h10/ecg", subject, Shape::Wave);
        let heart = Stream::derived(&ecg, "heart", Shape::Feature).over(Window::of_secs(30.0));
        let method = "causal, windows of 30 s; HRV_LF: Welch; Hann; HRV_HF: the same: 0.15 Hz";
        Stream { method: method.into(), ..heart }
            .with_channels(&[("HRV_LF", "ms^2"), ("HRV_HF", "ms^2")])
    }

    #[test]
    fn each_value_has_its_own_recipe() {
        assert_eq!(methods(&heart()), ["Welch; Hann", "the same: 0.15 Hz"]);
        let stated = Stream { method: "means; twice".into(), ..heart() };
        assert_eq!(methods(&stated), ["means; twice"; 2]);
    }

    #[test]
    fn a_source_is_named_within_its_subject() {
        assert_eq!(source_of(&heart()), "polar_h10/ecg");
        let name = "/humans/persons/p001/state/w30".to_owned();
        assert_eq!(source_of(&Stream { name, inputs: Vec::new(), ..heart() }), "state");
        let team = Stream::raw("/team/interventions", Subject::team(), Shape::Feature);
        let team = team.over(Window::of_secs(60.0));
        assert_eq!(source_of(&team), "team/interventions");
        let robot = Stream::raw("/robot1/deployment", Subject::robot("robot1"), Shape::Feature);
        assert_eq!(source_of(&robot), "deployment");
    }
}
