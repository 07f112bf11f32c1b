//! The environment variables of ROS 2 and Cyclone DDS: the only place that reads them.
#![expect(clippy::disallowed_methods, reason = "this is the one reader of the environment")]

use std::env;
use std::path::PathBuf;

use teampulse_messages::standard::rmw_dds_common::GidWidth;

use crate::bus::BusError;

/// The highest domain number that has its own ports.
pub const HIGHEST_DOMAIN: u32 = 232;

/// The values of `ROS_AUTOMATIC_DISCOVERY_RANGE`.
const RANGES: [&str; 4] = ["SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT"];

/// The ROS environment variables. An empty variable counts as unset.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Environment {
    /// `ROS_DOMAIN_ID`.
    pub domain_id: String,
    /// `ROS_AUTOMATIC_DISCOVERY_RANGE`: `SUBNET`, `LOCALHOST`, `OFF` or `SYSTEM_DEFAULT`.
    pub discovery_range: String,
    /// `ROS_STATIC_PEERS`, separated by semicolons.
    pub static_peers: String,
    /// `ROS_LOCALHOST_ONLY`, used before Iron: `1`.
    pub localhost_only: String,
    /// `ROS_DISTRO`: `jazzy`.
    pub distro: String,
    /// `CYCLONEDDS_URI`: the configuration of Cyclone DDS, or the path of its file.
    pub cyclonedds_uri: String,
    /// `AMENT_PREFIX_PATH`, separated by colons.
    pub ament_prefix_path: String,
    /// The id of this process.
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

    /// The default domain; 0 unless the environment sets another.
    pub fn domain(&self) -> Result<u32, BusError> {
        let text = self.domain_id.trim();
        if text.is_empty() {
            return Ok(0);
        }
        let domain = text.parse().ok().filter(|domain| *domain <= HIGHEST_DOMAIN);
        domain.ok_or_else(|| BusError::Variable {
            variable: "ROS_DOMAIN_ID",
            value: text.to_owned(),
            expected: format!("a whole number from 0 to {HIGHEST_DOMAIN}"),
        })
    }

    /// Describes an unusual setting of the environment and its effect, if there is one. The setting is used
    /// nevertheless, as in ROS.
    pub fn oddity(&self) -> Option<String> {
        let range = self.discovery_range.as_str();
        let is_known = range.is_empty() || RANGES.contains(&range);
        (!is_known && self.localhost_only != "1").then(|| {
            format!(
                "ROS_AUTOMATIC_DISCOVERY_RANGE is {range:?}, which is none of {}: as ROS does, teampulse then \
                 searches only this machine",
                RANGES.join(", ")
            )
        })
    }

    /// The width of GIDs on the wire in the configured ROS 2 release; `None` if no release is configured.
    pub fn gid_width(&self) -> Option<GidWidth> {
        match self.distro.as_str() {
            "" => None,
            "humble" | "galactic" | "foxy" | "eloquent" | "dashing" => Some(GidWidth::Humble),
            _ => Some(GidWidth::Iron),
        }
    }

    /// The install prefixes of ROS packages.
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
    fn a_domain_that_is_none_is_said_with_what_it_could_be() {
        for wrong in ["seven", "-1", "233", "7.0", "99999999999", "0x7"] {
            let odd = Environment { domain_id: wrong.into(), ..Environment::default() };
            let error = odd.domain().unwrap_err();
            assert_eq!(
                error.to_string(),
                format!(
                    "read the environment: ROS_DOMAIN_ID is {wrong:?}, expected a whole number from 0 to 232"
                )
            );
            assert!(error.hint().contains("unset ROS_DOMAIN_ID"));
        }
        let seven = Environment { domain_id: "7".into(), ..Environment::default() };
        assert_eq!(seven.domain().unwrap(), 7);
    }

    #[test]
    fn a_range_that_ros_does_not_know_is_said() {
        let of = |range: &str| {
            let discovery_range = range.to_owned();
            Environment { discovery_range, ..Environment::default() }.oddity()
        };
        assert!(of("SUBNT").unwrap().contains("none of SUBNET, LOCALHOST"));
        assert_eq!(["", "SUBNET", "OFF", "SYSTEM_DEFAULT"].map(of), [const { None }; 4]);
    }

    #[test]
    fn ids_are_wider_up_to_humble() {
        let of = |distro: &str| Environment { distro: distro.into(), ..Environment::default() };
        assert_eq!(of("humble").gid_width(), Some(GidWidth::Humble));
        assert_eq!(of("lyrical").gid_width(), Some(GidWidth::Iron));
    }
}
