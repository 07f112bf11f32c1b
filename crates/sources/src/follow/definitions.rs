//! The definitions of types that are not shipped: asked for on the bus, and learned when they come.

use std::sync::Arc;

use teampulse_core::stream::{Schema, Shape, Stream};
use teampulse_messages::definition::Definition;
use teampulse_messages::fields::Fields;
use teampulse_ros::bus::BusError;

use super::Following;
use super::followed::Receivers;
use super::publishing::Key;

impl Following<'_> {
    pub(super) fn ask_for_definition(&mut self, key: Key, hash: String) {
        let bus = Arc::clone(&self.bus);
        self.definitions.spawn(async move {
            let found = bus.definition(&key.1, &hash).await;
            (key, found)
        });
    }

    /// A definition was found, or nobody has it.
    pub(super) fn learn(&mut self, key: &Key, found: Result<Schema, BusError>) {
        let Some(followed) = self.followed.get(key) else { return };
        match found {
            Ok(schema) => {
                if let Receivers::Verbatim { stamped, .. } = &followed.receivers {
                    stamped.learn(&schema);
                }
                let mut stream = followed.stream.clone();
                stream.shape = Shape::Message(Arc::new(schema));
                self.leave_out_wrong_fields(&mut stream);
                self.outlet.declare(stream);
            }
            Err(error) => {
                tracing::warn!("failed to {error}; {} is recorded without it", key.0);
                self.fault(format!("failed to {error}; recorded without it"));
            }
        }
    }

    /// Leaves out the channels that the stream's type does not have, and says so.
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
