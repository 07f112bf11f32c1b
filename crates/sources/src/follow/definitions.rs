//! The definitions of types that teampulse does not ship: requested on the bus, and stored when they arrive.

use std::sync::Arc;

use teampulse_core::stream::{Schema, Shape, Stream};
use teampulse_messages::definition::Definition;
use teampulse_messages::fields::Fields;
use teampulse_ros::bus::BusError;

use super::Following;
use super::followed::Receivers;
use super::publishing::Key;

/// A type with its hash.
pub(super) type Type = (String, String);

impl Following<'_> {
    /// Requests the definition of a type, once for all topics of that type.
    pub(super) fn ask_for_definition(&mut self, key: Key, of: Type) {
        let waiting = self.undefined.entry(of.clone()).or_default();
        waiting.push(key);
        if waiting.len() == 1 {
            let bus = Arc::clone(&self.bus);
            self.definitions.spawn(async move {
                let found = bus.definition(&of.0, &of.1).await;
                (of, found)
            });
        }
    }

    /// Handles the definition of a type, or the answer that no node has it.
    pub(super) fn learn(&mut self, of: Type, found: Result<Schema, BusError>) {
        let topics = self.undefined.remove(&of).unwrap_or_default();
        match found {
            Ok(schema) => {
                for followed in topics.iter().filter_map(|key| self.followed.get(key)) {
                    if let Receivers::Verbatim { stamped, .. } = &followed.receivers {
                        stamped.learn(&schema);
                    }
                    let mut stream = followed.stream.clone();
                    stream.shape = Shape::Message(Arc::new(schema.clone()));
                    self.leave_out_wrong_fields(&mut stream);
                    self.outlet.declare(stream);
                }
                self.defined.insert(of, schema);
            }
            Err(error) => {
                for (topic, _) in topics {
                    tracing::warn!("failed to {error}; {topic} is recorded without it");
                    self.fault(format!("failed to {error}; recorded without it"));
                }
            }
        }
    }

    /// Drops the channels that the stream's type does not have, and reports it.
    pub(super) fn leave_out_wrong_fields(&self, stream: &mut Stream) {
        let Shape::Message(schema) = &stream.shape else { return };
        let Ok(definition) = Definition::of(schema) else { return };
        let name = &stream.name;
        stream.channels.retain(|channel| {
            let found = Fields::compile(&definition, &[&channel.name]);
            found.map_err(|error| self.fault(format!("{name}: failed to {error}"))).is_ok()
        });
    }
}
