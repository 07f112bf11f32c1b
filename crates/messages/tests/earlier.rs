//! Descriptions of earlier versions are read, as written by an independent implementation (`rosbags` 0.11.9) with the
//! definition of that time.

use teampulse_core::stream::{Channel, Origin, Schema, Signal};
use teampulse_messages::catalogue::shipped;
use teampulse_messages::convert::{decode, description};
use teampulse_messages::standard::Message;
use teampulse_messages::standard::teampulse_msgs::StreamDescription;

/// Little endian, then big endian.
const RECORDED: [&str; 2] = [
    "0001000000f1536515cd5b070100000000000000230000002f68756d616e732f706572736f6e732f703030312f706f6c6172\
     5f6831302f6563670000180000007465616d70756c73655f6d7367732f6d73672f5761766500040000006563670000000000\
     0500000070303031000000000a000000706f6c61725f68313000010002000000030000002f610000030000002f6200000200\
     00006d00000001000000040000006563670001000000020000005600000000000000004060408dedb5a0f7c6b03e03000000\
     642e00",
    "000000006553f100075bcd150000000100000000000000232f68756d616e732f706572736f6e732f703030312f706f6c6172\
     5f6831302f6563670000000000187465616d70756c73655f6d7367732f6d73672f5761766500000000046563670000000000\
     0000000570303031000000000000000a706f6c61725f68313000010000000002000000032f610000000000032f6200000000\
     00026d00000000000001000000046563670000000001000000025600000040604000000000003eb0c6f7a0b5ed8d00000003\
     642e00",
];

fn bytes(hex: &str) -> Vec<u8> {
    let digits = |place| u8::from_str_radix(&hex[place..place + 2], 16).expect("two digits");
    (0..hex.len()).step_by(2).map(digits).collect()
}

/// The type as it was: without the fields that were added.
fn earlier_schema() -> Schema {
    let schema = Schema::clone(&shipped(StreamDescription::NAME).expect("ours is shipped"));
    let added = [
        "string family",
        "float64 NO_WINDOW",
        "float64 PHASES",
        "float64 window_secs",
        "string beside",
    ];
    let is_earlier = |line: &&str| added.iter().all(|added| !line.starts_with(added));
    let text = schema.text.lines().filter(is_earlier).collect::<Vec<_>>().join("\n");
    Schema { text: text.replace("float64[] scales", "float64 scale"), ..schema }
}

#[test]
fn a_recorded_description_is_read_by_its_own_definition() {
    for recorded in RECORDED.map(bytes) {
        let stream = description(&earlier_schema(), &recorded).expect("a description");
        assert_eq!(stream.name, "/humans/persons/p001/polar_h10/ecg");
        assert_eq!((stream.signal, stream.origin), (Signal::Ecg, Origin::Derived));
        assert_eq!((&*stream.doc, &*stream.family, stream.window), ("d.", "ecg", None));
        assert_eq!(stream.channels, [Channel { scale: 1e-6, ..Channel::new("ecg", "V") }]);
        assert!(decode(StreamDescription::NAME, &recorded).is_err(), "it has other fields");
    }
}

#[test]
fn one_that_was_cut_is_refused_whatever_its_definition() {
    let recorded = bytes(RECORDED[0]);
    let cut = &recorded[..recorded.len() / 2];
    assert!(description(&shipped(StreamDescription::NAME).expect("shipped"), cut).is_err());
}
