use teampulse_core::text::LONGEST_NAME;
use teampulse_core::time::Time;

use crate::cdr::Reader;
use crate::definition::{Count, Definition, Kind};
use crate::standard::{Message, std_msgs::Header};

/// The time in messages of `foxglove_msgs`: their first field, where other messages have the stamp of their header.
const TIMESTAMP: (&str, &str) = ("timestamp", "builtin_interfaces/msg/Time");

/// Whether messages of a type start with a `std_msgs/Header`, and so with a stamp; or with a `timestamp`, as in
/// `foxglove_msgs`.
pub fn starts_with_header(definition: &Definition) -> bool {
    definition.root().fields.first().is_some_and(|first| match &first.kind {
        Kind::Struct(nested) => {
            let is_stamp = (first.name.as_str(), nested.name.as_str()) == TIMESTAMP;
            (nested.name == Header::NAME || is_stamp) && first.count == Count::One
        }
        _ => false,
    })
}

/// The stamp of a message whose type [starts with a header](starts_with_header); `None` if the message is
/// too short or the stamp is zero.
pub fn header_stamp(cdr: &[u8]) -> Option<Time> {
    let stamp = Reader::new(cdr).and_then(|mut from| from.read::<Time>());
    stamp.ok().filter(|stamp| *stamp != Time::EPOCH)
}

/// The frame of a message whose type [starts with a header](starts_with_header), without a leading slash; `None` if the
/// message states none, or can't be read.
pub fn header_frame(cdr: &[u8]) -> Option<&str> {
    let mut from = Reader::new(cdr).ok()?;
    from.read::<Time>().ok()?;
    let frame = std::str::from_utf8(from.text().ok()?).ok()?.trim_start_matches('/');
    (1..=LONGEST_NAME).contains(&frame.len()).then_some(frame)
}
