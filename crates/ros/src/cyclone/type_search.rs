//! Finding the definition of a type.

use std::path::PathBuf;

use teampulse_core::stream::Schema;
use teampulse_messages::catalogue;

use super::site::Site;
use super::type_client;
use crate::definitions;

/// Finds the definition of a type: the one that is shipped if it has the hash; what the nodes tell
/// that publish it; what the installed ROS has; what is shipped if no hash is known. Says what was
/// tried if none is found.
pub(super) async fn find(
    site: &Site,
    prefixes: &[PathBuf],
    type_name: &str,
    hash: &str,
) -> Result<Schema, String> {
    let shipped = catalogue::shipped(type_name);
    if let Some(schema) = shipped.as_ref().filter(|schema| schema.hash == hash) {
        return Ok(Schema::clone(schema));
    }
    let mut tried = Vec::new();
    let nodes = site.census().nodes_that_publish(type_name);
    for node in nodes {
        match type_client::ask(site, &node, type_name, hash).await {
            Ok(schema) => return Ok(schema),
            Err(reason) => tried.push(format!("{node} was asked: {reason}")),
        }
    }
    let text_of = |part: &str| definitions::installed(prefixes, part);
    match definitions::linked(type_name, hash, text_of) {
        Ok(schema) => return Ok(schema),
        Err(reason) => tried.push(format!("in the installed ROS: {reason}")),
    }
    match shipped {
        Some(schema) if hash.is_empty() => Ok(Schema::clone(&schema)),
        Some(schema) => {
            Err(tried.join("; ") + &format!("; shipped: it has the hash {}", schema.hash))
        }
        None => Err(tried.join("; ") + "; none is shipped"),
    }
}
