/// The packages with shipped definitions. In each text a line `[Type]` starts a type, followed by its
/// `.msg` text; `[srv/Type]` starts a type that belongs to a service.
const PACKAGES: [(&str, &str); 24] = [
    ("action_msgs", include_str!("../../definitions/action_msgs.msgs")),
    ("builtin_interfaces", include_str!("../../definitions/builtin_interfaces.msgs")),
    ("diagnostic_msgs", include_str!("../../definitions/diagnostic_msgs.msgs")),
    (
        "ffmpeg_image_transport_msgs",
        include_str!("../../definitions/ffmpeg_image_transport_msgs.msgs"),
    ),
    ("foxglove_msgs", include_str!("../../definitions/foxglove_msgs.msgs")),
    ("geometry_msgs", include_str!("../../definitions/geometry_msgs.msgs")),
    ("hri_msgs", include_str!("../../definitions/hri_msgs.msgs")),
    ("lifecycle_msgs", include_str!("../../definitions/lifecycle_msgs.msgs")),
    ("nav_msgs", include_str!("../../definitions/nav_msgs.msgs")),
    ("rcl_interfaces", include_str!("../../definitions/rcl_interfaces.msgs")),
    ("rmw_dds_common", include_str!("../../definitions/rmw_dds_common.msgs")),
    ("rosgraph_msgs", include_str!("../../definitions/rosgraph_msgs.msgs")),
    ("sensor_msgs", include_str!("../../definitions/sensor_msgs.msgs")),
    ("service_msgs", include_str!("../../definitions/service_msgs.msgs")),
    ("shape_msgs", include_str!("../../definitions/shape_msgs.msgs")),
    ("statistics_msgs", include_str!("../../definitions/statistics_msgs.msgs")),
    ("std_msgs", include_str!("../../definitions/std_msgs.msgs")),
    ("stereo_msgs", include_str!("../../definitions/stereo_msgs.msgs")),
    ("tf2_msgs", include_str!("../../definitions/tf2_msgs.msgs")),
    ("trajectory_msgs", include_str!("../../definitions/trajectory_msgs.msgs")),
    (
        "type_description_interfaces",
        include_str!("../../definitions/type_description_interfaces.msgs"),
    ),
    ("unique_identifier_msgs", include_str!("../../definitions/unique_identifier_msgs.msgs")),
    ("visualization_msgs", include_str!("../../definitions/visualization_msgs.msgs")),
    ("wireless_msgs", include_str!("../../definitions/wireless_msgs.msgs")),
];

/// Our own definitions, identical to those of the package that ROS users build.
const OWN: [(&str, &str); 6] = [
    ("Event", include_str!("../../../../msgs/teampulse_msgs/msg/Event.msg")),
    ("Feature", include_str!("../../../../msgs/teampulse_msgs/msg/Feature.msg")),
    ("Sample", include_str!("../../../../msgs/teampulse_msgs/msg/Sample.msg")),
    (
        "StreamDescription",
        include_str!("../../../../msgs/teampulse_msgs/msg/StreamDescription.msg"),
    ),
    ("StreamStatus", include_str!("../../../../msgs/teampulse_msgs/msg/StreamStatus.msg")),
    ("Wave", include_str!("../../../../msgs/teampulse_msgs/msg/Wave.msg")),
];

/// Our own services, identical to those of that package.
const OWN_SERVICES: [(&str, &str); 1] =
    [("ProbeClock", include_str!("../../../../msgs/teampulse_msgs/srv/ProbeClock.srv"))];

/// The `.msg` texts of all types, by full name.
pub(super) fn texts() -> Vec<(String, &'static str)> {
    let own = OWN.iter().map(|(name, text)| (format!("teampulse_msgs/msg/{name}"), *text));
    let services = OWN_SERVICES.iter().flat_map(|(name, text)| halves(name, text));
    let others = PACKAGES.iter().flat_map(|(package, text)| types(package, text));
    others.chain(own).chain(services).collect()
}

/// The request and the response type of one of our services.
fn halves(name: &str, text: &'static str) -> impl Iterator<Item = (String, &'static str)> {
    let halves = text.split("---\n").zip(["Request", "Response"]);
    halves.map(move |(text, half)| (format!("teampulse_msgs/srv/{name}_{half}"), text))
}

/// The types of a package, each with its full name and text.
fn types(package: &str, text: &'static str) -> impl Iterator<Item = (String, &'static str)> {
    let bodies = text.split("\n[");
    bodies.filter_map(move |body| {
        let (title, text) = body.strip_prefix('[').unwrap_or(body).split_once("]\n")?;
        let name = if title.contains('/') { title.to_owned() } else { format!("msg/{title}") };
        Some((format!("{package}/{name}"), text))
    })
}
