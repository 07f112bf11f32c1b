//! Notes on received streams that lack information which a useful recording needs.

use std::collections::{BTreeMap, BTreeSet};

use teampulse_core::counted::counted;
use teampulse_core::stream::{About, Shape, Stream};

/// Returns notes on the streams that were received.
pub fn notes<'a>(streams: impl Iterator<Item = &'a Stream> + Clone) -> Vec<String> {
    undefined(streams.clone()).chain(undescribed(streams)).collect()
}

/// Notes types without a definition, each with one of its topics.
fn undefined<'a>(streams: impl Iterator<Item = &'a Stream>) -> impl Iterator<Item = String> {
    let mut types = BTreeMap::<&str, BTreeSet<&str>>::new();
    for stream in streams {
        if let Shape::Message(schema) = &stream.shape
            && schema.text.is_empty()
        {
            types.entry(&schema.name).or_default().insert(&stream.name);
        }
    }
    types.into_iter().map(|(name, topics)| {
        let first = topics.first().copied().unwrap_or_default();
        let others = match topics.len() {
            1 => String::new(),
            count => format!(" and {}", counted(count as u64 - 1, "other", "others")),
        };
        format!(
            "{first}{others}: no definition of {name} was found, so it is recorded as bytes that other tools can't read; set `messages` in [session] to the folder with its definition"
        )
    })
}

/// Notes numeric streams of people that lack a description.
fn undescribed<'a>(streams: impl Iterator<Item = &'a Stream>) -> impl Iterator<Item = String> {
    let has_numbers = |stream: &&Stream| matches!(stream.shape, Shape::Sample | Shape::Wave);
    let is_blank = |stream: &&Stream| {
        stream.doc.is_empty() && stream.channels.iter().all(|channel| channel.unit.is_empty())
    };
    let of_people = streams.filter(|stream| stream.about == About::Person).filter(has_numbers);
    of_people.filter(is_blank).map(|stream| {
        format!(
            "{}: no description on /teampulse/streams, so its unit is unknown{}",
            stream.name,
            if stream.rate_hz > 0.0 { "" } else { ", as is its rate, and it is not analysed" }
        )
    })
}

/// Notes people and robots that have their own phases although the study has phases, too.
pub fn overruled(has_phases: bool, own: &BTreeMap<String, String>) -> Vec<String> {
    let lacks = own.iter().filter(|_| has_phases).map(|(id, stream)| {
        format!("phases of {id} are published on {stream} and replace the study's phases for {id}")
    });
    lacks.collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use teampulse_core::stream::{Schema, Subject};

    use super::*;

    fn message(name: &str, text: &str) -> Stream {
        let (schema, encoding) = ("own_msgs/msg/State".to_owned(), "ros2msg".to_owned());
        let schema = Schema { name: schema, encoding, text: text.into(), hash: String::new() };
        Stream::raw(name, Subject::robot("r1"), Shape::Message(Arc::new(schema)))
    }

    fn ecg(unit: &str) -> Stream {
        let subject = Subject { about: About::Person, id: "p001".into() };
        Stream::raw("/humans/persons/p001/own/ecg", subject, Shape::Wave)
            .with_channels(&[("ecg", unit)])
    }

    #[test]
    fn a_type_without_a_definition_is_named_once() {
        let streams = [message("/r1/a", ""), message("/r1/b", ""), message("/r1/c", "bool x")];
        let notes = notes(streams.iter());
        assert_eq!(notes.len(), 1, "{notes:?}");
        assert!(notes[0].starts_with("/r1/a and 1 other: no definition of own_msgs/msg/State"));
    }

    #[test]
    fn a_signal_of_a_person_without_a_description_is_named() {
        let said = notes([ecg("")].iter());
        assert!(said[0].ends_with("its unit is unknown, as is its rate, and it is not analysed"));
        let with_rate = Stream { rate_hz: 130.0, ..ecg("") };
        assert!(notes([with_rate].iter())[0].ends_with("its unit is unknown"));
        let described = [ecg("mV"), Stream { doc: "counts of an ADC".into(), ..ecg("") }];
        assert_eq!(notes(described.iter()), Vec::<String>::new());
    }

    #[test]
    fn phases_of_a_person_replace_the_study_s() {
        let own = BTreeMap::from([("p001".to_owned(), "/humans/persons/p001/task/events".into())]);
        assert_eq!(overruled(true, &own).len(), 1);
        assert_eq!(overruled(false, &own), Vec::<String>::new());
    }
}
