use proptest::prelude::*;
use teampulse_core::time::Time;

use super::*;
use crate::catalogue::shipped;
use crate::standard::Message;
use crate::standard::sensor_msgs::BatteryState;
use crate::standard::std_msgs::Header;

const SEPARATOR: &str =
    "\n================================================================================\n";

/// A definition as stored by `rosbag` of ROS Noetic.
fn stamped(fields: &str) -> String {
    let header =
        "# Standard metadata\nuint32 seq\n#Two-integer timestamp\ntime stamp\nstring frame_id\n";
    format!("Header header # when\n{fields}{SEPARATOR}MSG: std_msgs/Header\n{header}")
}

fn header(to: &mut Vec<u8>) {
    to.extend(7_u32.to_le_bytes());
    to.extend(1_700_000_000_u32.to_le_bytes());
    to.extend(250_000_000_u32.to_le_bytes());
    text("base", to);
}

fn text(text: &str, to: &mut Vec<u8>) {
    to.extend((text.len() as u32).to_le_bytes());
    to.extend(text.as_bytes());
}

#[test]
fn a_type_with_the_same_fields_is_that_of_ros_2() {
    let shipped = shipped(BatteryState::NAME).unwrap();
    let own = Definition::parts(BatteryState::NAME, &shipped.text).unwrap().remove(0).1;
    let fields = own.lines().filter(|line| !line.contains("Header")).collect::<Vec<_>>().join("\n");
    let ros1 = Ros1Type::parse("sensor_msgs/BatteryState", &stamped(&(fields + "\n"))).unwrap();
    assert_eq!(ros1.schema().name, BatteryState::NAME);
    assert_eq!(ros1.schema().hash, shipped.hash);
}

#[test]
fn a_message_is_what_a_node_of_ros_2_publishes() {
    let fields = "string name\nfloat64[] values\nuint8 flag\nfloat64[2] limits\nduration age\n";
    let ros1 = Ros1Type::parse("own_msgs/Reading", &stamped(fields)).unwrap();
    let mut message = Vec::new();
    header(&mut message);
    text("arm", &mut message);
    message.extend(1_u32.to_le_bytes());
    message.extend(1.5_f64.to_le_bytes());
    message.push(9);
    message.extend([2.0_f64, -3.0].map(f64::to_le_bytes).concat());
    message.extend((-1_i32).to_le_bytes());
    message.extend(5_i32.to_le_bytes());

    let mut expected = Writer::new();
    let stamp = Time::from_stamp(1_700_000_000, 250_000_000);
    expected.write(&Header { stamp, frame_id: "base".into() });
    expected.text("arm");
    expected.sequence(&[1.5]);
    expected.write(&9_u8);
    expected.write(&2.0_f64);
    expected.write(&-3.0_f64);
    expected.write(&-1_i32);
    expected.write(&5_u32);
    assert_eq!(ros1.cdr(&message).unwrap(), expected.finish());
}

#[test]
fn names_and_constants_follow_the_rules_of_ros_2() {
    let text = "float64[9] K\nint32 camelCase_\nint32 camel_case\nint32 max=3 # most\nstring motto=a \"b\" # c\n\
                time[] at\nchar c\nEmpty none\n";
    let text = format!("{text}{SEPARATOR}MSG: own/Empty\n\n");
    let ros1 = Ros1Type::parse("own/Odd", &text).unwrap();
    let own = Definition::parts("own/msg/Odd", &ros1.schema().text).unwrap().remove(0).1;
    let expected = "float64[9] k\nint32 camel_case\nint32 camel_case_2\nint32 MAX=3  # most\n\
                    string MOTTO=\"a \\\"b\\\" # c\"\nbuiltin_interfaces/Time[] at\nchar c\nEmpty none\n";
    assert_eq!(own, expected);
}

#[test]
fn many_fields_of_one_name_are_refused_at_once() {
    let error = Ros1Type::parse("own/Many", &"int8 a\n".repeat(100_000)).unwrap_err();
    assert!(error.to_string().ends_with("there are two fields named a"), "{error}");
}

#[test]
fn transforms_have_their_name_in_ros_2() {
    let transforms = "geometry_msgs/TransformStamped[] transforms\n";
    let part = format!("{SEPARATOR}MSG: geometry_msgs/TransformStamped\nHeader header\n");
    let header =
        format!("{SEPARATOR}MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n");
    let ros1 = Ros1Type::parse("tf/tfMessage", &format!("{transforms}{part}{header}")).unwrap();
    assert_eq!(ros1.schema().name, "tf2_msgs/msg/TFMessage");
}

#[test]
fn an_empty_message_has_its_byte() {
    let ros1 = Ros1Type::parse("std_msgs/Empty", "").unwrap();
    assert_eq!(ros1.cdr(&[]).unwrap()[..], [0, 1, 0, 0, 0]);
    assert!(Definition::of(ros1.schema()).is_ok());
    assert_eq!(ros1.schema().hash, shipped("std_msgs/msg/Empty").unwrap().hash);
}

#[test]
fn a_message_that_does_not_fit_its_definition_is_refused() {
    let ros1 = Ros1Type::parse("std_msgs/Float64MultiArray", "float64[] data\n").unwrap();
    let huge = u32::MAX.to_le_bytes();
    let short = Ros1Error::Short { needed: u32::MAX as usize * 8, at: 4, left: 0 };
    assert_eq!(ros1.cdr(&huge), Err(short));
    assert_eq!(ros1.cdr(&[0; 9]), Err(Ros1Error::Long { length: 9, at: 4 }));
}

#[test]
fn a_definition_without_a_type_that_it_needs_is_an_error() {
    let error = Ros1Type::parse("own/A", "own/B b\n").unwrap_err();
    assert_eq!(error.to_string(), "read the definition of own/msg/B: it is not known");
}

/// Four bytes that announce four billion empty messages.
#[test]
fn empty_messages_do_not_fill_the_memory() {
    let text = format!("Empty[] all\n{SEPARATOR}MSG: own/Empty\n");
    let ros1 = Ros1Type::parse("own/Bomb", &text).unwrap();
    assert_eq!(ros1.cdr(&u32::MAX.to_le_bytes()), Err(Ros1Error::Large(4 * 16 + 1024)));
}

proptest! {
    #[test]
    fn any_bytes_are_a_message_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let fields = "string[] names\nuint8 flag\nPart[] parts\nbool[3] flags\nEmpty[] empty\n";
        let parts = "MSG: own/Part\nfloat64 x\ntime at\nuint16[] data\n";
        let text = format!("{}{SEPARATOR}{parts}{SEPARATOR}MSG: own/Empty\n", stamped(fields));
        let ros1 = Ros1Type::parse("own/Any", &text).unwrap();
        if let Ok(cdr) = ros1.cdr(&bytes) {
            let mut from = crate::cdr::Reader::new(&cdr).unwrap();
            ros1.definition.root().skip(&mut from).unwrap();
            prop_assert_eq!(from.left(), 0);
        }
    }

    #[test]
    fn any_text_is_a_definition_or_an_error(text in "[a-z#=\\[\\] 0-9/A-C\"\n]{0,80}") {
        drop(Ros1Type::parse("own/Any", &text));
    }
}
