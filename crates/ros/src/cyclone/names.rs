//! The names of topics and types on the wire: ROS 2's mapping to DDS.

/// The DDS topic of a ROS topic: `/robot1/odom` is `rt/robot1/odom`.
pub(super) fn dds_topic(topic: &str) -> String {
    format!("rt/{}", topic.trim_start_matches('/'))
}

/// The ROS topic of a DDS topic; `None` for services, parameters and topics of other systems.
pub(super) fn ros_topic(dds_topic: &str) -> Option<String> {
    dds_topic.strip_prefix("rt").filter(|topic| topic.starts_with('/')).map(str::to_owned)
}

/// The ROS service whose requests a DDS topic carries; `None` for any other topic.
pub(super) fn ros_service(dds_topic: &str) -> Option<String> {
    let service = dds_topic.strip_prefix("rq")?.strip_suffix("Request")?;
    service.starts_with('/').then(|| service.to_owned())
}

/// Whether a DDS topic is a ROS topic, or the requests or replies of a ROS service.
pub(super) fn is_ros(dds_topic: &str) -> bool {
    ["rt/", "rq/", "rr/"].iter().any(|prefix| dds_topic.starts_with(prefix))
}

/// The DDS type of a ROS type: `nav_msgs/msg/Odometry` is `nav_msgs::msg::dds_::Odometry_`.
pub(super) fn dds_type(type_name: &str) -> String {
    match type_name.rsplit_once('/') {
        Some((package, name)) => format!("{}::dds_::{name}_", package.replace('/', "::")),
        None => type_name.to_owned(),
    }
}

/// The ROS type of a DDS type; other names are returned unchanged.
pub(super) fn ros_type(dds_type: &str) -> String {
    match dds_type.rsplit_once("::dds_::") {
        Some((package, name)) => {
            let name = name.strip_suffix('_').unwrap_or(name);
            format!("{}/{name}", package.replace("::", "/"))
        }
        None => dds_type.to_owned(),
    }
}

/// The full name of a node: `/robot1` and `driver` give `/robot1/driver`.
pub(super) fn node(namespace: &str, name: &str) -> String {
    format!("{}/{name}", namespace.trim_end_matches('/'))
}

/// The type hash in an endpoint's user data, `typehash=RIHS01_…;`; empty if there is none.
pub(super) fn type_hash(user_data: &[u8]) -> String {
    const KEY: &[u8] = b"typehash=";
    let Some(at) = user_data.windows(KEY.len()).position(|window| window == KEY) else {
        return String::new();
    };
    let value = user_data[at + KEY.len()..].split(|byte| *byte == b';').next().unwrap_or_default();
    let hash = std::str::from_utf8(value).unwrap_or_default();
    let digits = hash.strip_prefix("RIHS01_").unwrap_or_default();
    let whole = digits.len() == 64 && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    if whole { hash.to_owned() } else { String::new() }
}

/// User data with a type hash; empty if the hash is empty.
pub(super) fn user_data(hash: &str) -> String {
    if hash.is_empty() { String::new() } else { format!("typehash={hash};") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn names_come_back_as_they_were() {
        assert_eq!(dds_topic("/robot1/odom"), "rt/robot1/odom");
        assert_eq!(ros_topic("rt/robot1/odom").as_deref(), Some("/robot1/odom"));
        assert_eq!(dds_type("nav_msgs/msg/Odometry"), "nav_msgs::msg::dds_::Odometry_");
        assert_eq!(ros_type("nav_msgs::msg::dds_::Odometry_"), "nav_msgs/msg/Odometry");
        assert_eq!(node("/", "driver"), "/driver");
        assert_eq!(node("/robot1", "driver"), "/robot1/driver");
    }

    #[test]
    fn services_and_foreign_topics_are_not_listed() {
        for topic in ["rq/driver/get_parametersRequest", "ros_discovery_info", "rtx", "rt", ""] {
            assert_eq!(ros_topic(topic), None, "{topic}");
        }
        assert!(is_ros("rq/driver/get_parametersRequest") && !is_ros("ros_discovery_info"));
        let service = ros_service("rq/driver/get_parametersRequest");
        assert_eq!(service.as_deref(), Some("/driver/get_parameters"));
        for topic in ["rr/driver/get_parametersReply", "rqxRequest", "rt/xRequest", "rq"] {
            assert_eq!(ros_service(topic), None, "{topic}");
        }
    }

    #[test]
    fn a_hash_is_found_in_user_data_and_nothing_else_is_taken_for_one() {
        let hash = format!("RIHS01_{}", "0f".repeat(32));
        assert_eq!(type_hash(user_data(&hash).as_bytes()), hash);
        assert_eq!(type_hash(format!("enclave=/;typehash={hash};\0\0").as_bytes()), hash);
        assert_eq!(type_hash(b"typehash=RIHS01_12;"), "");
        assert_eq!(type_hash(b""), "");
        assert_eq!(user_data(""), "");
    }

    proptest! {
        #[test]
        fn any_user_data_is_read(bytes: Vec<u8>) {
            let hash = type_hash(&bytes);
            prop_assert!(hash.is_empty() || hash.len() == 71);
        }
    }
}
