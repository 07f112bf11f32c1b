//! The shipped definitions: those of the common packages as in ROS 2 Jazzy, and our own.

mod packages;

use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock, OnceLock};

use teampulse_core::stream::Schema;

use crate::definition::{Definition, assemble};

/// The `.msg` texts by full type name, each with its schema once requested.
static SHIPPED: LazyLock<BTreeMap<String, Shipped>> = LazyLock::new(|| {
    let shipped = |(name, text)| (name, Shipped { text, schema: OnceLock::new() });
    packages::texts().into_iter().map(shipped).collect()
});

struct Shipped {
    text: &'static str,
    schema: OnceLock<Arc<Schema>>,
}

/// The schema of a type with a shipped definition, including its text and hash.
pub fn shipped(type_name: &str) -> Option<Arc<Schema>> {
    let shipped = SHIPPED.get(type_name)?;
    Some(Arc::clone(shipped.schema.get_or_init(|| Arc::new(schema(type_name)))))
}

/// The schema of a type; without text and hash if no definition is shipped.
pub fn shipped_or_bare(type_name: &str) -> Arc<Schema> {
    let bare = || Schema {
        name: type_name.into(),
        encoding: "ros2msg".into(),
        text: String::new(),
        hash: String::new(),
    };
    shipped(type_name).unwrap_or_else(|| Arc::new(bare()))
}

/// The full names of all types with a shipped definition, in alphabetical order.
pub fn names() -> impl Iterator<Item = &'static str> {
    SHIPPED.keys().map(String::as_str)
}

fn schema(type_name: &str) -> Schema {
    let text = assemble(type_name, |name| SHIPPED.get(name).map(|shipped| shipped.text));
    let text = text.expect("all parts of a shipped type are shipped");
    let definition =
        Definition::parse(type_name, &text).expect("a shipped text is a valid definition");
    let (name, encoding) = (type_name.to_owned(), "ros2msg".to_owned());
    Schema { name, encoding, hash: definition.hash(), text }
}
