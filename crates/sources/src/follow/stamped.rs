//! The schema of a publisher's type as first known, and the origin of its stamps.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use teampulse_core::stream::Schema;
use teampulse_messages::catalogue;
use teampulse_messages::definition::Definition;
use teampulse_messages::fields;
use teampulse_ros::graph::Endpoint;

/// Whether messages are stamped by their header or by the bus on publication. Clones share their state.
#[derive(Clone, Debug, Default)]
pub(super) struct Stamped(Arc<AtomicBool>);

impl Stamped {
    /// Whether messages are stamped by their header.
    pub(super) fn is_by_header(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Uses the header's stamp from now on, if the type has one.
    pub(super) fn learn(&self, schema: &Schema) {
        let definition = Definition::parse(&schema.name, &schema.text);
        let is_headed = definition.is_ok_and(|each| fields::starts_with_header(&each));
        self.0.store(is_headed, Ordering::Relaxed);
    }
}

/// Returns the schema of a publisher's type as far as known locally, and the origin of its stamps.
pub(super) fn known_schema(endpoint: &Endpoint) -> (Schema, Stamped) {
    let stamped = Stamped::default();
    match catalogue::shipped(&endpoint.type_name) {
        Some(schema) if endpoint.type_hash.is_empty() || endpoint.type_hash == schema.hash => {
            stamped.learn(&schema);
            ((*schema).clone(), stamped)
        }
        _ => {
            let schema = Schema {
                name: endpoint.type_name.clone(),
                encoding: "ros2msg".into(),
                text: String::new(),
                hash: endpoint.type_hash.clone(),
            };
            (schema, stamped)
        }
    }
}
