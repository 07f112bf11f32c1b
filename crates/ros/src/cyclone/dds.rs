//! A kind of bus: ROS domains over DDS.

use std::sync::Arc;

use super::configuration::configuration;
use super::{CycloneBus, Participation};
use crate::bus::{Bus, BusError};
use crate::buses::{BusKind, Node};
use crate::environment::{Environment, HIGHEST_DOMAIN};

/// ROS domains over DDS.
pub const DDS: BusKind = BusKind {
    word: "dds",
    doc: "a ROS 2 domain over DDS, by its number",
    name: |domain| format!("ROS domain {domain}"),
    check: |domain| number(domain).map(drop),
    join,
};

fn number(domain: &str) -> Result<u32, String> {
    let number = domain.parse().ok().filter(|domain| *domain <= HIGHEST_DOMAIN);
    number.ok_or_else(|| format!("expected 0 to {HIGHEST_DOMAIN}"))
}

fn join(domain: &str, node: &Node) -> Result<Arc<dyn Bus>, BusError> {
    let Node { name, environment } = node;
    let refused = |reason| BusError::Join { bus: (DDS.name)(domain), reason, hint: String::new() };
    let joined = CycloneBus::join(Participation {
        domain: number(domain).map_err(refused)?,
        namespace: "/".into(),
        node_name: name.clone(),
        configuration: configuration(environment),
        gid_width: environment.gid_width(),
        prefixes: environment.prefixes(),
    });
    joined.map_err(|error| explained(error, environment))
}

/// Extends an error with settings of the environment that may be its cause.
fn explained(error: BusError, environment: &Environment) -> BusError {
    let BusError::Join { bus, reason, .. } = error else { return error };
    let set = [
        ("CYCLONEDDS_URI", &environment.cyclonedds_uri),
        ("ROS_STATIC_PEERS", &environment.static_peers),
    ];
    let set = set.into_iter().filter(|(_, value)| !value.is_empty());
    let set: Vec<&str> = set.map(|(name, _)| name).collect();
    let hint = if set.is_empty() {
        "`ip address` shows whether this machine has a network".to_owned()
    } else {
        format!("{} may be the cause: unset it, and try again", set.join(" or "))
    };
    BusError::Join { bus, reason, hint }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_in_the_environment_may_be_the_reason_is_named() {
        let environment = Environment {
            cyclonedds_uri: "<CycloneDDS".into(),
            static_peers: "nobody.invalid".into(),
            ..Environment::default()
        };
        let failed = || BusError::Join {
            bus: "ROS domain 0".into(),
            reason: "syntax".into(),
            hint: String::new(),
        };
        let hint = explained(failed(), &environment).hint();
        assert_eq!(
            hint,
            "CYCLONEDDS_URI or ROS_STATIC_PEERS may be the cause: unset it, and try again"
        );
        assert!(explained(failed(), &Environment::default()).hint().contains("ip address"));
    }
}
