//! Long, odd and many texts in messages of our own types: decoded texts are short and clean, or the message is refused.

use proptest::prelude::*;
use teampulse_core::data::Data;
use teampulse_core::text::{LONGEST_LABEL, LONGEST_NAME, LONGEST_PROSE, is_clean, longest_method};
use teampulse_messages::convert::{DecodeError, MOST_CHANNELS, decode};
use teampulse_messages::standard::Message;
use teampulse_messages::standard::teampulse_msgs as msgs;

fn description(text: &str, channels: usize) -> msgs::StreamDescription {
    let text = || text.to_owned();
    msgs::StreamDescription {
        name: text(),
        r#type: text(),
        signal: "other".into(),
        id: text(),
        device: text(),
        inputs: vec![text()],
        method: text(),
        channels: vec![text(); channels],
        units: vec![text(); channels],
        doc: text(),
        ..Default::default()
    }
}

/// A hundred thousand characters, many of which do not belong in a line.
fn long_texts() -> impl Strategy<Value = String> {
    let odd =
        prop::sample::select(vec!['\u{1b}', '\r', '\n', '\0', '\u{9b}', '\u{202e}', '\u{2069}']);
    let piece = prop::collection::vec(prop_oneof![any::<char>(), odd], 1..50);
    piece.prop_map(|piece| piece.iter().cycle().take(100_000).collect())
}

fn decoded(name: &str, cdr: &[u8]) -> Data {
    decode(name, cdr).expect("it is whole").data
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn every_text_that_is_decoded_is_short_and_clean(text in long_texts()) {
        let event = msgs::Event { kind: "marker".into(), label: text.clone(), ..Default::default() };
        let Data::Event(event) = decoded(msgs::Event::NAME, &event.encode()) else { panic!() };
        prop_assert!(is_clean(&event.label, LONGEST_LABEL));

        let status =
            msgs::StreamStatus { name: text.clone(), reason: text.clone(), ..Default::default() };
        let Data::Status(status) = decoded(msgs::StreamStatus::NAME, &status.encode()) else { panic!() };
        prop_assert!(is_clean(&status.name, 2 * LONGEST_NAME));
        prop_assert!(is_clean(&status.reason, LONGEST_LABEL));

        let cdr = description(&text, 2).encode();
        let Data::Description(stream) = decoded(msgs::StreamDescription::NAME, &cdr) else { panic!() };
        let names = [&stream.name, &stream.id, &stream.device].into_iter();
        let names = names.chain(stream.channels.iter().flat_map(|each| [&each.name, &each.unit])).chain(&stream.inputs);
        for name in names {
            prop_assert!(is_clean(name, LONGEST_NAME), "{name:?}");
        }
        let longest = longest_method(stream.channels.len());
        prop_assert!(is_clean(&stream.method, longest) && is_clean(&stream.doc, LONGEST_PROSE));

        let wrong = msgs::Event { kind: text, ..Default::default() };
        let error = decode(msgs::Event::NAME, &wrong.encode()).unwrap_err().to_string();
        prop_assert!(is_clean(&error, LONGEST_LABEL), "{error:?}");
    }
}

#[test]
fn a_stream_with_a_million_channels_is_refused() {
    let refused = |description: msgs::StreamDescription| {
        let decoded = decode(msgs::StreamDescription::NAME, &description.encode());
        matches!(decoded, Err(DecodeError::Length { field: "channels", .. }))
    };
    assert!(refused(description("x", 1_000_000)));
    assert!(refused(description("x", MOST_CHANNELS + 1)));
    assert!(!refused(description("x", MOST_CHANNELS)));
    // The statistics of a stream with as many as there can be.
    let derived = |channels| msgs::StreamDescription { origin: 1, ..description("x", channels) };
    assert!(!refused(derived(14 * MOST_CHANNELS)));
    assert!(refused(derived(20 * MOST_CHANNELS)));
}

#[test]
fn a_message_larger_than_any_device_sends_is_refused() {
    let samples =
        |count| msgs::Wave { channels: 1, samples: vec![0.0; count], ..Default::default() };
    assert!(decode(msgs::Wave::NAME, &samples(2_000_000).encode()).is_ok());
    let refused = decode(msgs::Wave::NAME, &samples(2_100_000).encode());
    assert!(matches!(refused, Err(DecodeError::Large(_))));
}
