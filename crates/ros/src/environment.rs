//! The environment variables of ROS 2 and Cyclone DDS: the only place that reads them.
#![expect(clippy::disallowed_methods, reason = "this is the one reader of the environment")]

use std::env;
use std::path::PathBuf;

use teampulse_messages::standard::rmw_dds_common::GidWidth;

use crate::bus::BusError;

/// What the environment says about ROS. An empty variable is as one that is not set.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Environment {
    /// `ROS_DOMAIN_ID`.
    pub domain_id: String,
    /// `ROS_AUTOMATIC_DISCOVERY_RANGE`: `SUBNET`, `LOCALHOST`, `OFF` or `SYSTEM_DEFAULT`.
    pub discovery_range: String,
    /// `ROS_STATIC_PEERS`, separated by semicolons.
    pub static_peers: String,
    /// `ROS_LOCALHOST_ONLY`, what was used before Iron: `1`.
    pub localhost_only: String,
    /// `ROS_DISTRO`: `jazzy`.
    pub distro: String,
    /// `CYCLONEDDS_URI`: configuration of Cyclone DDS, or where it stands.
    pub cyclonedds_uri: String,
    /// `AMENT_PREFIX_PATH`, separated by colons.
    pub ament_prefix_path: String,
    /// The number of this process.
    pub process_id: u32,
}

impl Environment {
    /// Reads the environment of this process.
    pub fn read() -> Environment {
        let variable = |name| env::var(name).unwrap_or_default();
        Environment {
            domain_id: variable("ROS_DOMAIN_ID"),
            discovery_range: variable("ROS_AUTOMATIC_DISCOVERY_RANGE"),
            static_peers: variable("ROS_STATIC_PEERS"),
            localhost_only: variable("ROS_LOCALHOST_ONLY"),
            distro: variable("ROS_DISTRO"),
            cyclonedds_uri: variable("CYCLONEDDS_URI"),
            ament_prefix_path: variable("AMENT_PREFIX_PATH"),
            process_id: std::process::id(),
        }
    }

    /// The domain that is meant where none is named; 0 unless the environment says otherwise.
    pub fn domain(&self) -> Result<u32, BusError> {
        match self.domain_id.trim() {
            "" => Ok(0),
            number => number.parse().map_err(|error| BusError::Join {
                bus: "the default ROS domain".into(),
                reason: format!("ROS_DOMAIN_ID is {number:?}: {error}"),
            }),
        }
    }

    /// How wide ids are on the wire in the release of ROS 2 that is set up; `None` if none is.
    pub fn gid_width(&self) -> Option<GidWidth> {
        match self.distro.as_str() {
            "" => None,
            "humble" | "galactic" | "foxy" | "eloquent" | "dashing" => Some(GidWidth::Humble),
            _ => Some(GidWidth::Iron),
        }
    }

    /// Where ROS packages are installed.
    pub fn prefixes(&self) -> Vec<PathBuf> {
        env::split_paths(&self.ament_prefix_path)
            .filter(|path| !path.as_os_str().is_empty())
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_an_environment_the_domain_is_zero() {
        let nothing = Environment::default();
        assert_eq!(nothing.domain().unwrap(), 0);
        assert_eq!(nothing.gid_width(), None);
        assert!(nothing.prefixes().is_empty());
    }

    #[test]
    fn a_domain_that_is_no_number_is_said() {
        let odd = Environment { domain_id: "seven".into(), ..Environment::default() };
        assert_eq!(
            odd.domain().unwrap_err().to_string(),
            "join the default ROS domain: ROS_DOMAIN_ID is \"seven\": invalid digit found in string"
        );
        let seven = Environment { domain_id: "7".into(), ..Environment::default() };
        assert_eq!(seven.domain().unwrap(), 7);
    }

    #[test]
    fn ids_are_wider_up_to_humble() {
        let of = |distro: &str| Environment { distro: distro.into(), ..Environment::default() };
        assert_eq!(of("humble").gid_width(), Some(GidWidth::Humble));
        assert_eq!(of("lyrical").gid_width(), Some(GidWidth::Iron));
    }
}
