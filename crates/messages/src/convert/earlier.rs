//! Descriptions recorded by earlier versions, with one scale for all channels and without a stream's family
//! and window: the only place where a stream's name is parsed.

use teampulse_core::stream::{About, Origin, Schema, Shape, Stream, Window};

use super::DecodeError;
use crate::cdr::{CdrError, Reader};
use crate::definition::Definition;
use crate::standard::Message;
use crate::standard::teampulse_msgs::StreamDescription;

/// The stream of a recorded description, decoded with the definition in the recording.
pub fn description(schema: &Schema, cdr: &[u8]) -> Result<Stream, DecodeError> {
    let has = |definition: &Definition, field: &str| {
        definition.root().fields.iter().any(|each| each.name == field)
    };
    match Definition::of(schema) {
        Ok(definition) if !has(&definition, "scales") => {
            let has_family = has(&definition, "family");
            let stream = decode(cdr, has_family)?.stream()?;
            Ok(if has_family { stream } else { with_fields(stream) })
        }
        _ => StreamDescription::decode(cdr)?.stream(),
    }
}

/// Decodes a description in its earlier form, with a single scale.
fn decode(cdr: &[u8], has_family: bool) -> Result<StreamDescription, CdrError> {
    let mut from = Reader::new(cdr)?;
    let mut description = StreamDescription {
        header: from.read()?,
        name: from.read()?,
        r#type: from.read()?,
        signal: from.read()?,
        about: from.read()?,
        id: from.read()?,
        device: from.read()?,
        origin: from.read()?,
        inputs: from.read()?,
        method: from.read()?,
        channels: from.read()?,
        units: from.read()?,
        rate_hz: from.read()?,
        scales: vec![from.read()?],
        doc: from.read()?,
        ..StreamDescription::default()
    };
    if has_family {
        description.family = from.read()?;
        description.window_secs = from.read()?;
        description.beside = from.read()?;
    }
    let scale = description.scales[0];
    description.scales = vec![scale; description.channels.len()];
    Ok(description)
}

/// Adds the fields encoded in the stream's name: `<input>/<family>/<window>`, `<family>/events`, and
/// `<topic>/publisher_2` for the messages of a second publisher.
fn with_fields(mut stream: Stream) -> Stream {
    let is_raw = stream.origin == Origin::Raw;
    if let Some((topic, last)) = stream.name.rsplit_once('/') {
        if is_raw && stream.about == About::Person && is_numbered(last, "publisher_") {
            stream.beside = topic.to_owned();
        }
        let window = window(last).filter(|_| stream.shape == Shape::Feature);
        let is_below = window.is_some() || ["events", "refused", "faults"].contains(&last);
        let family = if is_below { topic.rsplit('/').next() } else { Some(last) };
        if !is_raw || window.is_some() {
            stream.family = family.unwrap_or_default().to_owned();
        }
        stream.window = window;
    }
    stream
}

/// The window in the last token of a name: `w30`, `w2_5`, `phases`.
fn window(word: &str) -> Option<Window> {
    if word == "phases" {
        return Some(Window::Phases);
    }
    let secs = word.strip_prefix('w')?.replace('_', ".").parse().ok()?;
    Some(Window::of_secs(secs)).filter(|window| window.to_string() == word)
}

fn is_numbered(word: &str, before: &str) -> bool {
    let number = word.strip_prefix(before).unwrap_or_default();
    !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::Subject;

    use super::*;

    fn named(name: &str, origin: Origin, shape: Shape) -> Stream {
        let person = Subject { about: About::Person, id: "p001".into() };
        with_fields(Stream { origin, ..Stream::raw(name, person, shape) })
    }

    #[test]
    fn what_a_name_says_becomes_fields() {
        for (name, shape, family, window) in [
            ("/p/ecg/heart/w30", Shape::Feature, "heart", Some(Window::of_secs(30.0))),
            ("/p/ecg/heart/w2_5", Shape::Feature, "heart", Some(Window::of_secs(2.5))),
            ("/p/ecg/heart/phases", Shape::Feature, "heart", Some(Window::Phases)),
            ("/p/ecg/beats", Shape::Event, "beats", None),
            ("/r1/deployment/events", Shape::Event, "deployment", None),
            ("/r1/deployment", Shape::Feature, "deployment", None),
        ] {
            let stream = named(name, Origin::Derived, shape);
            assert_eq!((&*stream.family, stream.window), (family, window), "{name}");
        }
        let raw = named("/p/strap/ecg", Origin::Raw, Shape::Wave);
        assert_eq!((&*raw.family, &*raw.beside), ("", ""));
    }

    #[test]
    fn what_stands_beside_a_person_s_topic_is_known_by_its_name() {
        let beside = |name: &str| named(name, Origin::Raw, Shape::Wave).beside;
        assert_eq!(beside("/p/strap/ecg/publisher_2"), "/p/strap/ecg");
        for other in ["/p/strap/ecg", "/p/strap/ecg/publisher_", "/p/strap/ecg/publisher_x"] {
            assert_eq!(beside(other), "");
        }
    }
}
