//! Finding the definition of a type.

use std::path::PathBuf;
use std::sync::Arc;

use teampulse_core::stream::Schema;
use teampulse_messages::catalogue;
use tokio::task::JoinSet;

use super::site::Site;
use super::type_client;
use crate::definitions;

/// The most nodes that are asked for one type.
const MOST_ASKED: usize = 8;

/// Finds the definition of a type. Tries the shipped definition, if it has the hash; publishing nodes; the installed
/// ROS; and the shipped definition, if no hash is known. The error lists what was tried.
pub(super) async fn find(
    site: &Arc<Site>,
    prefixes: &[PathBuf],
    type_name: &str,
    hash: &str,
) -> Result<Schema, String> {
    let shipped = catalogue::shipped(type_name);
    if let Some(schema) = shipped.as_ref().filter(|schema| schema.hash == hash) {
        return Ok(Schema::clone(schema));
    }
    let mut tried = match ask_all(site, type_name, hash).await {
        Ok(schema) => return Ok(schema),
        Err(tried) => tried,
    };
    let text_of = |part: &str| definitions::installed(prefixes, part);
    match definitions::linked(type_name, hash, text_of) {
        Ok(schema) => return Ok(schema),
        Err(reason) => tried.push(format!("in the installed ROS: {reason}")),
    }
    match shipped {
        Some(schema) if hash.is_empty() => Ok(Schema::clone(&schema)),
        Some(schema) => {
            Err(tried.join("; ")
                + &format!("; the shipped definition has the hash {}", schema.hash))
        }
        None => Err(tried.join("; ") + "; it is not shipped with teampulse"),
    }
}

/// Asks nodes that publish a type for its definition, concurrently; fails with the reason of each.
async fn ask_all(site: &Arc<Site>, type_name: &str, hash: &str) -> Result<Schema, Vec<String>> {
    let mut asked = JoinSet::new();
    let nodes = site.census().nodes_that_publish(type_name);
    for node in nodes.into_iter().take(MOST_ASKED) {
        let (site, type_name, hash) = (Arc::clone(site), type_name.to_owned(), hash.to_owned());
        asked.spawn(async move {
            let reply = type_client::ask(&site, &node, &type_name, &hash).await;
            reply.map_err(|reason| format!("{node} was asked: {reason}"))
        });
    }
    let mut tried = Vec::new();
    while let Some(reply) = asked.join_next().await {
        match reply {
            Ok(Ok(schema)) => return Ok(schema),
            Ok(Err(reason)) => tried.push(reason),
            Err(failed) => tried.push(failed.to_string()),
        }
    }
    tried.sort();
    Err(tried)
}
