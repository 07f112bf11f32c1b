//! Privacy on ROS: nothing is published about people whose streams are not published.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use bytes::Bytes;
use teampulse_core::data::Data;
use teampulse_core::sample::{Record, Sample};
use teampulse_core::status::StreamStatus;
use teampulse_core::stream::{About, Stream};
use teampulse_core::streams::Streams;
use teampulse_messages::convert;

use crate::sink::Publish;

/// Keeps the ids of people and the states of their sensors out of topics that are not about a person. A status is
/// withheld if its stream is not published. An event, or a description by its texts, is withheld if it names such a
/// stream, or a person none of whose streams is published. Such streams are also removed from the inputs in descriptions.
#[derive(Debug)]
pub(crate) struct PrivacyFilter {
    publish: Publish,
    /// The number of streams processed.
    seen: usize,
    /// The names of people's streams that are not published.
    hidden: BTreeSet<String>,
    /// Whether any stream of a person is published, by the person's id.
    people: BTreeMap<String, bool>,
}

impl PrivacyFilter {
    pub(crate) fn new(publish: Publish) -> PrivacyFilter {
        PrivacyFilter { publish, seen: 0, hidden: BTreeSet::new(), people: BTreeMap::new() }
    }

    /// Takes in the streams declared since the last call.
    pub(crate) fn learn(&mut self, streams: &Streams) {
        for (_, stream) in streams.after(self.seen) {
            self.seen += 1;
            if stream.about == About::Person {
                let is_published = self.publish.includes(&stream);
                *self.people.entry(stream.id.clone()).or_default() |= is_published;
                if !is_published {
                    self.hidden.insert(stream.name.clone());
                }
            }
        }
    }

    /// The part of a record that may be published; `None` if nothing may.
    pub(crate) fn censor<'a>(&self, record: &'a Record) -> Option<Cow<'a, Bytes>> {
        let may_pass = match &record.sample.data {
            _ if record.stream.about == About::Person => true,
            Data::Status(status) => self.publishes_health_of(status),
            Data::Event(event) => !self.is_named_in(&event.label),
            Data::Description(stream) => return self.censor_description(record, stream),
            _ => true,
        };
        may_pass.then_some(Cow::Borrowed(&record.cdr))
    }

    /// Whether the health of a stream may be published.
    pub(crate) fn publishes_health_of(&self, status: &StreamStatus) -> bool {
        !self.hidden.contains(status.topic())
    }

    /// Drops descriptions of hidden streams, and removes hidden streams from the inputs of others.
    fn censor_description<'a>(
        &self,
        record: &'a Record,
        stream: &Arc<Stream>,
    ) -> Option<Cow<'a, Bytes>> {
        let texts = [&stream.doc, &stream.method];
        let is_hidden = self.hidden.contains(&stream.name)
            || stream.about == About::Person && !self.publish.includes(stream);
        if is_hidden || texts.into_iter().any(|text| self.is_named_in(text)) {
            return None;
        }
        if !stream.inputs.iter().any(|input| self.hidden.contains(input)) {
            return Some(Cow::Borrowed(&record.cdr));
        }
        let mut visible = Stream::clone(stream);
        visible.inputs.retain(|input| !self.hidden.contains(input));
        let data = Data::Description(Arc::new(visible));
        Some(Cow::Owned(convert::encode(&Sample { data, ..record.sample.clone() })))
    }

    /// Whether a text names a hidden stream, or a person without published streams.
    fn is_named_in(&self, text: &str) -> bool {
        let is_secret = |word: &str| self.people.get(word) == Some(&false);
        let mut words = text.split(|each: char| !(each.is_alphanumeric() || each == '_'));
        words.any(is_secret) || self.hidden.iter().any(|name| text.contains(name.as_str()))
    }
}

#[cfg(test)]
mod tests {
    use teampulse_core::data::{Event, EventKind};
    use teampulse_core::pattern::Pattern;
    use teampulse_core::sample::Turn;
    use teampulse_core::status::{State, StreamStatus};
    use teampulse_core::stream::{Shape, Subject};
    use teampulse_core::time::Time;

    use super::*;

    const ECG: &str = "/humans/persons/p001/strap/ecg";

    fn ecg() -> Stream {
        Stream::raw(ECG, Subject { about: About::Person, id: "p001".into() }, Shape::Wave)
    }

    /// A filter for a person's ECG, with the given published streams.
    fn privacy(published: &[&str]) -> PrivacyFilter {
        let streams = Streams::default();
        streams.declare(ecg());
        streams.declare(Stream::raw("/r1/load", Subject::robot("r1"), Shape::Sample));
        let published = published.iter().map(|name| Pattern::parse(name).unwrap()).collect();
        let mut privacy = PrivacyFilter::new(Publish::Conclusions(published));
        privacy.learn(&streams);
        privacy
    }

    fn record(data: Data) -> Record {
        let at = Time::from_stamp(7, 0);
        let sample = Sample {
            stream: teampulse_core::stream::StreamId(0),
            measured: at,
            log_time: at,
            device_time: None,
            source_time: None,
            period_ns: 0.0,
            index: 0,
            turn: Turn::OnTime,
            data,
        };
        let stream = Stream::raw("/teampulse/x", Subject::session(), Shape::Event);
        Record { stream: Arc::new(stream), cdr: convert::encode(&sample), sample }
    }

    fn event(label: &str) -> Record {
        let (kind, label) = (EventKind::Clock, label.to_owned());
        record(Data::Event(Arc::new(Event { kind, label, value: f64::NAN, duration_secs: 0.0 })))
    }

    fn status(name: &str) -> Record {
        record(Data::Status(Arc::new(StreamStatus {
            name: name.into(),
            state: State::Ok,
            reason: String::new(),
            rate_hz: 1.0,
            age_secs: 0.0,
            received: 1,
            lost_source: None,
            lost_queue: 0,
            late: 0,
            duplicates: 0,
            clock: 0,
            epoch: 0,
            offset_secs: 0.0,
            skew_ppm: 0.0,
            jitter_secs: 0.0,
            sigma_secs: 0.0,
            latency_secs: 0.0,
        })))
    }

    #[test]
    fn who_is_not_published_is_in_no_status_event_or_description() {
        let privacy = privacy(&[]);
        let described = record(Data::Description(Arc::new(ecg())));
        let clock = event("strap of p001 restarted");
        for secret in [status(ECG), described, clock, event(&format!("{ECG}: failed to open"))] {
            assert_eq!(privacy.censor(&secret), None, "{:?}", secret.sample.data);
        }
        for open in [status("/r1/load"), event("power of r1 restarted"), event("p0012")] {
            assert_eq!(privacy.censor(&open).as_deref(), Some(&open.cdr));
        }
    }

    #[test]
    fn who_is_published_may_be_named() {
        let privacy = privacy(&[ECG]);
        for open in [status(ECG), event("strap of p001 restarted"), event(ECG)] {
            assert_eq!(privacy.censor(&open).as_deref(), Some(&open.cdr));
        }
    }

    #[test]
    fn what_was_computed_of_a_person_and_others_is_described_without_that_person() {
        let team = Stream::raw("/team/state", Subject::team(), Shape::Feature);
        let inputs = vec![ECG.to_owned(), "/r1/load".to_owned()];
        let described = record(Data::Description(Arc::new(Stream { inputs, ..team.clone() })));
        let without = Stream { inputs: vec!["/r1/load".to_owned()], ..team };
        let expected = record(Data::Description(Arc::new(without)));
        assert_eq!(privacy(&[]).censor(&described).as_deref(), Some(&expected.cdr));
        assert_eq!(privacy(&[ECG]).censor(&described).as_deref(), Some(&described.cdr));
    }
}
