//! Any text, as a name, a label, the name of a file, and in messages of our own types: what comes in is
//! short and clean.
#![no_main]

use libfuzzer_sys::fuzz_target;
use teampulse_core::data::Data;
use teampulse_core::text::{LONGEST_LABEL, LONGEST_NAME, file_name, is_clean, label, name};
use teampulse_messages::convert::decode;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::teampulse_msgs::{Event, StreamDescription};

fuzz_target!(|input: (String, u8)| {
    let text = input.0.repeat(1 + usize::from(input.1) * 40);
    for cleaned in [name, label] {
        let once = cleaned(text.clone(), LONGEST_NAME);
        assert!(is_clean(&once, LONGEST_NAME));
        assert_eq!(cleaned(once.clone(), LONGEST_NAME), once);
    }
    let file = file_name(&text);
    assert!(file.len() <= 200 && !file.starts_with(['.', '-']) && !file.contains('/'));

    let event = Event { kind: "marker".into(), label: text.clone(), ..Default::default() };
    let decoded = decode(Event::NAME, &event.encode()).expect("it is whole");
    let Data::Event(event) = decoded.data else { panic!("an event is one") };
    assert!(is_clean(&event.label, LONGEST_LABEL));

    let description = StreamDescription {
        name: text.clone(),
        signal: "other".into(),
        channels: vec![text.clone(); 3],
        units: vec![text; 3],
        ..Default::default()
    };
    let decoded = decode(StreamDescription::NAME, &description.encode()).expect("it is whole");
    let Data::Description(stream) = decoded.data else { panic!("a description is one") };
    assert!(
        stream
            .channels
            .iter()
            .map(|each| &each.name)
            .chain([&stream.name])
            .all(|text| is_clean(text, LONGEST_NAME))
    );
});
