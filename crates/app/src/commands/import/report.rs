//! Summarises the imported data on one screen.

use teampulse_bag::{Bag, BagStream};
use teampulse_core::counted::counted;
use teampulse_core::stream::{About, Shape, Signal};
use teampulse_messages::convert::type_name;

use crate::commands::info::damage;

/// The most topics listed: those with the most messages.
const MOST_TOPICS: usize = 16;

/// Describes the contents of a ROS recording.
pub fn of_bag(bag: &Bag) -> Vec<String> {
    let (first, last) = bag.bounds().unwrap_or_default();
    let (messages, topics) = (bag.messages_count(), bag.streams().len());
    let mut lines = vec![format!(
        "{}: {} on {}, {:.1} s from {first}",
        bag.path().display(),
        counted(messages, "message", "messages"),
        counted(topics, "topic", "topics"),
        last.secs_since(first)
    )];
    let mut streams: Vec<&BagStream> = bag.streams().iter().collect();
    streams.sort_by_key(|known| (std::cmp::Reverse(known.messages), known.stream.name.clone()));
    lines.extend(streams.iter().take(MOST_TOPICS).map(|known| topic(known)));
    if topics > MOST_TOPICS {
        lines.push(format!(
            "  and {} with fewer messages",
            counted(topics - MOST_TOPICS, "topic", "topics")
        ));
    }
    let undefined = streams.iter().filter(|known| is_undefined(known)).count();
    if undefined > 0 {
        lines.push(format!(
            "note: {undefined} of them have no definition of their type and are kept as bytes"
        ));
    }
    lines.extend(damage(bag).into_iter().map(|each| format!("damaged: {each}")));
    lines
}

fn is_undefined(known: &BagStream) -> bool {
    matches!(&known.stream.shape, Shape::Message(schema) if schema.text.is_empty())
}

fn topic(known: &BagStream) -> String {
    let stream = &known.stream;
    let (name, kind) = (&stream.name, type_name(&stream.shape));
    let line = format!("  {name:<36} {kind:<34} {:>8}", known.messages);
    if stream.about == About::Robot && stream.signal != Signal::Other {
        return format!("{line}  {} of {}", stream.signal, stream.id);
    }
    line
}
