//! The publishers of a topic and their names.

use std::collections::{BTreeMap, BTreeSet};

use teampulse_core::qos::Qos;
use teampulse_ros::graph::{Gid, Graph};

/// A topic with its type.
pub(crate) type Key = (String, String);

/// The QoS offered by the publishers of a topic.
pub(crate) fn offered((topic, type_name): &Key, graph: &Graph) -> Vec<Qos> {
    let of_type = graph.publishers(topic).filter(|each| each.type_name == *type_name);
    of_type.map(|each| each.qos.clone()).collect()
}

/// Returns the computers that publish a topic, each with its host if announced.
pub(super) fn publishing(key: &Key, graph: &Graph) -> BTreeMap<String, Option<String>> {
    gids(key, graph).map(|gid| (graph.computer(gid), graph.host(gid).map(str::to_owned))).collect()
}

/// Returns the publishers of a topic, except for this session's own.
pub(super) fn gids<'a>(
    (topic, type_name): &'a Key,
    graph: &'a Graph,
) -> impl Iterator<Item = Gid> + 'a {
    let theirs = graph.publishers(topic).filter(|each| !each.own && each.type_name == *type_name);
    theirs.map(|each| each.gid)
}

/// Returns the names of publishers: the names of their computers; if these are not all different, each with its GID.
pub(super) fn names_of(graph: &Graph, publishers: &[Gid]) -> Vec<String> {
    let computers: BTreeSet<String> = publishers.iter().map(|gid| graph.computer(*gid)).collect();
    if computers.len() == publishers.len() {
        publishers.iter().map(|gid| graph.computer(*gid)).collect()
    } else {
        publishers.iter().map(|gid| who(graph, *gid)).collect()
    }
}

/// Returns the name of a publisher with its GID, for a bag.
pub(crate) fn who(graph: &Graph, publisher: Gid) -> String {
    format!("{} {publisher}", graph.computer(publisher))
}

/// Returns the names of several computers; `None` if all are processes of one host, which has one clock. Unnamed hosts
/// may be the same one.
pub(super) fn several(computers: &BTreeMap<String, Option<String>>) -> Option<String> {
    let hosts: Option<BTreeSet<&str>> = computers.values().map(Option::as_deref).collect();
    let kind = if hosts.is_some() { "computers" } else { "processes" };
    let several = hosts.map_or(computers.len(), |hosts| hosts.len());
    let count = if several == 2 { "two".into() } else { several.to_string() };
    let names: Vec<&str> = computers.keys().map(String::as_str).collect();
    (several > 1).then(|| format!("{count} {kind}: {}", names.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::several;

    #[test]
    fn processes_of_one_host_are_one_computer() {
        let reported = |names: [&str; 2]| {
            let host = |name: &str| name.split_once(" (").map(|(host, _)| host.to_owned());
            let of = |name: &str| (name.to_owned(), host(name).filter(|it| !it.starts_with('/')));
            several(&names.map(of).into())
        };
        let two = "two computers: laptop1 (driver, 01), laptop2 (driver, 02)";
        assert_eq!(
            reported(["laptop1 (driver, 01)", "laptop2 (driver, 02)"]).as_deref(),
            Some(two)
        );
        assert_eq!(reported(["laptop1 (driver, 01)", "laptop1 (driver, 02)"]), None);
        let two = "two processes: /r1/driver (01), /r2/driver (02)";
        assert_eq!(reported(["/r1/driver (01)", "/r2/driver (02)"]).as_deref(), Some(two));
    }
}
