//! The connections of a ROS 1 bag: publishers of topics, each with its type and its definition.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::rc::Rc;

use mcap::{McapError, Writer};
use teampulse_core::counted::counted;
use teampulse_core::qos::Qos;
use teampulse_messages::ros1::Ros1Type;

use super::records::Fields;
use crate::metadata::{Version, qos};

/// The most topics that are listed when some of their messages can't be converted.
const MOST_LISTED: usize = 5;

/// A connection, and how many of its messages could not be converted.
pub(super) struct Connection {
    topic: String,
    /// The connection's channel and type, or why its definition can't be read.
    pub kind: Result<(u16, Rc<Ros1Type>), String>,
    unconverted_count: u64,
    /// Why the first unconverted message could not be converted.
    reason: String,
}

impl Connection {
    /// Counts a message that could not be converted.
    pub fn missed(&mut self, reason: &dyn ToString) {
        if self.unconverted_count == 0 {
            self.reason = reason.to_string();
        }
        self.unconverted_count += 1;
    }
}

/// The connections read so far, by their numbers.
#[derive(Default)]
pub(super) struct Connections {
    known: BTreeMap<u32, Connection>,
    /// Types by name and definition, as many connections have the same type.
    types: BTreeMap<(String, String), Result<Rc<Ros1Type>, String>>,
}

impl Connections {
    /// Adds the connection of a record; a repeated record is skipped.
    pub fn add(&mut self, fields: Fields<'_>, data: &[u8], out: &mut Out) -> Result<(), McapError> {
        let (Some(number), Some(topic)) = (fields.number("conn"), fields.text("topic")) else {
            return Ok(());
        };
        if self.known.contains_key(&number) {
            return Ok(());
        }
        let topic = if topic.starts_with('/') { topic } else { format!("/{topic}") };
        let data = Fields::new(data);
        let name = data.text("type").unwrap_or_default();
        let text = data.text("message_definition").unwrap_or_default();
        let parse = |(name, text): &(String, String)| {
            Ros1Type::parse(name, text).map(Rc::new).map_err(|error| error.to_string())
        };
        let key = (name, text);
        let kind = self.types.entry(key.clone()).or_insert_with(|| parse(&key)).clone();
        let kind = match kind {
            Ok(kind) => {
                Ok((channel(&topic, &kind, data.get("latching") == Some(b"1"), out)?, kind))
            }
            Err(reason) => Err(reason),
        };
        let connection = Connection { topic, kind, unconverted_count: 0, reason: String::new() };
        self.known.insert(number, connection);
        Ok(())
    }

    pub fn get(&mut self, number: u32) -> Option<&mut Connection> {
        self.known.get_mut(&number)
    }

    /// Describes the messages that could not be converted, by topic.
    pub fn damage(&self) -> Vec<String> {
        let missed = self.known.values().filter(|each| each.unconverted_count > 0);
        let missed: Vec<String> = missed
            .map(|each| {
                let Connection { topic, unconverted_count: count, reason, .. } = each;
                let messages = counted(*count, "message", "messages");
                format!("{messages} of {topic} can't be converted: failed to {reason}")
            })
            .collect();
        let others = missed.len().saturating_sub(MOST_LISTED);
        let others = (others > 0).then(|| {
            format!("nor can messages of {}", counted(others, "other topic", "other topics"))
        });
        missed.into_iter().take(MOST_LISTED).chain(others).collect()
    }
}

/// Adds the channel of a topic; several publishers of a topic share it.
fn channel(
    topic: &str,
    kind: &Ros1Type,
    is_latched: bool,
    out: &mut Out,
) -> Result<u16, McapError> {
    let schema = kind.schema();
    let id = out.add_schema(&schema.name, &schema.encoding, schema.text.as_bytes())?;
    let offered = if is_latched { Qos::latched(1) } else { Qos::reliable(10) };
    let offered = qos::write(&[offered], Version::V9);
    let metadata = [("offered_qos_profiles", offered), ("topic_type_hash", schema.hash.clone())];
    let metadata = metadata.map(|(key, value)| (key.to_owned(), value)).into();
    out.add_channel(id, topic, "cdr", &metadata)
}

/// The MCAP file to which the messages of a ROS 1 bag are written.
pub(super) type Out = Writer<BufWriter<File>>;
