//! Which definitions are accepted, and which are refused.

use proptest::prelude::*;
use teampulse_messages::catalogue::{names, shipped};
use teampulse_messages::definition::{Count, Definition, EMPTY, Kind, Number};
use teampulse_messages::fields::{Fields, numbers};
use teampulse_messages::value::flatten;

fn parse(text: &str) -> Result<Definition, String> {
    Definition::parse("a_msgs/msg/A", text).map_err(|error| error.to_string())
}

fn with_types(text: &str, types: &[(&str, &str)]) -> String {
    let line = "=".repeat(80);
    types
        .iter()
        .fold(text.to_owned(), |text, (name, body)| format!("{text}\n{line}\nMSG: {name}\n{body}"))
}

#[test]
fn everything_that_a_definition_can_say_is_understood() {
    let text = "# a comment\n\
                uint8 LOW=1   # a constant\n\
                string NAME = 'x y'\n\
                \tbool flag true\n\
                string<=5[<=3] words [\"a\", \"b\"]\r\n\
                float64[36] covariance\n\
                wstring<=7 wide # behind\n\
                char[] letters\n";
    let definition = parse(text).unwrap();
    let root = definition.root();
    let constants: Vec<_> = root.constants.iter().map(|c| (&*c.name, &*c.value)).collect();
    assert_eq!(constants, [("LOW", "1"), ("NAME", "'x y'")]);
    let fields: Vec<_> = root.fields.iter().map(|f| (&*f.name, f.count, &*f.default)).collect();
    let expected = [
        ("flag", Count::One, "true"),
        ("words", Count::AtMost(3), "[\"a\", \"b\"]"),
        ("covariance", Count::Array(36), ""),
        ("wide", Count::One, ""),
        ("letters", Count::Any, ""),
    ];
    assert_eq!(fields, expected);
    assert!(matches!(root.fields[1].kind, Kind::Text(Some(5))));
    assert!(matches!(root.fields[3].kind, Kind::WideText(Some(7))));
    assert!(matches!(root.fields[4].kind, Kind::Number(Number::Char)));
}

#[test]
fn types_are_found_however_they_are_named() {
    let types = [("a_msgs/B", "C c\n"), ("a_msgs/msg/C", "int8 x\n"), ("b_msgs/D", "")];
    for text in ["B b\n", "a_msgs/B b\n", "a_msgs/msg/B b\n"] {
        let text = with_types(text, &types);
        let definition = parse(&text).unwrap();
        assert_eq!(numbers(&definition), ["b.c.x"]);
    }
    let definition = parse(&with_types("b_msgs/D d", &types)).unwrap();
    assert_eq!(definition.type_description().referenced_type_descriptions[0].fields[0].name, EMPTY);
}

#[test]
fn a_type_without_fields_takes_one_byte() {
    let text = with_types("Nothing[] many\nuint8 last", &[("a_msgs/Nothing", "")]);
    let definition = parse(&text).unwrap();
    let fields = Fields::compile(&definition, &["last"]).unwrap();
    let mut numbers = Vec::new();
    fields.read(&[0, 1, 0, 0, 2, 0, 0, 0, 0, 0, 7], &mut numbers).unwrap();
    assert_eq!(numbers, [7.0]);
    let values = flatten(&definition, &[0, 1, 0, 0, 0, 0, 0, 0, 9], 5).unwrap();
    assert_eq!(values.len(), 1);
}

#[test]
fn an_error_names_the_line_and_what_was_expected() {
    let says = |text: &str, expected: &str| {
        let error = parse(text).expect_err(text);
        let expected = format!("read {expected}");
        assert_eq!(error.replace(" of the definition of a_msgs/msg/A", ""), expected);
    };
    says("int8 a\n\nfloat", "line 3: expected a type and a name, got \"float\"");
    says("int8 9a", "line 1: \"9a\" is not the name of a field");
    says("int8 a-b", "line 1: \"a-b\" is not the name of a field");
    says("int8 a\nint16 a", "line 2: there are two fields named a");
    says("int8[x] a", "line 1: \"int8[x]\" is not a type");
    says("int8[0] a", "line 1: \"int8[0]\" is not a type");
    says("int8[+1] a", "line 1: \"int8[+1]\" is not a type");
    says("int8<=3 a", "line 1: \"int8<=3\" is not a type");
    says("int8[] A=3", "line 1: A can't be the type of a constant");
    says("b/c/D d", "line 1: \"b/c/D\" is not a type");
    says("b/D d", "line 1: b/msg/D is not defined");
    says(&with_types("B b", &[("a_msgs/B", "A a")]), "line 4: a_msgs/msg/A contains itself");
    says(&format!("int8 a\n{}\nnothing", "=".repeat(80)), NO_TITLE);
    says("float64[1000000000] a", "line 1: it takes at least 8000000000 bytes");
}

const NO_TITLE: &str = "line 3: expected `MSG: package/Type` below the line between two types";

#[test]
fn types_that_are_nested_without_sense_are_refused() {
    let chain = |length: usize| {
        let types: Vec<_> = (0..length)
            .map(|k| (format!("a_msgs/T{k}"), format!("T{} a\nT{} b\n", k + 1, k + 1)))
            .chain([(format!("a_msgs/T{length}"), "int8 x\n".to_owned())])
            .collect();
        let types: Vec<_> = types.iter().map(|(name, body)| (&**name, &**body)).collect();
        with_types("T0 a", &types)
    };
    assert!(parse(&chain(20)).is_ok());
    assert!(parse(&chain(40)).unwrap_err().ends_with("types are nested more than 32 deep"));
    assert!(parse(&chain(10_000)).is_err());
}

#[test]
fn a_type_that_takes_more_than_any_message_is_refused() {
    let types = [("a_msgs/B", "C[50000] c"), ("a_msgs/C", "int8[50000] x")];
    let error = parse(&with_types("B b", &types)).unwrap_err();
    assert!(error.ends_with("it takes at least 2500000000 bytes"), "{error}");
}

#[test]
fn a_path_that_leads_nowhere_is_answered_with_the_nearest() {
    let battery = Definition::of(&shipped("sensor_msgs/msg/BatteryState").unwrap()).unwrap();
    let odometry = Definition::of(&shipped("nav_msgs/msg/Odometry").unwrap()).unwrap();
    let says = |definition, path: &str, expected: &str| {
        let error = Fields::compile(definition, &[path]).unwrap_err().to_string();
        assert_eq!(error, expected);
    };
    says(
        &battery,
        "percentge",
        "find `percentge` in sensor_msgs/msg/BatteryState: the nearest is `percentage`",
    );
    says(&battery, "effort[2]", "find `effort[2]` in sensor_msgs/msg/BatteryState");
    says(
        &odometry,
        "position.x",
        "find `position.x` in nav_msgs/msg/Odometry: the nearest is `pose.pose.position.x`",
    );
    says(
        &odometry,
        "pose.pose.position",
        "read `pose.pose.position` as a number: it is a geometry_msgs/msg/Point",
    );
    says(
        &battery,
        "cell_voltage",
        "read `cell_voltage` as a number: it has several values, the first one is `cell_voltage[0]`",
    );
    says(&battery, "voltage[0]", "read `voltage`: it has a single value, which has no index");
    says(&odometry, "pose.covariance[36]", "read `pose.covariance[36]`: it has at most 36 values");
    says(
        &battery,
        "cell_voltage[one]",
        "read the path \"cell_voltage[one]\": expected names separated by dots, as in `status[0].level`",
    );
}

#[test]
fn every_number_that_is_listed_can_be_read() {
    for name in names() {
        let definition = Definition::of(&shipped(name).unwrap()).unwrap();
        Fields::compile(&definition, &numbers(&definition)).expect(name);
    }
}

/// Lines that are almost valid, which random bytes hardly ever are.
fn lines() -> impl Strategy<Value = String> {
    let word = prop_oneof![
        "[a-z/A-Z]{0,9}",
        Just("int8".to_owned()),
        Just("float64".to_owned()),
        Just("string".to_owned()),
        Just("B".to_owned()),
        Just("a_msgs/A".to_owned()),
    ];
    let count = prop_oneof![Just(String::new()), "\\[(<=)?[0-9]{0,12}\\]", "<=[0-9]{1,3}"];
    let line = (word, count, "[ \t=]{0,3}[a-z0-9]{0,6}[ =#].{0,4}")
        .prop_map(|(word, count, rest)| format!("{word}{count} {rest}\n"));
    let separator = Just(format!("{}\nMSG: a_msgs/B\n", "=".repeat(80)));
    proptest::collection::vec(prop_oneof![8 => line, 1 => separator, 1 => ".*\n"], 0..12)
        .prop_map(|lines| lines.concat())
}

proptest! {
    #[test]
    fn any_text_is_a_definition_or_an_error(name in "[a-zA-Z_/]{0,20}", text in ".*") {
        drop(Definition::parse(&name, &text));
    }

    #[test]
    fn what_a_text_defines_can_be_hashed_and_read(
        text in lines(),
        bytes in proptest::collection::vec(any::<u8>(), 0..200),
    ) {
        if let Ok(definition) = parse(&text) {
            prop_assert!(definition.hash().starts_with("RIHS01_"));
            let cdr = [&[0, 1, 0, 0], &bytes[..]].concat();
            let fields = Fields::compile(&definition, &numbers(&definition)).unwrap();
            let read = fields.read(&cdr, &mut Vec::new());
            prop_assert!(read.is_ok() || flatten(&definition, &cdr, 20).is_err());
        }
    }

    #[test]
    fn any_bytes_are_a_message_or_an_error(
        name in proptest::sample::select(names().collect::<Vec<_>>()),
        big in any::<bool>(),
        bytes in proptest::collection::vec(any::<u8>(), 0..300),
    ) {
        let definition = Definition::of(&shipped(name).unwrap()).unwrap();
        let cdr = [&[0, u8::from(!big), 0, 0], &bytes[..]].concat();
        let values = flatten(&definition, &cdr, usize::MAX);
        let fields = Fields::compile(&definition, &numbers(&definition)).unwrap();
        let read = fields.read(&cdr, &mut Vec::new());
        prop_assert!(values.is_err() || read.is_ok(), "what can be listed can be read");
    }
}

/// Would take ages if every path through the types were followed.
#[test]
fn types_without_numbers_that_are_nested_without_end_have_none() {
    let line = "=".repeat(80);
    let level = |level: u32| {
        let next = level + 1;
        format!("{line}\nMSG: a_msgs/A{level}\nA{next}[] x\nA{next}[] y\n")
    };
    let levels: String = (1..30).map(level).collect();
    let text = format!("A1[] x\nA1[] y\n{levels}{line}\nMSG: a_msgs/A30\n");
    let definition = Definition::parse("a_msgs/msg/A0", &text).unwrap();
    assert_eq!(numbers(&definition), Vec::<String>::new());
}

#[test]
fn a_name_longer_than_any_is_refused() {
    let named =
        |length: usize| Definition::parse("a_msgs/msg/A", &format!("uint8 {}", "x".repeat(length)));
    assert!(named(255).is_ok() && named(256).is_err());
}

#[test]
fn an_array_larger_than_all_memory_is_an_error_and_not_an_overflow() {
    for count in [1_u64 << 29, 1 << 61, u64::MAX] {
        for kind in ["float64", "string", "wstring", "uint8"] {
            let Ok(definition) = Definition::parse("a_msgs/msg/A", &format!("{kind}[{count}] x"))
            else {
                continue;
            };
            assert!(flatten(&definition, &[0, 1, 0, 0, 1, 2, 3, 4], 100).is_err());
        }
    }
}
