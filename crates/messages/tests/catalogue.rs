//! The shipped definitions are those of the packages.

use std::collections::{BTreeMap, BTreeSet};

use teampulse_messages::catalogue::{names, shipped};
use teampulse_messages::definition::{AssembleError, Definition, assemble};

/// Names and hashes, as an independent implementation computed them.
fn expected() -> impl Iterator<Item = (&'static str, &'static str)> {
    let lines = include_str!("rihs01.txt").lines().filter(|line| !line.starts_with('#'));
    lines.map(|line| line.split_once(' ').expect("a name and a hash"))
}

#[test]
fn every_shipped_type_has_the_hash_that_others_compute() {
    for (name, hash) in expected() {
        assert_eq!(shipped(name).expect(name).hash, hash, "{name}");
    }
    let expected: BTreeSet<_> = expected().map(|(name, _)| name).collect();
    assert_eq!(names().collect::<BTreeSet<_>>(), expected);
}

#[test]
fn a_definition_is_laid_out_as_rosbag2_writes_it() {
    let text = &shipped("geometry_msgs/msg/PoseStamped").unwrap().text;
    let line = "=".repeat(80);
    let expected = format!(
        "std_msgs/Header header\nPose pose\n\n\
         {line}\nMSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n\n\
         {line}\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n\n\
         {line}\nMSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n\n\
         {line}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\n\
         {line}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    );
    assert_eq!(*text, expected);
}

#[test]
fn a_type_that_is_not_shipped_is_none() {
    assert!(shipped("std_msgs/msg/Nothing").is_none());
    assert!(shipped("std_msgs/Header").is_none());
}

#[test]
fn a_schema_that_is_shipped_is_made_once() {
    let name = "sensor_msgs/msg/Imu";
    assert!(std::sync::Arc::ptr_eq(&shipped(name).unwrap(), &shipped(name).unwrap()));
}

#[test]
fn a_type_description_names_each_type_once() {
    let imu = Definition::of(&shipped("sensor_msgs/msg/Imu").unwrap()).unwrap();
    let description = imu.type_description();
    let names = description.referenced_type_descriptions.iter().map(|each| &each.type_name);
    let expected = [
        "builtin_interfaces/msg/Time",
        "geometry_msgs/msg/Quaternion",
        "geometry_msgs/msg/Vector3",
        "std_msgs/msg/Header",
    ];
    assert!(names.eq(expected));
}

#[test]
fn a_definition_taken_apart_can_be_put_together_again() {
    for name in names() {
        let text = &shipped(name).expect(name).text;
        let parts: BTreeMap<_, _> = Definition::parts(name, text).unwrap().into_iter().collect();
        assert_eq!(assemble(name, |part| parts.get(part)).as_ref(), Ok(text));
    }
}

#[test]
fn what_a_definition_lacks_is_named() {
    let text_of = |name: &str| (name == "a/msg/X").then_some("b/Y y");
    let missing = |name: &str| Err(AssembleError::Missing(name.to_owned()));
    assert_eq!(assemble("a/msg/X", text_of), missing("b/msg/Y"));
    assert_eq!(assemble("a/msg/Z", text_of), missing("a/msg/Z"));
}

#[test]
fn a_definition_without_end_is_refused() {
    let text_of = |name: &str| {
        let number: u32 = name.trim_start_matches("a/msg/X").parse().ok()?;
        Some(format!("X{} x", number + 1))
    };
    let endless = AssembleError::Endless("a/msg/X1".to_owned());
    assert_eq!(assemble("a/msg/X1", text_of), Err(endless));
}
